"""What frames of a store hold of the sea alone: the record before the sound of the first listed snap arrives."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, direction
from sonarsynth.description import FieldError
from sonarsynth.evaluation.soundscape.sound import (
    MOST_SAMPLES,
    SHORTEST,
    ArrivalElevations,
    NothingHeard,
    Sound,
    listeners,
    model_notes,
)
from sonarsynth.geometry import rotation_matrix
from sonarsynth.receiver import Elements
from sonarsynth.receiver.sensor_errors import SensorState
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.reading import RecipeError
from sonarsynth.signals.chorus.chorus_synthesis import spare_time
from sonarsynth.store import Folder, Mismatch
from sonarsynth.store.checking.recipe_files import files_of, recipe_with

if TYPE_CHECKING:
    import xarray as xr

MOST_FRAMES = 2048
"""Frames that are read."""


def recipe_of_store(tree: xr.DataTree, path: Folder, files: Path | str | None) -> Recipe:
    """The recipe that a store holds; files: folder of those that it names. Raises Mismatch."""
    try:
        return recipe_with(
            str(tree.attrs["recipe"]), str(path), files_of(path, {str(k): v for k, v in tree.attrs.items()}, files)
        )
    except KeyError:
        raise Mismatch(f"{path}: holds no recipe, which the model is of") from None
    except (RecipeError, FieldError, OSError) as error:
        raise Mismatch(f"{path}: its recipe cannot be read any more: {error}") from None


def stored_sound(tree: xr.DataTree, recipe: Recipe) -> Sound:
    """Frames before the first listed snap is heard at any hydrophone; of a frame without one, all of it.

    Raises NothingHeard where the store has no signals, no frame, no working hydrophone, or no such part, or where that
    holds numbers that are not finite.
    """
    scene = recipe.scene_of(0)
    signals = tree["signals"].dataset if "signals" in tree.children else None
    if signals is None or "pressure" not in signals:
        raise NothingHeard("the store holds no signals: build it with --products signals")
    start = np.asarray(signals["start"].values, float)
    frames = np.flatnonzero(np.isfinite(start[: recipe.steps(0)]))[:MOST_FRAMES]
    if not frames.size:
        raise NothingHeard("no frame of the first sequence of the store has been built yet")
    array = _elements(signals)
    chosen = listeners(array, _working(tree, frames, array.count))
    rate = float(signals["sampling_frequency"])
    spare = spare_time(array, scene.sonar, float(scene.sonar.assumed_sound_speed))
    quiet = _quiet_seconds(tree, frames, start[frames], signals.sizes["sample"] / rate) - spare
    size = int(np.floor(np.median(quiet) * rate))
    used = frames[quiet * rate >= size]
    if size < SHORTEST or used.size < 2:
        raise NothingHeard(
            f"frames hold {max(1e3 * float(np.median(quiet)), 0.0):.2g} ms before the listed snaps are heard, and what "
            "follows is their sound and its echoes: too little to measure; draw the recipe instead"
        )
    used = used[: max(MOST_SAMPLES // (chosen.size * size), 2)]
    pressure = signals["pressure"].isel(frame=used, sensor=chosen, sample=slice(0, size)).values
    if not np.isfinite(pressure).all():
        raise NothingHeard("the signals of the store hold numbers that are not finite")
    if not np.abs(pressure).max() > 0.0:
        raise NothingHeard("the store is silent before the listed snaps are heard")
    return Sound(
        pressure=np.asarray(pressure, np.float32),
        sampling_frequency=rate,
        position=array.position[chosen],
        running=False,
        band=(scene.sonar.band.low, scene.sonar.band.high),
        arrivals=_arrivals(tree, frames, signals.sizes["sample"] / rate),
        notes=(
            f"of {used.size} frames the {1e3 * size / rate:.3g} ms before the listed snaps are heard: the rest is "
            "their sound and its echoes",
            "frames are too short for gaps between loud arrivals",
            *model_notes(scene),
        ),
    )


def _elements(signals: Any) -> Elements:
    position = np.asarray(signals["position"].values, float)
    none = np.full(len(position), -1)
    return Elements(position, np.asarray(signals["gain"].values, float), 0.0, 0.0, none, none, 0, 0)


def _working(tree: xr.DataTree, frames: npt.NDArray[np.int64], count: int) -> npt.NDArray[np.bool_]:
    """Which hydrophones work in all frames."""
    try:
        state = np.asarray(tree["truth/sensors/state"].values)[frames]
    except KeyError:
        return np.ones(count, bool)
    return np.asarray((state == SensorState.WORKING).all(axis=0))


def _quiet_seconds(tree: xr.DataTree, frames: npt.NDArray[np.int64], start: Floats, long: float) -> Floats:
    """How long (frame,) a record is before the first listed snap arrives at the centre."""
    arrival = np.asarray(tree["truth/emissions/arrival"].values, float)[frames]
    first = np.min(np.where(np.isfinite(arrival), arrival, np.inf), axis=1, initial=np.inf)
    return np.asarray(np.minimum(first - start, long))


def _arrivals(tree: xr.DataTree, frames: npt.NDArray[np.int64], long: float) -> ArrivalElevations | None:
    """Paths of the chorus above a level at which the loudest of each frame, which the store lists, are all."""
    if "soundscape" not in tree["truth"].children:
        return None
    listed = tree["truth/soundscape"].dataset
    names = ("level", "azimuth", "elevation")
    level, azimuth, elevation = (np.asarray(listed[name].values, float)[frames] for name in names)
    turned = np.asarray(tree["truth"]["sonar_orientation"].values, float)[frames]
    toward = direction(np.deg2rad(azimuth), np.deg2rad(elevation))
    up = np.einsum("fpx,fx->fp", toward, np.stack([rotation_matrix(q)[2] for q in turned]))
    last = level[:, -1]
    above = float(np.nanmax(last)) if np.isfinite(last).any() else -np.inf
    if not np.isfinite(above):
        above = float(np.nanmin(level)) if np.isfinite(level).any() else 0.0
    complete = level > above
    return ArrivalElevations(up[complete], np.ones(int(complete.sum())), above, len(frames) * long)
