"""Which detection is of which object, greedily, the surest first, as COCO does it; and what that makes of errors and
precision."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

import numpy as np

from sonarsynth.conventions import Floats, Ints, direction
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
    ours, true = (
        direction(np.deg2rad(of.azimuth[those]), np.deg2rad(of.elevation[those]))
        for of, those in ((detections, rows), (objects, others))
    )
    apart = away[..., None] * ours[:, None] - far[..., None] * true[None]
    return np.asarray(np.nan_to_num(-np.linalg.norm(apart, axis=-1), nan=-np.inf))


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


RECALLS: Final = np.linspace(0.0, 1.0, 101)
"""Where COCO reads the precision."""


def average_precision(score: Floats, hit: np.ndarray, objects: int) -> float:
    """Mean over 101 recalls from 0 to 1 of the best precision at that recall or a higher one; NaN without objects.

    score, hit: (detection,) how sure each is, and whether it is of an object. Source: Lin et al. (2014), Microsoft
    COCO, and its evaluation code.
    """
    if objects == 0:
        return float("nan")
    order = np.argsort(-score, kind="stable")
    hits = np.cumsum(hit[order])
    precision = hits / np.arange(1, len(hits) + 1)
    best = np.maximum.accumulate(precision[::-1])[::-1]
    first = np.searchsorted(hits / objects, RECALLS, side="left")
    return float(np.where(first < len(best), np.append(best, 0.0)[np.minimum(first, len(best))], 0.0).mean())


def threshold_at(score: Floats, hit: np.ndarray, false_alarms: float) -> float:
    """The least score at which no more detections than so many are of no object."""
    wrong = np.sort(score[~hit])[::-1]
    allowed = int(np.floor(false_alarms + 1e-9))
    return float(np.nextafter(wrong[allowed], np.inf)) if allowed < len(wrong) else float("-inf")


QUANTITIES: Final = {"range": "m", "azimuth": "degree", "elevation": "degree"}


def measurement_errors(detections: Detections, objects: TrueObjects, matched: Ints) -> dict[str, Any]:
    """Errors of the detections that are of an object: median, mean and root mean square, and where a detector predicts
    its errors, the share within one and three of them and the standard deviation of their ratio.

    matched: (detection,) the object of each, -1 for none.
    """
    rows = np.flatnonzero(matched >= 0)
    errors: dict[str, Any] = {}
    for name, unit in QUANTITIES.items():
        error = getattr(detections, name)[rows] - getattr(objects, name)[matched[rows]]
        if name == "azimuth":
            error = (error + 180.0) % 360.0 - 180.0  # 359 deg is 1 deg from 0
        errors[name] = _figures(error, unit) | _calibration(error, getattr(detections, f"{name}_error")[rows])
    ranged = rows[np.isfinite(detections.range[rows])]
    apart = np.array([-nearness(detections, objects, rows[None], matched[rows][None]).item() for rows in ranged])
    errors["position"] = _figures(apart, "m")
    return errors


def _figures(error: Floats, unit: str) -> dict[str, Any]:
    error = error[np.isfinite(error)]
    if not len(error):
        return {"count": 0, "unit": unit}
    return {
        "count": len(error),
        "unit": unit,
        "median_abs": float(np.median(np.abs(error))),
        "mean": float(error.mean()),
        "rms": float(np.sqrt(np.mean(error**2))),
    }


def _calibration(error: Floats, predicted: Floats) -> dict[str, Any]:
    """How errors compare with predicted ones; empty where none are predicted."""
    has_both = np.isfinite(error) & (predicted > 0.0)
    if not has_both.any():
        return {}
    ratio = error[has_both] / predicted[has_both]
    return {
        "predicted": int(has_both.sum()),
        "share_within_1": float(np.mean(np.abs(ratio) <= 1.0)),
        "share_within_3": float(np.mean(np.abs(ratio) <= 3.0)),
        "pull_std": float(ratio.std()),
    }
