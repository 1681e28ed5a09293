"""Which detection is of which object: greedily, the surest first, as COCO does it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.detection import Detections
from sonarsynth.evaluation.detectors.true_objects import TrueObjects

Closeness = Callable[[Detections, TrueObjects, Ints, Ints], Floats]
"""(detection, object) of some rows of one frame: the higher, the closer."""


def overlap(detections: Detections, objects: TrueObjects, rows: Ints, others: Ints) -> Floats:
    """Intersection over union of boxes; 0 where a detection has none."""
    a, b = detections.box[rows][:, None], objects.box[others][None]
    sides = np.minimum(a[..., 2:], b[..., 2:]) - np.maximum(a[..., :2], b[..., :2])
    both = np.maximum(sides, 0.0).prod(axis=-1)
    area = [(box[..., 2:] - box[..., :2]).prod(axis=-1) for box in (a, b)]
    union = area[0] + area[1] - both
    return np.asarray(np.nan_to_num(np.divide(both, union, out=np.zeros_like(both), where=union > 0.0)))


def nearness(detections: Detections, objects: TrueObjects, rows: Ints, others: Ints) -> Floats:
    """Minus the distance (m) of the middles; of a detection without a range, across the line of sight at the range of
    the object."""
    far = objects.range[others][None]
    away = np.where(np.isfinite(detections.range[rows])[:, None], detections.range[rows][:, None], far)
    ours = away[..., None] * _directions(detections.azimuth[rows], detections.elevation[rows])[:, None]
    true = far[..., None] * _directions(objects.azimuth[others], objects.elevation[others])[None]
    return np.asarray(np.nan_to_num(-np.linalg.norm(ours - true, axis=-1), nan=-np.inf))


def _directions(azimuth: Floats, elevation: Floats) -> Floats:
    """Unit vectors (row, xyz) of angles in degrees."""
    a, e = np.deg2rad(azimuth), np.deg2rad(elevation)
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)


def match(detections: Detections, objects: TrueObjects, closeness: Closeness, least: Sequence[float]) -> Ints:
    """The object (threshold, detection) that each detection is of, -1 for none.

    In each frame the surest detection takes the closest object that is free, if that is as close as `least`. One that
    names a category takes objects of that category alone. Source: Lin et al. (2014), Microsoft COCO, and its
    evaluation code.
    """
    matched = np.full((len(least), len(detections)), -1)
    for rows, others in _frames(detections, objects):
        close = closeness(detections, objects, rows, others)
        named, true = detections.category[rows][:, None], objects.category[others][None]
        close = np.where((named < 0) | (named == true), close, -np.inf)
        for n, limit in enumerate(least):
            free = close.copy()
            for row in range(len(rows)):
                best = int(free[row].argmax())
                if free[row, best] >= limit:
                    matched[n, rows[row]] = others[best]
                    free[:, best] = -np.inf
    return matched


def _frames(detections: Detections, objects: TrueObjects) -> Iterator[tuple[Ints, Ints]]:
    """Rows of each frame that has both, those of detections by falling score."""
    surest = np.argsort(-detections.score, kind="stable")
    surest = surest[np.argsort(detections.frame[surest], kind="stable")]
    order = np.argsort(objects.frame, kind="stable")
    for frame in np.intersect1d(detections.frame, objects.frame):
        first, last = (np.searchsorted(detections.frame[surest], frame, side) for side in ("left", "right"))
        begin, end = (np.searchsorted(objects.frame[order], frame, side) for side in ("left", "right"))
        yield surest[first:last], order[begin:end]
