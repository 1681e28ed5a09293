"""Images and boxes in the format of COCO: what most image detectors are trained with."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sonarsynth.conventions import Progress
from sonarsynth.description import FieldError
from sonarsynth.detection.sonar_view import must_be_there
from sonarsynth.evaluation.detectors import true_objects
from sonarsynth.evaluation.detectors.true_objects import TrueObjects, category_names
from sonarsynth.labels.views.range_cells_met import box_of
from sonarsynth.store import splits_of
from sonarsynth.store.files.place import write_atomically

if TYPE_CHECKING:
    import xarray as xr

DECIBELS: Final = 40.0
"""Range of the grey values, below the brightest beam of each image: 255 is that beam, 0 all that is fainter."""
LOST: Final = (
    f"images are grey values of a byte, {DECIBELS:g} dB below the brightest beam of each: how bright that is, is lost",
    "row 0 is the lowest elevation, in range images the nearest range, and column 0 the beam farthest to starboard",
    "signals, beams against delay, points, source estimates, meshes, poses and the link budget are left out",
    "clutter has no annotation: what a detector finds there is a false alarm",
)
"""What an export lacks, a line each."""


class _Pictures(NamedTuple):
    """Pictures of a store, and where they go."""

    group: str
    folder: str
    file: str  # ending of the JSON files
    whose: str  # path of the targets of their pixels


PICTURES: Final = (
    _Pictures("image", "images", "", "truth/beams/target"),
    _Pictures("range_image", "range_images", "_ranges", "range_image/target"),
)


def write_coco(
    tree: xr.DataTree,
    folder: Path,
    frames: np.ndarray,
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write images and annotations of some frames of a store: `images/<frame>.png` and, of each split, `<split>.json`
    (train.json of a recipe without splits); of range images `range_images/<frame>.png` and `<split>_ranges.json`.

    An annotation is an object as `evaluate` has it: its `bbox` is `pixel_box`, its mask the beams that point at it (the
    box, where none does), and beside what COCO asks for it has `track_id` (the slot of the target), `range`, `azimuth`,
    `elevation`, `aspect`, `visibility` and `snr`. In a range image the mask is of the cells in which beams meet it, and
    the box is about these: an object that none meets is left out. Images and categories have the numbers of detections
    (see `sonarsynth.detection.read`). Returns the JSON files. Raises FieldError for a store without images, OSError.
    """
    there = [pictures for pictures in PICTURES if pictures.group in tree.children]
    if not there:
        raise FieldError(("image",), "the store has no images: it was built without that product")
    objects, splits, files = true_objects(tree, frames), splits_of(tree, frames), list[Path]()
    for n, pictures in enumerate(there):
        (folder / pictures.folder).mkdir(parents=True, exist_ok=True)
        entries: dict[str, dict[str, Any]] = {}
        for done, (frame, split) in enumerate(zip(frames.tolist(), splits, strict=True), 1):
            entry = entries.setdefault(split, _head(tree))
            entry["images"].append(_write_image(tree, folder, frame, pictures))
            whose = np.asarray(tree[pictures.whose].isel(frame=frame).values)
            entry["annotations"] += _annotations(objects, frame, whose, pictures)
            if progress is not None:
                progress(n * len(frames) + done, len(there) * len(frames), 0)
        for split_name, entry in entries.items():
            files.append(folder / f"{split_name}{pictures.file}.json")
            write_atomically(files[-1], json.dumps(entry).encode())
    return tuple(files)


def _annotations(objects: TrueObjects, frame: int, whose: np.ndarray, pictures: _Pictures) -> Iterator[dict[str, Any]]:
    for row in np.flatnonzero(objects.frame == frame).tolist():
        mask = whose == objects.target[row]
        box = tuple(objects.box[row].tolist()) if pictures.group == "image" else box_of(mask)
        if box is not None:
            yield _annotation(objects, row, mask, box)


def _head(tree: xr.DataTree) -> dict[str, Any]:
    names = enumerate(category_names(tree), 1)
    return {
        "info": {"description": str(tree.attrs.get("title", "")), "version": "1.0", "left_out": list(LOST)},
        "licenses": [{"id": 1, "name": str(tree.attrs.get("licence", "")), "url": ""}],
        "categories": [{"id": number, "name": name, "supercategory": "target"} for number, name in names],
        "images": [],
        "annotations": [],
    }


def _write_image(tree: xr.DataTree, folder: Path, frame: int, pictures: _Pictures) -> dict[str, Any]:
    """Write an image; its entry."""
    from PIL import Image

    energy = np.asarray(tree[f"{pictures.group}/energy"].isel(frame=frame).values)
    if pictures.group == "image":
        must_be_there(energy, frame)
    energy = np.nan_to_num(energy)
    file = folder / pictures.folder / f"{frame:06d}.png"
    Image.fromarray(grey(energy)).save(file)
    height, width = energy.shape
    return {"id": frame, "file_name": f"{pictures.folder}/{file.name}", "width": width, "height": height, "license": 1}


def grey(energy: np.ndarray) -> np.ndarray:
    """Grey values (uint8) of energies, in dB re the brightest; 0 of an image that holds nothing."""
    brightest = float(energy.max())
    if not brightest > 0.0:
        return np.zeros(energy.shape, np.uint8)
    level = 10.0 * np.log10(np.maximum(energy.astype(float) / brightest, 1e-30))
    return np.asarray(np.rint(255.0 * np.clip(1.0 + level / DECIBELS, 0.0, 1.0)), np.uint8)


def _annotation(objects: TrueObjects, row: int, mask: np.ndarray, box: tuple[float, ...]) -> dict[str, Any]:
    x0, y0, x1, y1 = box
    corners: list[list[float]] = [[x0, y0, x1, y0, x1, y1, x0, y1]]
    more = {"visibility": "visible", "snr": "snr", "range": "range", "aspect": "aspect"}
    more |= {"azimuth": "azimuth", "elevation": "elevation"}
    measures = {name: float(getattr(objects, column)[row]) for name, column in more.items()}
    return {
        "id": row + 1,
        "image_id": int(objects.frame[row]),
        "category_id": int(objects.category[row]) + 1,
        "bbox": [x0, y0, x1 - x0, y1 - y0],
        "area": float(mask.sum()) or (x1 - x0) * (y1 - y0),
        "segmentation": {"counts": _run_lengths(mask), "size": list(mask.shape)} if mask.any() else corners,
        "iscrowd": 0,
        "track_id": int(objects.target[row]),
        **{name: value for name, value in measures.items() if np.isfinite(value)},
    }


def _run_lengths(mask: np.ndarray) -> Sequence[int]:
    """Lengths of runs of 0 and 1 down the columns, 0 first, as COCO counts a mask."""
    values = np.concatenate([[0], mask.ravel(order="F").astype(int)])
    changes = np.flatnonzero(np.diff(values)) if mask.any() else np.zeros(0, int)
    return [int(n) for n in np.diff(np.concatenate([[0], changes, [mask.size]]))]
