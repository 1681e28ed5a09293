"""The snap of a recipe, drawn: waveform and spectrum, as it is made and as the sonar hears it, and the filter."""

from __future__ import annotations

from pathlib import Path

from sonarsynth.description import FieldError
from sonarsynth.pictures.figures.snap_figure import snap_figure
from sonarsynth.recipe import Recipe
from sonarsynth.signals.filtered_pulse import fir


def snap(recipe: Recipe, out: Path | str = "snap.png") -> Path:
    """Draw the first shrimp's snap, unvaried, before and after the sonar's filter. Returns the file written.

    Raises FieldError without a shrimp, or where its snap cannot be made.
    """
    sources = recipe.scene.world.sources
    if not sources:
        raise FieldError(("scene", "world", "sources"), "is empty: there is no snap to draw")
    try:
        model = sources[0].model(recipe.scene.world.environment.depth)
        chosen = fir(recipe.scene.sonar.antialias)
        figure = snap_figure(lambda highest: model.pulse(0.0, highest), chosen, sources[0].level)
    except ValueError as error:
        raise FieldError(("scene", "world", "sources", 0, sources[0].pulse_field), str(error)) from None
    file = Path(out)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file)
    return file
