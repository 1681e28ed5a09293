"""What a detector sees of a frame: the image and the points, and no truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.store import Damage

if TYPE_CHECKING:
    import xarray as xr

    from sonarsynth.store.frame_reading import FrameReader

BLOCK: Final = 64
"""Frames that are read at once."""


@dataclass(frozen=True, eq=False)
class SonarView:
    """The image and the points of one frame.

    | column | shape | unit | |
    |---|---|---|---|
    | `energy` | (elevation, azimuth) | Pa2 s | of each beam; NaN where the direct pulse left none |
    | `azimuth`, `elevation` | (azimuth,), (elevation,) | degree | of the beams |
    | `beam_width` | | degree | half power, at the middle of the band |
    | `points` | (point, 4) | degree, degree, m, Pa2 s | azimuth, elevation, range, energy; empty without a cloud |
    """

    energy: Floats
    azimuth: Floats
    elevation: Floats
    beam_width: float
    points: Floats

    @property
    def step(self) -> float:
        """Degrees between beams that follow each other."""
        steps = np.concatenate([np.diff(self.azimuth), np.diff(self.elevation)])
        return float(np.mean(steps)) if len(steps) else self.beam_width

    @property
    def reach(self) -> int:
        """Beams that a beam width holds, one at least."""
        return max(1, round(min(self.beam_width / self.step, float(max(self.energy.shape)))))


def beam_width(tree: xr.DataTree | FrameReader) -> float:
    """Half-power beam width (rad) of the array at the centre of its band, from the attributes of the store.

    Disc: 1.03 lambda / D (first-order; Van Trees 2002, table 4.1).
    """
    low, high = tree.attrs["band_low"], tree.attrs["band_high"]
    extent = 2.0 * np.float64(tree.attrs["aperture_radius"])
    with np.errstate(divide="ignore"):  # one place has no beam: every direction is the same
        return float(1.03 * tree.attrs["assumed_sound_speed"] / (0.5 * (low + high)) / extent)


def views(tree: xr.DataTree, frames: np.ndarray) -> Iterator[tuple[int, SonarView]]:
    """Each of some frames of a store whose images were built, with its number. Raises Damage where one is missing."""
    image = tree["image"].dataset
    width = float(np.rad2deg(beam_width(tree)))
    azimuth, elevation = (np.asarray(image[axis].values, float) for axis in ("azimuth", "elevation"))
    for start in range(0, len(frames), BLOCK):
        block = frames[start : start + BLOCK]
        energy = np.asarray(image["energy"].isel(frame=block).values)
        for row, (frame, points) in enumerate(zip(block.tolist(), _points(tree, block), strict=True)):
            must_be_there(energy[row], frame)
            yield frame, SonarView(energy[row].astype(float), azimuth, elevation, width, points)


def must_be_there(energy: np.ndarray, frame: int) -> None:
    """Raise Damage where the image of a frame that was built has no number: its file is gone, and zarr fills in NaN."""
    if np.isnan(energy).all():
        raise Damage(f"image/energy: that of frame {frame} is missing: 'sonarsynth repair' restores it")


def _points(tree: xr.DataTree, frames: np.ndarray) -> list[Floats]:
    """Points (point, 4) of each frame."""
    if "cloud" not in tree.children:
        return [np.zeros((0, 4))] * len(frames)
    cloud = tree["cloud"].dataset.isel(frame=frames)
    counts = np.maximum(cloud["count"].values, 0)
    cloud = cloud.isel(point=slice(0, int(counts.max(initial=0))))
    table = np.stack([cloud[name].values for name in ("azimuth", "elevation", "range", "energy")], axis=-1)
    return [rows[:count].astype(float) for rows, count in zip(table, counts, strict=True)]
