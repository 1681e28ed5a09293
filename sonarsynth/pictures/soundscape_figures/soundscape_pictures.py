"""The soundscape of a recipe or of a store: measured, predicted, drawn."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.evaluation.soundscape.made_sound import listening_plan, made_sound
from sonarsynth.evaluation.soundscape.measured import MeasuredFigures, measure
from sonarsynth.evaluation.soundscape.model import sound_model
from sonarsynth.evaluation.soundscape.predicted import PASCAL, PredictedFigures, as_json, predict
from sonarsynth.evaluation.soundscape.recorded_sound import SeaRecording, recorded_sound
from sonarsynth.evaluation.soundscape.sound import NothingHeard
from sonarsynth.evaluation.soundscape.stored_sound import recipe_of_store, stored_sound
from sonarsynth.pictures.figures.style import save
from sonarsynth.pictures.soundscape_figures.soundscape_figure import soundscape_figure
from sonarsynth.pictures.store_reading import NothingToDraw, opened
from sonarsynth.recipe import Recipe
from sonarsynth.store import Folder, folder_of

SECONDS = 2.0
"""Of a recipe's sound that is made."""


@dataclass(frozen=True, eq=False)
class Soundscape:
    """Figures of a sound, of its model, and of a recording."""

    title: str
    measured: MeasuredFigures
    predicted: PredictedFigures
    recording: MeasuredFigures | None = None

    def as_json(self) -> dict[str, Any]:
        """All numbers, for programs; null where there is none."""
        content = {"title": self.title, **as_json(self.measured, self.predicted)}
        return content if self.recording is None else content | {"recording": as_json(self.recording)}

    def summary(self) -> list[str]:
        """The figures in a few lines, each beside its model."""
        figures, wide, model = self.measured.figures, self.measured.spread, self.predicted
        lines = [
            f"level in the band: {figures.moments[0] + PASCAL:.1f} +- {wide.moments[0]:.1f} dB re 1 uPa rms "
            f"(model {model.root + PASCAL:.1f}, +- {model.scatter:.1f} in so short a time)"
        ]
        off = figures.octaves - model.octaves
        if off.size:
            lines.append(
                f"1/3 octaves: {np.mean(off):+.2f} dB re the model on average, at most {np.abs(off).max():.2f} dB off, "
                f"spread {np.mean(wide.octaves):.2f} dB"
            )
        if model.rates is not None:
            rows = zip(self.measured.levels, figures.rates, wide.rates, model.rates, strict=True)
            lines += [
                f"arrivals over {level + PASCAL:.0f} dB: {rate:.3g} +- {spread:.3g} /s (model {predicted:.3g})"
                for level, rate, spread, predicted in rows
            ]
        if np.isfinite(figures.fano[0]):
            lines.append(
                f"Fano factor of loud arrivals: {figures.fano[0]:.2g} +- {wide.fano[0]:.1g} (model {model.fano:.2g})"
            )
        return [*lines, *(f"note: {note}" for note in self.measured.sound.notes)]


def soundscape_of_recipe(recipe: Recipe, seconds: float = SECONDS, compare: SeaRecording | None = None) -> Soundscape:
    """Make a stretch of the sound of a recipe, of its first sequence, without its targets and listed snaps, and measure
    it. Raises FieldError, NothingToDraw where there is no sound, RecordingError."""
    try:
        plan = listening_plan(recipe, seconds)
        recording = _recording(recipe, compare)
        first = recipe.frame(0)[1]
        measured = measure(made_sound(plan, first, seconds))
    except NothingHeard as error:
        raise NothingToDraw(str(error)) from None
    return Soundscape(recipe.title, measured, predict(sound_model(plan, first), measured), recording)


def soundscape_of_store(
    store: str | Folder, files: Path | str | None = None, compare: SeaRecording | None = None
) -> Soundscape:
    """Measure what the frames of a store hold of the sea alone, beside the model of its recipe, whose files are looked
    for in a folder `files`. Raises NothingToDraw where it holds none of that, Mismatch, RecordingError."""
    path = folder_of(store)
    tree = opened(path)
    try:
        recipe = recipe_of_store(tree, path, files)
        sound = stored_sound(tree, recipe)
        plan = listening_plan(recipe)
        measured, recording = measure(sound), _recording(recipe, compare)
    except NothingHeard as error:
        raise NothingToDraw(f"{path}: {error}") from None
    return Soundscape(recipe.title, measured, predict(sound_model(plan, recipe.frame(0)[1]), measured), recording)


def _recording(recipe: Recipe, compare: SeaRecording | None) -> MeasuredFigures | None:
    if compare is None:
        return None
    return measure(recorded_sound(compare, recipe.scene_of(0).sonar))


def draw_soundscape(analysis: Soundscape, out: Path) -> Path:
    """Draw the sheet of figures into a file; returns it."""
    fig = soundscape_figure(analysis.title, analysis.measured, analysis.predicted, analysis.recording)
    return save(fig, out, dpi=110)


def soundscape(
    source: Recipe | str | Folder,
    out: Path | str = "soundscape.png",
    *,
    seconds: float = SECONDS,
    compare: Path | str | None = None,
    pascals: float | None = None,
    channel: int = 0,
    dataset: str | None = None,
    sampling_frequency: float | None = None,
    files: Path | str | None = None,
) -> Soundscape:
    """Measure what hydrophones hear of the sea of a recipe or a store beside its model, and draw it.

    Parameters
    ----------
    source: a recipe, or a store (a folder or a URL).
    out: file of the picture.
    seconds: of a recipe's sound to make.
    compare: a recording (WAV or HDF5) whose figures are put beside them.
    pascals: pressure (Pa) of the number 1 in it, the full scale of a WAV of whole numbers.
    channel: of the recording, from 0.
    dataset: of an HDF5 that has several.
    sampling_frequency: Hz, of an HDF5 that does not say it.
    files: folder of the files that a store's recipe names.

    Returns
    -------
    The figures: measured, of the model, and of the recording.

    Raises
    ------
    FieldError, NothingToDraw (a ValueError) where there is no sound, RecordingError, Mismatch.
    """
    beside = None if compare is None else SeaRecording(compare, pascals, channel, dataset, sampling_frequency)
    if isinstance(source, Recipe):
        analysis = soundscape_of_recipe(source, seconds, beside)
    else:
        analysis = soundscape_of_store(source, files, beside)
    draw_soundscape(analysis, Path(out))
    return analysis
