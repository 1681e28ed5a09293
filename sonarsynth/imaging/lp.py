"""Beams by the mean of |y|^p: a small p makes little of single loud samples."""

from __future__ import annotations

from math import gamma, pi, sqrt
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, Number
from sonarsynth.description import description
from sonarsynth.imaging.time_statistics import TimeStatistic


@description
class LpMean(TimeStatistic):
    """Level of a beam by the mean of |y|^p over time, for impulsive noise: see `time_statistics`.

    Its detection index, by how many standard deviations ln of the level is higher for a beam 3 dB brighter, of 600
    independent samples of symmetric alpha-stable noise (alpha 2 is Gaussian):

        alpha    p = 2      1    0.5    log
        1.2       0.40   0.93   3.96   6.07
        1.5       0.61   1.99   6.15   6.80
        1.8       1.12   5.01   8.53   7.33
        2.0       12.0   11.3   10.0   7.67

    (40 000 draws.) p below alpha/2 is wanted: only there |y|^p has a variance, and the index grows as the root of the
    number of samples (`detection_index`). With p = 2 it is delay and sum, but for the rounding of the window's ends.
    """

    kind: Literal["lp"] = "lp"
    p: Annotated[Number, Ge(0), Le(2)] = 0.5
    """Power of the mean; 0: the mean of ln |y|, to which the others tend."""

    def row(self) -> str:
        """Its kind, and the power."""
        return f"{self.kind}, p {self.p:g}"

    def amplitude(self, magnitude: Floats) -> Floats:
        """See `power_mean`."""
        return power_mean(magnitude, self.p)


def power_mean(magnitude: Floats, p: float) -> Floats:
    """(mean |y|^p)^(1/p) over the last axis, exp(mean ln |y|) for p = 0: (...), in the unit of magnitude |y| (..., n).

    Source: Hardy, Littlewood & Polya (1934), Inequalities, section 2.2. It rises with p.
    """
    with np.errstate(divide="ignore"):  # silence has no logarithm
        logarithm = np.log(magnitude)
        if p == 0.0:
            return np.asarray(np.exp(np.mean(logarithm, axis=-1)))
        # p may be so small that all |y|^p are one but for rounding.
        return np.asarray(np.exp(np.log1p(np.mean(np.expm1(p * logarithm), axis=-1)) / p))


def detection_index(ratio: float, alpha: float, samples: int, p: float = 0.0) -> float:
    """Index by which a beam is told whose level is higher by `ratio` (dB), of independent samples of symmetric
    alpha-stable noise: standard deviations of the mean of |y|^p, for p = 0 of ln |y|, as many samples make it.

    p ln(10^(ratio/20)) sqrt(n/(E|y|^2p/(E|y|^p)^2 - 1)), and ln(10^(ratio/20))/sqrt(pi^2/6 (1/alpha^2 + 1/2)/n). With p
    from alpha/2 on |y|^p has no variance, however many samples there are: the index of a mean is then that of its
    loudest sample.
    Source: fractional moments and variance of ln |y| from Nikias & Shao (1995), Signal Processing with Alpha-Stable
    Distributions, ch. 2 and 5. Raises ValueError for p from alpha/2 on, but where alpha is 2.
    """
    higher = ratio / 20.0 * np.log(10.0)
    if p == 0.0:
        return float(higher * np.sqrt(samples / (np.pi**2 / 6.0 * (1.0 / alpha**2 + 0.5))))
    if p >= 0.5 * alpha and alpha < 2.0:
        raise ValueError(
            f"|y|^{p:g} of alpha-stable noise of alpha {alpha:g} has no variance: p is under {alpha / 2:g}"
        )
    return float(p * higher * np.sqrt(samples / (_moment(2.0 * p, alpha) / _moment(p, alpha) ** 2 - 1.0)))


def _moment(p: float, alpha: float) -> float:
    """E|y|^p of symmetric alpha-stable noise of unit scale, 0 < p < alpha; of alpha 2, Gaussian of variance 2, any."""
    moment = 2.0**p * gamma(0.5 * (1.0 + p)) / sqrt(pi)
    return float(moment if alpha == 2.0 else moment * gamma(1.0 - p / alpha) / gamma(1.0 - 0.5 * p))
