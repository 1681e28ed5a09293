"""Places: where the snap and the points are, against where they should be."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sonarsynth.geometry import Pose
from sonarsynth.verification.ledger import snaps_heard
from sonarsynth.verification.reading import Check, numbered, of_frame


def snap_located(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The located snap is within three predicted errors of the true one in 95 % of frames (Mahalanobis distance).

    Three standard errors in each of three axes: the chi-square of three degrees of freedom that has the probability
    of three sigma (99.73 %) is 14.16. A snap whose sound reaches the array directly and that is not found counts too.
    """
    good, total, errors, missed = 0, 0, [], set()
    for i in frames:
        pose = Pose(of_frame(tree, "truth/sonar_position", i), of_frame(tree, "truth/sonar_orientation", i))
        true = pose.to_body(of_frame(tree, "truth/snap_position", i))
        found, covariance = of_frame(tree, "bearings/position", i), of_frame(tree, "bearings/position_covariance", i)
        reached = snaps_heard(tree, i)
        rows = np.flatnonzero(np.isfinite(found).all(axis=1))
        total += max(len(rows), int(reached.sum()))
        if len(rows) < reached.sum():
            missed.add(i)
        for row in rows:
            each = np.linalg.norm(true - found[row], axis=1)
            error = found[row] - true[np.argmin(each)]
            errors.append(float(np.min(each)))
            near = bool(error @ np.linalg.solve(covariance[row], error) <= 14.16)
            good += near
            if not near:
                missed.add(i)
    name, expected = "snap located", "within 3 predicted errors in 95 %"
    if not total:
        return Check(name, expected, "no snap reaches the array", None, {})
    if not errors:
        return Check(name, expected, f"none of {total} found", False, {"good": 0, "found": 0}, numbered(sorted(missed)))
    got = f"{good} of {total}, median error {np.median(errors):.3g} m"
    numbers = {"good": good, "found": len(errors), "median_m": float(np.median(errors))}
    return Check(name, expected, got, good >= 0.95 * total, numbers, numbered(sorted(missed)))
