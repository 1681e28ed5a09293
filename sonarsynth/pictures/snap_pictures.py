"""The snap of a recipe, drawn: waveform and spectrum, as it is made and as the sonar hears it, and the filter."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from sonarsynth.description import FieldError
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.pictures.figures.snap_comparison import SnapComparison, compare_snaps
from sonarsynth.pictures.figures.snap_figure import snap_figure
from sonarsynth.pictures.figures.style import save
from sonarsynth.recipe import Recipe, must_be_recipe
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.sources.recordings import RecordedSnap, RecordingError, read_recording

FADE = 0.05
"""Part of a recording that fades in, and that fades out: one that is cut off has steps at its ends."""


def snap(recipe: Recipe, out: Path | str = "snap.png", compare: Path | str | None = None) -> Path:
    """Draw the first shrimp's snap, unvaried, before and after the sonar's filter.

    Parameters
    ----------
    recipe: whose shrimp it is.
    out: file of the picture.
    compare: a recording (WAV, CSV, text) of a snap that is drawn beside it.

    Returns
    -------
    The file written.

    Raises
    ------
    FieldError without a shrimp, or where its snap cannot be made, RecordingError where the recording cannot be read or
    compared.
    """
    return draw_snap(recipe, Path(out), compare)[0]


def draw_snap(recipe: Recipe, out: Path, compare: Path | str | None = None) -> tuple[Path, SnapComparison | None]:
    """As `snap`; the file and the comparison."""
    must_be_recipe(recipe, "drawn")
    sources = recipe.scene.world.sources
    if not sources:
        raise FieldError(("scene", "world", "sources"), "is empty: there is no snap to draw")
    band = recipe.scene.sonar.band
    comparison = None
    try:
        model = sources[0].model(recipe.scene.world.environment.depth)
        chosen = fir(recipe.scene.sonar.antialias)
        if compare is not None:
            comparison = _compared(compare, lambda highest: model.pulse(0.0, highest), (band.low, band.high))
        figure = snap_figure(lambda highest: model.pulse(0.0, highest), chosen, sources[0].level, comparison)
    except RecordingError:
        raise
    except ValueError as error:
        raise FieldError(("scene", "world", "sources", 0, sources[0].pulse_field), str(error)) from None
    return save(figure, out), comparison


def _compared(file: Path | str, model: Callable[[float], Pulse], band: tuple[float, float]) -> SnapComparison:
    """The model beside a recording, whose ends fade. Raises RecordingError."""
    recording = read_recording(RecordedSnap(path=str(file), fade=FADE))
    try:
        return compare_snaps(model, recording, band)
    except ValueError as error:
        raise RecordingError(f"{file}: {error}") from None
