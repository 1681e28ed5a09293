"""How far detections are from the objects that they are of, and whether they know."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.detection import Detections
from sonarsynth.evaluation.detectors.matching import nearness
from sonarsynth.evaluation.detectors.true_objects import TrueObjects

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
