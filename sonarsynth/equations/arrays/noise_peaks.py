"""How many peaks Gaussian noise has in a volume that is searched."""

from __future__ import annotations

from math import exp, log, pi, sqrt

from sonarsynth.conventions import Floats

LOWEST = 3.0
"""Of the mean power: peaks under this are not told from each other, so that no threshold is lower."""
PRECISION = 1e-13
"""Of a level."""


def expected_peaks(level: float, size: Floats) -> float:
    """Expected number of peaks of |z|^2 over `level`, z complex Gaussian noise with E|z|^2 = 1 in a box.

    size (axis,): lengths of the box along up to three axes, in units of 1/sqrt(lambda), lambda the variance of the
    derivative of Re z along the axis over the variance of Re z. High peaks are counted by the Euler characteristic of
    the set over the level: sum over d of mu_d rho_d, mu_d the intrinsic volumes of the box, with, at u = 2 level,

        rho_0 = e, rho_1 = (u/2 pi)^1/2 e, rho_2 = (u - 1) e/(2 pi), rho_3 = (u^2 - 3 u) e/((2 pi)^3/2 u^1/2),

    e = exp(-u/2). An axis that is not resolved (size well below one) adds nothing.
    Source: Worsley (1994), Advances in Applied Probability 26, 13, theorem 3.5, for chi-squared fields, two degrees of
    freedom.
    """
    x, y, z = [float(length) for length in size] + [0.0] * (3 - len(size))
    u = 2.0 * level
    lines, planes = (x + y + z) * sqrt(u / (2 * pi)), (x * y + y * z + z * x) * (u - 1.0) / (2 * pi)
    return exp(-level) * (1.0 + lines + planes + x * y * z * (u**2 - 3 * u) / (sqrt(2 * pi) ** 3 * sqrt(u)))


def peak_level(false_alarms: float, size: Floats) -> float:
    """Level, over the mean power of noise, that so many peaks exceed on average (`expected_peaks`)."""
    level, step = LOWEST, log(expected_peaks(LOWEST, size) / false_alarms)
    while step > PRECISION * level:  # peaks are exp(-level) times what grows with it: no step goes too far
        level += step
        step = log(expected_peaks(level, size) / false_alarms)
    return level
