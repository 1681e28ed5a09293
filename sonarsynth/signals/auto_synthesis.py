"""The cheapest kernel deposit that errs no more than is allowed."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.products import Arrivals, Signals
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.gridded_synthesis import ROUNDING, GriddedSynthesis, error_over_tolerance, kernel_error
from sonarsynth.signals.segments import Reception
from sonarsynth.state import Emission

DEFAULT_ERROR = 3e-4
"""Error of the synthesis where no plan says what is allowed."""
PRECISIONS: Final[tuple[Literal["float32", "float64"], ...]] = ("float32", "float64")
KERNELS: Final = ((8, 1.25), (8, 1.5), (8, 2.0), (16, 1.25), (16, 1.5))
"""Widths, which cost as much as the next multiple of eight, and oversamplings of the deposit, from the cheapest on."""
LEFT = 0.3
"""Share of the error allowed that kernel and precision must leave to the other approximations."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1e-10, 1e-2


def deposit_for(error: float, bandwidth: float = np.inf) -> GriddedSynthesis:
    """The cheapest `GriddedSynthesis` whose error in a band (Hz) is no more, or the most exact one."""
    for width, oversampling in KERNELS:
        kernel = kernel_error(width, oversampling, bandwidth)
        for precision in PRECISIONS:
            allowed = (error - kernel - ROUNDING[precision]) / error_over_tolerance(bandwidth)
            if allowed >= LEFT * error / error_over_tolerance(bandwidth):
                tolerance = min(allowed, MOST_TOLERANCE)
                digit = 10.0 ** np.floor(np.log10(tolerance))
                down = float(f"{np.floor(tolerance / digit) * digit:.1g}")
                return GriddedSynthesis(width=width, oversampling=oversampling, precision=precision, tolerance=down)
    return GriddedSynthesis(width=16, precision="float64", tolerance=LEAST_TOLERANCE)


@description
class AutoSynthesis(Method):
    """`GriddedSynthesis`, as exact as the accuracy of the recipe asks for."""

    kind: Literal["auto"] = "auto"

    def resolve(self, demand: Demand) -> tuple[GriddedSynthesis | DirectSum, float]:
        """The cheapest method whose echoes err by no more than is allowed, relative to their peak."""
        if demand.exact:
            return DirectSum().resolve(demand)
        return deposit_for(demand.allowed, demand.bandwidth).resolve(demand)

    def signals(self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception) -> Signals:
        """Pressure at each hydrophone, to `DEFAULT_ERROR`; as `SignalSynthesis.signals`."""
        return deposit_for(DEFAULT_ERROR).signals(arrivals, snaps, reception)
