"""What a threshold without any training finds in a store: whether there is anything to learn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sonarsynth.conventions import counted, evenly
from sonarsynth.detection import by_kind, detections_of, from_rows, views
from sonarsynth.evaluation.detectors.detector_scores import DetectorReport
from sonarsynth.evaluation.detectors.true_objects import category_names, true_objects

if TYPE_CHECKING:
    import xarray as xr

TRIVIAL: Final = 0.95
"""Average precision at 2 m of a threshold, over which there is nothing to learn."""
MOST: Final = 200
"""Frames that are looked at, in even steps."""


def threshold_lines(tree: xr.DataTree, frames: np.ndarray) -> list[str]:
    """What a threshold reaches in frames that were built, in words, with a warning where that is all there is to find;
    nothing without images or objects."""
    used = frames[evenly(len(frames), MOST)]
    objects = true_objects(tree, used)
    if "image" not in tree.children or not len(objects):
        return []
    peaks = by_kind("peaks")
    rows = [{"frame": frame, **row} for frame, view in views(tree, used) for row in detections_of(view, peaks)]
    report = DetectorReport(len(used), tuple(category_names(tree)), from_rows(rows), objects)
    reached = float(report.as_json()["ap_2m"])
    precision = f"a threshold reaches an average precision of {reached:.2f} (at 2 m, {counted(len(objects), 'object')}"
    snr = objects.snr[np.isfinite(objects.snr)]
    ratios = f", snr {snr.min():.0f} to {snr.max():.0f} dB" if len(snr) else ""
    lines = [f"{precision} in {counted(len(used), 'frame')}{ratios})"]
    return [*lines, "warning: there is little to learn from this dataset"] if reached > TRIVIAL else lines
