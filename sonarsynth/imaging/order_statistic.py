"""Beams by a quantile of |y| over time, such as the median, which single loud samples hardly change."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt, Lt

from sonarsynth.conventions import Floats, Number
from sonarsynth.description import description
from sonarsynth.imaging.time_statistics import TimeStatistic


@description
class OrderStatistic(TimeStatistic):
    """Level of a beam by a quantile of |y| over time, for impulsive noise: see `time_statistics`.

    Detection index of the median as in the table of `LpMean`: 6.16, 6.75, 7.10, 7.30 for alpha 1.2, 1.5, 1.8, 2.0. Of
    quantile q, a share 1 - q of the samples may be as loud as it likes.
    """

    kind: Literal["order_statistic"] = "order_statistic"
    quantile: Annotated[Number, Gt(0), Lt(1)] = 0.5
    """Quantile of the sensors' magnitudes: 0.5 is the median."""

    def row(self) -> str:
        """Its kind, and the quantile."""
        return f"{self.kind}, quantile {self.quantile:g}"

    def amplitude(self, magnitude: Floats) -> Floats:
        """The quantile over samples or windows."""
        return np.asarray(np.quantile(magnitude, self.quantile, axis=-1))
