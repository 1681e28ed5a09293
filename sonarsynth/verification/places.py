"""Places: where the points are, against where they should be."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from sonarsynth.verification.beams import near_target
from sonarsynth.verification.reading import Check, of_frame


def range_errors(tree: xr.DataTree, frames: np.ndarray) -> list[Check]:
    """Range errors of the points on a target, and the count of those off it.

    How large they are depends on the scene (beam width, size of the glints); that they are as predicted does not.
    """
    errors, scaled, off, near, beams = [], [], 0, 0, 0
    for i in frames:
        found, predicted = of_frame(tree, "cloud/range", i), of_frame(tree, "cloud/range_error", i)
        true, target = of_frame(tree, "truth/range", i), of_frame(tree, "truth/target", i)
        points, on = np.isfinite(found), target >= 0
        beams += int(on.sum())
        errors.append(np.abs(found - true)[points & on])
        scaled.append(errors[-1] / predicted[points & on])
        off += int((points & ~on).sum())
        near += int((points & ~on & near_target(tree, target)).sum())
    error, ratio = np.concatenate(errors), np.concatenate(scaled)
    if not len(error):
        return [Check("range of points on target", "reported", "no points on a target", None, {"off_target": off})]
    median, share = float(np.median(error)), float(np.mean(ratio <= 3))
    numbers: dict[str, Any] = {
        "points": len(error),
        "median_m": median,
        "share_within_3": share,
        "beams_on_target": beams,
    }
    return [
        Check(
            "range of points on target",
            "reported",
            f"median error {100 * median:.2g} cm over {len(error)} points",
            None,
            numbers,
        ),
        Check("predicted range errors", "90 % within three", f"{100 * share:.3g} %", share >= 0.9, numbers),
        Check(
            "points off target",
            "reported",
            f"{off} ({near} within a beam width of an outline) beside {len(error)} on it",
            None,
            {"off_target": off, "near_outline": near},
        ),
    ]
