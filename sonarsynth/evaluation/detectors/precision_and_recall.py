"""Figures of merit of detections that are matched to objects."""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Floats

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
