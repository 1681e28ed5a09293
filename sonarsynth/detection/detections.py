"""Detections: what a detector says there is, and the file that they are exchanged in, the results format of COCO."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.store.files.place import write_atomically

MEASURED: Final = ("azimuth", "elevation", "range", "azimuth_error", "elevation_error", "range_error")
"""What a detection may say besides its box, by the names of the file."""
MOST_BYTES: Final = 2**30
"""Of a file."""
LARGEST: Final = 1e100
"""Of numbers: the area of a box is finite too."""


class DetectionsError(ValueError):
    """A file of detections that cannot be read: one line that names the file and the entry."""


@dataclass(frozen=True, eq=False)
class Detections:
    """Detections of the frames of a store, a row each. What is not said is NaN, or -1 of `category`.

    | column | shape | unit | |
    |---|---|---|---|
    | `frame` | (row,) | 1 | number of the frame |
    | `category` | (row,) | 1 | number of the category in the store, -1: not said |
    | `score` | (row,) | any | the higher, the surer |
    | `box` | (row, 4) | beams | x0, y0, x1, y1 as `pixel_box` of the store |
    | `azimuth`, `elevation` | (row,) | degree | of the middle, sonar frame |
    | `range` | (row,) | m | from the array centre to the middle |
    | `azimuth_error`, `elevation_error`, `range_error` | (row,) | as above | predicted standard errors |
    """

    frame: Ints
    category: Ints
    score: Floats
    box: Floats
    azimuth: Floats
    elevation: Floats
    range: Floats
    azimuth_error: Floats
    elevation_error: Floats
    range_error: Floats

    def __len__(self) -> int:
        return len(self.frame)

    def take(self, rows: np.ndarray) -> Detections:
        """Some of the rows, by number or by mask."""
        return Detections(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def write(self, path: str | Path) -> Path:
        """Write them as COCO results (see `read`), into a folder that is made. Raises OSError."""
        columns = {name: getattr(self, name).tolist() for name in MEASURED}
        rows = []
        for i, (frame, category, score) in enumerate(
            zip(self.frame.tolist(), self.category.tolist(), self.score.tolist(), strict=True)
        ):
            row: dict[str, Any] = {"image_id": frame, "score": score}
            if category >= 0:
                row["category_id"] = category + 1
            if np.isfinite(self.box[i]).all():
                x0, y0, x1, y1 = self.box[i].tolist()
                row["bbox"] = [x0, y0, x1 - x0, y1 - y0]
            rows.append(row | {name: values[i] for name, values in columns.items() if np.isfinite(values[i])})
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        write_atomically(Path(path), ("[" + ",\n".join(map(json.dumps, rows)) + "]\n").encode())
        return Path(path)


def from_rows(rows: Iterable[Mapping[str, Any]]) -> Detections:
    """Detections of rows that have some of the columns."""
    listed = list(rows)

    def column(name: str) -> Floats:
        return np.array([row.get(name, np.nan) for row in listed], float)

    return Detections(
        frame=np.array([row["frame"] for row in listed], int),
        category=np.array([row.get("category", -1) for row in listed], int),
        score=np.array([row["score"] for row in listed], float),
        box=np.array([row.get("box", (np.nan,) * 4) for row in listed], float).reshape(-1, 4),
        azimuth=column("azimuth"),
        elevation=column("elevation"),
        range=column("range"),
        azimuth_error=column("azimuth_error"),
        elevation_error=column("elevation_error"),
        range_error=column("range_error"),
    )


def read(path: str | Path) -> Detections:
    """Read detections: a JSON list with an object each, as COCO has results, and what sonar has besides.

    `image_id` is the number of the frame, `score` anything that grows with certainty, `category_id` 1 + the number of
    the category in the store (left out or 0: not said), `bbox` [x0, y0, width, height] in beams as `pixel_box`. What
    else is read: `azimuth`, `elevation` (deg, sonar frame), `range` (m), and `azimuth_error`, `elevation_error`,
    `range_error`, their predicted standard errors. One of `bbox` and the two angles must be there. Raises
    DetectionsError, OSError.
    """
    file = Path(path)
    if file.stat().st_size > MOST_BYTES:
        raise DetectionsError(f"{file}: is larger than {MOST_BYTES / 2**30:g} GiB")
    try:
        listed = json.loads(file.read_text(encoding="utf-8"), object_pairs_hook=_object)
    except (ValueError, RecursionError) as error:
        raise DetectionsError(f"{file}: is no JSON ({error})") from None
    if not isinstance(listed, list):
        raise DetectionsError(f"{file}: must be a list of detections, as the results of COCO are")
    return from_rows(_row(entry, f"{file}: detection {n}") for n, entry in enumerate(listed))


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of JSON, which may hold each name once. Raises ValueError."""
    entry = dict(pairs)
    if len(entry) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"an object has {next(name for name in names if names.count(name) > 1)[:40]!r} twice")
    return entry


def _row(entry: object, where: str) -> dict[str, Any]:
    """One entry of a file as columns."""
    if not isinstance(entry, dict):
        raise DetectionsError(f"{where}: must be an object with image_id, score and bbox")
    row: dict[str, Any] = {"frame": _whole_number(entry, "image_id", where), "score": _number(entry, "score", where)}
    if "category_id" in entry:
        row["category"] = _whole_number(entry, "category_id", where) - 1
    row |= {name: _number(entry, name, where) for name in MEASURED if entry.get(name) is not None}
    for name in ("range", *(name for name in MEASURED if name.endswith("_error"))):
        if row.get(name, 0.0) < 0.0:
            raise DetectionsError(f"{where}: {name} must not be negative")
    if abs(row.get("elevation", 0.0)) > 90.0:
        raise DetectionsError(f"{where}: elevation must be within 90 degrees")
    if entry.get("bbox") is not None:
        box = entry["bbox"]
        if not (isinstance(box, list) and len(box) == 4):
            raise DetectionsError(f"{where}: bbox must be [x0, y0, width, height]")
        x, y, width, height = (_number({"bbox": value}, "bbox", where) for value in box)
        if width < 0 or height < 0:
            raise DetectionsError(f"{where}: bbox must not have a negative width or height")
        row["box"] = (x, y, x + width, y + height)
    elif not {"azimuth", "elevation"} <= row.keys():
        raise DetectionsError(f"{where}: must have a bbox, or azimuth and elevation")
    return row


def _number(entry: Mapping[str, Any], name: str, where: str) -> float:
    value = entry.get(name)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise DetectionsError(f"{where}: {name} must be a finite number")
    return float(value)


def _whole_number(entry: Mapping[str, Any], name: str, where: str) -> int:
    value = _number(entry, name, where)
    if value != int(value) or not 0 <= value < 2**31:
        raise DetectionsError(f"{where}: {name} must be a whole number, 0 or more")
    return int(value)
