"""The cheapest kernel deposit that errs no more than is allowed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.products import Arrivals, Signals
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals.gridded_synthesis import GriddedSynthesis
from sonarsynth.state import Snap

DEFAULT_ERROR = 3e-4
"""Error of the synthesis where no plan says what is allowed."""
PRECISIONS: Final[tuple[Literal["float32", "float64"], ...]] = ("float32", "float64")
ROUNDING: Final[dict[str, float]] = {"float32": 3e-6, "float64": 1e-9}
"""What the precision of the grid and its table of the kernel leave."""
SPENT = 0.4
"""Error of the signals over the tolerance of each other approximation of `GriddedSynthesis`, at most (its table)."""
LEFT = 0.3
"""Share of the error allowed that kernel and precision must leave to the other approximations."""
LEAST_TOLERANCE, MOST_TOLERANCE = 1e-10, 1e-2


def kernel_error(width: int, oversampling: float) -> float:
    """Error of spreading a path over so many samples: 2 exp(-pi width sqrt(1 - 1/oversampling)).

    Source: Barnett, Magland and af Klinteberg (2019), SIAM J. Sci. Comput. 41, C479, eq. 1.8 (their kernel; ours has
    the same decay).
    """
    return float(2.0 * np.exp(-np.pi * width * np.sqrt(1.0 - 1.0 / oversampling)))


def deposit_error(method: GriddedSynthesis) -> float:
    """Error of echoes relative to their peak, a bound on what was measured (the tables of `GriddedSynthesis`)."""
    kernel = kernel_error(method.width, method.oversampling)
    return kernel + SPENT * method.tolerance + ROUNDING[method.precision]


def deposit_for(error: float) -> GriddedSynthesis:
    """The cheapest `GriddedSynthesis` whose error is no more, or the most exact one."""
    for width in range(6, 17, 2):
        kernel = kernel_error(width, GriddedSynthesis().oversampling)
        for precision in PRECISIONS:
            left = (error - kernel - ROUNDING[precision]) / SPENT
            if left >= LEFT * error / SPENT:
                tolerance = min(left, MOST_TOLERANCE)
                digit = 10.0 ** np.floor(np.log10(tolerance))
                down = float(f"{np.floor(tolerance / digit) * digit:.1g}")
                return GriddedSynthesis(width=width, precision=precision, tolerance=down)
    return GriddedSynthesis(width=16, precision="float64", tolerance=LEAST_TOLERANCE)


@description
class AutoSynthesis:
    """`GriddedSynthesis`, as exact as the accuracy of the recipe asks for."""

    kind: Literal["auto"] = "auto"

    def resolve(self, error: float = DEFAULT_ERROR) -> GriddedSynthesis:
        """The method whose echoes err by no more, relative to their peak."""
        return deposit_for(error)

    def signals(
        self,
        arrivals: Arrivals,
        snaps: tuple[Snap, ...],
        elements: Elements,
        sonar: Sonar,
        absorption: Callable[[Floats], Floats] | None,
        start: float,
        samples: int,
    ) -> Signals:
        """Pressure at each hydrophone, to `DEFAULT_ERROR`; arguments and errors as in `SignalSynthesis`."""
        return self.resolve().signals(arrivals, snaps, elements, sonar, absorption, start, samples)
