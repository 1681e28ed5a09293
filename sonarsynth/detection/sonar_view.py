"""What a detector sees of a frame: the image and the points, and no truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import FieldError
from sonarsynth.equations.arrays.apertures import beams_per_width, half_power_width, whole_beams_per_width
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
    | `beam_width` | (2,) | degree | half power, along azimuth and elevation, at the middle of the band |
    | `points` | (point, 4) | degree, degree, m, Pa2 s | azimuth, elevation, range, energy; empty without a cloud |
    """

    energy: Floats
    azimuth: Floats
    elevation: Floats
    beam_width: Floats
    points: Floats

    @property
    def beams_per_width(self) -> Floats:
        """Beams (2,) of the image in a beam width, along azimuth and elevation; one along an axis of a single beam."""
        return beams_per_width(self.beam_width, self.azimuth, self.elevation)

    @property
    def reach(self) -> tuple[int, int]:
        """`beams_per_width` in whole beams, one at least, along elevation and azimuth as the axes of the image."""
        return whole_beams_per_width(self.beam_width, self.azimuth, self.elevation)


def beam_widths(
    tree: xr.DataTree | FrameReader, azimuth: Floats | float = 0.0, elevation: Floats | float = 0.0
) -> Floats:
    """Half-power widths (2, ...) in rad of beams, along azimuth and elevation, at the centre of the band; 2 pi at most.

    azimuth, elevation (...) rad: of the beams; off its axis the array is foreshortened. From the extent of the array in
    the attributes of the store, or that of a disc where an old one does not say it. Raises FieldError for an extent
    that no build writes.
    """
    extent = np.array(tree.attrs.get("aperture_rms", [0.5 * tree.attrs["aperture_radius"]] * 2))
    if extent.shape != (2,) or extent.dtype.kind not in "fiu":
        raise FieldError(("aperture_rms",), "must be two numbers, m across and up")
    wavenumber = 0.5 * (tree.attrs["band_low"] + tree.attrs["band_high"]) / tree.attrs["assumed_sound_speed"]
    seen = np.abs(extent.reshape(2, *[1] * np.ndim(azimuth)) * np.cos(np.stack([azimuth, elevation])))
    return half_power_width(seen, wavenumber)


def beam_width(tree: xr.DataTree | FrameReader) -> float:
    """The wider (rad) of `beam_widths` on the axis of the array."""
    return float(beam_widths(tree).max())


def views(tree: xr.DataTree, frames: np.ndarray) -> Iterator[tuple[int, SonarView]]:
    """Each of some frames of a store whose images were built, with its number. Raises Damage where one is missing."""
    image = tree["image"].dataset
    width = np.rad2deg(beam_widths(tree))
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
