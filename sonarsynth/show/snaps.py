"""The snap of a recipe, drawn: waveform and spectrum, as it is made and as the sonar hears it, and the filter."""

from __future__ import annotations

from pathlib import Path

from sonarsynth.description import FieldError
from sonarsynth.pictures.snap import snap_figure
from sonarsynth.recipe import Recipe
from sonarsynth.synthesis.pulse import bubble, fir


def show_snap(recipe: Recipe, out: Path) -> None:
    """Write the picture of the first shrimp's snap through the sonar's filter. Raises FieldError without a shrimp."""
    shrimp = recipe.scene.world.shrimp
    if not shrimp:
        raise FieldError(("scene", "world", "shrimp"), "is empty: there is no snap to draw")
    figure = snap_figure(bubble(shrimp[0].snap), fir(recipe.scene.sonar.antialias), shrimp[0].source_level)
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out)
