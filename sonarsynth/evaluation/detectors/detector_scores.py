"""Detections against the truth of a store: average precision, detection against false alarms, errors; by condition."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import Ints, binomial_band
from sonarsynth.description import FieldError
from sonarsynth.detection import Detections, read
from sonarsynth.detection.detection_method import angle_at
from sonarsynth.evaluation.detectors.matching import (
    average_precision,
    match,
    measurement_errors,
    nearness,
    overlap,
    threshold_at,
)
from sonarsynth.evaluation.detectors.true_objects import TrueObjects, as_detections, category_names, true_objects
from sonarsynth.store import chosen_frames, tree_of

if TYPE_CHECKING:
    import xarray as xr

TRUTH: Final = "truth"
"""In place of detections: the truth, judged by itself."""
OVERLAPS: Final = tuple(np.arange(10) * 0.05 + 0.5)
"""Intersections over union at which COCO takes a box for right."""
DISTANCES: Final = (0.5, 1.0, 2.0, 4.0)
"""m between middles, as nuScenes has them: Caesar et al. (2020), section 3.1."""
NEAR: Final = DISTANCES.index(2.0)
"""At which detection probabilities and errors are taken."""
FALSE_ALARMS: Final = (0.01, 0.1, 0.3, 1.0, 3.0)
"""A frame."""
EDGES: Final = {
    "range": ("m", (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 100.0, np.inf)),
    "aspect": ("degree", (0.0, 30.0, 60.0, 120.0, 150.0, 180.0)),
    "snr": ("dB", (-np.inf, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0, np.inf)),
    "visible": ("1", (0.0, 0.25, 0.5, 0.75, 1.0)),
}
"""Limits of the conditions that objects are sorted by."""


@dataclass(frozen=True, eq=False)
class DetectorReport:
    """Detections matched to the objects of a store. `as_json` has the figures."""

    frames: int
    categories: tuple[str, ...]
    detections: Detections
    objects: TrueObjects

    @cached_property
    def by_overlap(self) -> Ints:
        """(overlap, detection) the object of each by its box, -1 for none."""
        return match(self.detections, self.objects, overlap, [min(limit, 1.0 - 1e-10) for limit in OVERLAPS])

    @cached_property
    def by_distance(self) -> Ints:
        """(distance, detection) the object of each by its middle, -1 for none."""
        return match(self.detections, self.objects, nearness, [-limit for limit in DISTANCES])

    @property
    def classifies(self) -> bool:
        """Whether every detection names a category."""
        return bool(len(self.detections) and (self.detections.category >= 0).all())

    def precision(self, matched: Ints, wanted: np.ndarray) -> float:
        """Average precision of the objects (row,) that are wanted: others are neither missed nor false. Of a detector
        that names categories, the mean over them."""
        if not self.classifies:
            return self._precision(matched, wanted, np.ones(len(self.detections), bool))
        precisions = [
            self._precision(matched, wanted & (self.objects.category == n), self.detections.category == n)
            for n in np.unique(self.objects.category[wanted])
        ]
        return float(np.mean(precisions)) if precisions else float("nan")

    def _precision(self, matched: Ints, wanted: np.ndarray, own: np.ndarray) -> float:
        judged = own & ((matched < 0) | np.append(wanted, False)[matched])
        return average_precision(self.detections.score[judged], matched[judged] >= 0, int(wanted.sum()))

    def detected(self, wanted: np.ndarray, false_alarms: float) -> dict[str, float]:
        """Share of the wanted objects (row,) that are found at so many false alarms a frame, with a band of 95 %."""
        matched = self.by_distance[NEAR]
        least = threshold_at(self.detections.score, matched >= 0, false_alarms * self.frames)
        hit_objects = matched[(matched >= 0) & (self.detections.score >= least)]
        hits, trials = int(wanted[hit_objects].sum()), int(wanted.sum())
        low, high = binomial_band(hits, trials)
        share = hits / trials if trials else float("nan")
        return {"false_alarms_a_frame": false_alarms, "detected": share, "low": low, "high": high}

    def of_objects(self, wanted: np.ndarray) -> dict[str, Any]:
        """Figures of some objects (row,)."""
        boxed = bool(np.isfinite(self.detections.box).all()) or not len(self.detections)
        overlaps = [self.precision(row, wanted) for row in self.by_overlap] if boxed else [float("nan")] * len(OVERLAPS)
        distances = [self.precision(row, wanted) for row in self.by_distance]
        return {
            "objects": int(wanted.sum()),
            "ap": float(np.mean(overlaps)),
            "ap50": overlaps[0],
            "ap75": overlaps[5],
            "ap_distance": float(np.mean(distances)),
            **{f"ap_{limit:g}m": value for limit, value in zip(DISTANCES, distances, strict=True)},
        }

    def as_json(self) -> dict[str, Any]:
        """All figures. NaN where there is no object."""
        every = np.ones(len(self.objects), bool)
        return {
            "frames": self.frames,
            "detections": len(self.detections),
            "classifies": self.classifies,
            **self.of_objects(every),
            "detection": [self.detected(every, rate) for rate in FALSE_ALARMS],
            "errors": measurement_errors(self.detections, self.objects, self.by_distance[NEAR]),
            **{
                f"by_{name}": {text: self.of_objects(rows) | self.detected(rows, 1.0) for text, rows in groups}
                for name, groups in self.conditions()
            },
        }

    def conditions(self) -> Iterator[tuple[str, list[tuple[str, np.ndarray]]]]:
        """Masks (row,) of objects by category, range, aspect, snr and visibility; empty ones are left out."""
        objects = self.objects
        yield "category", _not_empty((name, objects.category == n) for n, name in enumerate(self.categories))
        for name, (unit, edges) in EDGES.items():
            values = getattr(objects, name)
            last = len(edges) - 2  # its upper limit belongs to it
            interval = np.minimum(np.searchsorted(edges, values, "right") - 1, last)
            interval = np.where(np.isfinite(values), interval, -1)
            yield (
                name,
                _not_empty((_said(low, high, unit), interval == n) for n, (low, high) in enumerate(pairwise(edges))),
            )


def _not_empty(groups: Iterator[tuple[str, np.ndarray]]) -> list[tuple[str, np.ndarray]]:
    return [(name, rows) for name, rows in groups if rows.any()]


def _said(low: float, high: float, unit: str) -> str:
    symbol = {"degree": " deg", "1": ""}.get(unit, f" {unit}")
    if not np.isfinite(low):
        return f"under {high:g}{symbol}"
    return f"over {low:g}{symbol}" if not np.isfinite(high) else f"{low:g} to {high:g}{symbol}"


def evaluate(
    store: str | Path | xr.DataTree, detections: Detections | str | Path, *, split: str | None = None
) -> DetectorReport:
    """Judge detections by the truth of a store.

    Parameters
    ----------
    store: path, URL or opened tree.
    detections: those of `detect`, the file of another detector (see `sonarsynth.detection.read`), or "truth".
    split: of a store with splits, only these frames: train, validation or test.

    Returns
    -------
    The report: `as_json()` has average precision by the overlap of boxes (as COCO) and by the distance of middles (as
    nuScenes), the share detected at so many false alarms a frame with bands of 95 %, and the errors of range, azimuth,
    elevation and position; all but errors by category, range, aspect, snr and visibility too. Objects are targets in
    view that are no clutter. A band takes objects as independent, which those of one sequence are not.

    Raises
    ------
    FieldError for a split or a category that the store has not, or a frame that was not built; DetectionsError for a
    file that cannot be read, TypeError for what is neither.
    """
    tree = tree_of(store)
    frames = chosen_frames(tree, split)
    objects = true_objects(tree, frames)
    file = "detections" if detections == TRUTH or not isinstance(detections, str | Path) else str(detections)
    if isinstance(detections, str | Path):
        detections = as_detections(objects) if detections == TRUTH else read(detections)
    if not isinstance(detections, Detections):
        kind = type(detections).__name__
        raise TypeError(f"detections must be those of sonarsynth.detect, a file or 'truth', not a {kind}")
    names = tuple(category_names(tree))
    _must_be_of(detections, file, tree.sizes["frame"], frames if split is None else None, names)
    judged = _with_angles(tree, detections.take(np.isin(detections.frame, frames)))
    return DetectorReport(len(frames), names, judged, objects)


def _must_be_of(found: Detections, file: str, total: int, built: np.ndarray | None, names: Sequence[str]) -> None:
    """Raise FieldError for the first detection in a frame or of a category that the store has not."""

    def refuse(wrong: np.ndarray, what: str, column: np.ndarray, why: str) -> None:
        if wrong.any():
            raise FieldError((file,), f"detection {(n := int(np.argmax(wrong)))}: {what} {column[n]} {why}")

    refuse(found.frame >= total, "frame", found.frame, f"is not in the store, which has frames 0 to {total - 1}")
    if built is not None:
        refuse(~np.isin(found.frame, built), "frame", found.frame, "was not built")
    listed = ", ".join(f"{number} {name}" for number, name in enumerate(names, 1))
    refuse(found.category >= len(names), "category_id", found.category + 1, f"is not in the store, which has {listed}")


def words_of(precision: Mapping[str, float], found: Mapping[str, float]) -> tuple[str, ...]:
    """Average precisions, and the share that is found with its band, as people read them: "-" where there is none.
    Both are rows of `DetectorReport.as_json`."""
    figures = (precision[name] for name in ("ap", "ap50", "ap_distance", "ap_2m"))
    return *("-" if math.isnan(figure) else f"{figure:.3f}" for figure in figures), share_found(found)


def share_found(found: Mapping[str, float]) -> str:
    """The share that is found with its band of 95 %, as people read it."""
    detected, low, high = (100.0 * found[name] for name in ("detected", "low", "high"))
    return "-" if math.isnan(detected) else f"{detected:.1f} % ({low:.1f} to {high:.1f})"


def _with_angles(tree: xr.DataTree, detections: Detections) -> Detections:
    """Directions of those that say none: of the middle of the box."""
    grid = tree["truth/beams"].dataset
    directions = {}
    for n, name in enumerate(("azimuth", "elevation")):
        own = getattr(detections, name)
        middle = angle_at(0.5 * (detections.box[:, n] + detections.box[:, n + 2]), np.asarray(grid[name].values))
        directions[name] = np.where(np.isfinite(own), own, middle)
    return replace(detections, **directions)
