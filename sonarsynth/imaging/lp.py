"""Beams by the mean of |y|^p over time: with a small p, single loud samples have little weight."""

from __future__ import annotations

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
    number of samples. With p = 2 it is delay and sum, but for the rounding of the window's ends.
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
