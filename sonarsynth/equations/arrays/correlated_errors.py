"""Fits over an array whose errors are alike at neighbouring sensors."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, Ints

MOST_ALIKE = 0.9
"""Correlation of neighbours at most: above it the few differences that are left tell little."""


def correlated_error_factor(error: Floats, sensor: Ints, neighbour: Ints) -> float:
    """Factor on the variance of a fit, at least 1, where the errors (sensor,) of neighbouring sensors are correlated.

    sensor (live,): which sensors; neighbour (live, near): those next to each. Another wave in the window shifts the
    lags in ripples across the array: neighbours err alike, and direction and curvature err more than by independent
    errors. Errors that correlate by r between neighbours on a lattice, and by r^n between the n-th along
    a row or a column, give means ((1 + r)/(1 - r))^2 times the variance of independent ones.
    Source: Bartlett (1946), J. R. Stat. Soc. Suppl. 8, 27, in both directions.
    """
    total = float(error @ error)
    if not total > 0:
        return 1.0
    alike = float(np.mean(error[sensor][:, None] * error[neighbour])) * len(sensor) / total
    alike = min(max(alike, 0.0), MOST_ALIKE)
    return ((1 + alike) / (1 - alike)) ** 2
