"""What a detector is to find in a store: targets that are in view and no clutter, and what they are like there."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.detection import Detections, from_rows
from sonarsynth.geometry import Pose
from sonarsynth.products import View

if TYPE_CHECKING:
    import xarray as xr

BLOCK: Final = 1000
"""Frames that are read at once."""
_OF_TARGETS: Final = (
    "present", "clutter", "view", "category", "pixel_box", "box_centre", "box_orientation", "visible_fraction",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class TrueObjects:
    """Objects of the frames of a store, a row each.

    | column | shape | unit | |
    |---|---|---|---|
    | `frame`, `category`, `target` | (row,) | 1 | numbers of the store: the target is a slot, the same in all frames |
    | `box` | (row, 4) | beams | `pixel_box` |
    | `azimuth`, `elevation` | (row,) | degree | of `box_centre`, sonar frame |
    | `range` | (row,) | m | of `box_centre` from the array centre |
    | `aspect` | (row,) | degree | from the bow to the direction of the sonar: 0 bow, 90 beam, 180 stern |
    | `visible` | (row,) | 1 | `visible_fraction` |
    | `snr` | (row,) | dB | of `/truth/targets`; in a store without, brightest beam in the box over the median |
    """

    frame: Ints
    category: Ints
    target: Ints
    box: Floats
    azimuth: Floats
    elevation: Floats
    range: Floats
    aspect: Floats
    visible: Floats
    snr: Floats

    def __len__(self) -> int:
        return len(self.frame)


def category_names(tree: xr.DataTree) -> list[str]:
    """What objects of a store are called, by their numbers."""
    return str(tree["truth/targets/category"].attrs.get("flag_meanings", "target")).split()


def true_objects(tree: xr.DataTree, frames: np.ndarray) -> TrueObjects:
    """The objects of some frames."""
    blocks = [_objects_of_frames(tree, frames[start : start + BLOCK]) for start in range(0, max(len(frames), 1), BLOCK)]
    names = [field.name for field in fields(TrueObjects)]
    return TrueObjects(**{name: np.concatenate([block[name] for block in blocks]) for name in names})


def _objects_of_frames(tree: xr.DataTree, frames: np.ndarray) -> dict[str, np.ndarray]:
    targets = tree["truth/targets"].dataset.isel(frame=frames)
    table = {name: np.asarray(targets[name].values) for name in _OF_TARGETS}
    wanted = (table["present"] == 1) & (table["clutter"] == 0)
    wanted &= np.isin(table["view"], (View.IN_VIEW, View.PARTLY_IN_VIEW)) & np.isfinite(table["pixel_box"]).all(axis=-1)
    row, slot = np.nonzero(wanted)
    table = {name: values[row, slot] for name, values in table.items()}
    centre, away = table["box_centre"], np.linalg.norm(table["box_centre"], axis=1)
    ahead = np.array([[1.0, 0.0, 0.0]])
    bow = [Pose(np.zeros(3), turned).turn_to_world(ahead)[0] for turned in table["box_orientation"]]
    to_sonar = -(centre * np.reshape(bow, (-1, 3))).sum(axis=1) / away
    return {
        "frame": frames[row].astype(int),
        "category": table["category"].astype(int),
        "target": slot,
        "box": table["pixel_box"],
        "azimuth": np.rad2deg(np.arctan2(centre[:, 1], centre[:, 0])),
        "elevation": np.rad2deg(np.arcsin(np.clip(centre[:, 2] / away, -1.0, 1.0))),
        "range": away,
        "aspect": np.rad2deg(np.arccos(np.clip(to_sonar, -1.0, 1.0))),
        "visible": table["visible_fraction"],
        "snr": np.asarray(targets["snr"].values)[row, slot]
        if "snr" in targets
        else _over_median(tree, frames, row, table["pixel_box"]),
    }


def _over_median(tree: xr.DataTree, frames: np.ndarray, row: Ints, box: Floats) -> Floats:
    """dB of the brightest beam in each box over the median of its image; NaN without an image."""
    contrast = np.full(len(row), np.nan)
    if "image" not in tree.children or not len(row):
        return contrast
    energy = np.asarray(tree["image"].dataset["energy"].isel(frame=frames).values)
    first = np.floor(box[:, :2]).astype(int)
    stop = np.maximum(np.ceil(box[:, 2:]).astype(int), first + 1)
    for n, (frame, (x0, y0), (x1, y1)) in enumerate(zip(row, first, stop, strict=True)):
        own, every = (pixels[np.isfinite(pixels)] for pixels in (energy[frame, y0:y1, x0:x1], energy[frame]))
        if own.size and np.median(every) > 0.0:
            contrast[n] = 10.0 * np.log10(own.max() / np.median(every))
    return contrast


def as_detections(objects: TrueObjects) -> Detections:
    """The truth as a detector without errors would report it."""
    names = ("frame", "category", "box", "azimuth", "elevation", "range")
    columns = [getattr(objects, name).tolist() for name in names]
    return from_rows(dict(zip(names, row, strict=True)) | {"score": 1.0} for row in zip(*columns, strict=True))
