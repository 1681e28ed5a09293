"""The gentle filter that pulses are added behind: it rings for a tenth of the time of the sonar's own."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.receiver import Filter, Sonar, stop_frequency
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.gridded.nodes import chebyshev
from sonarsynth.signals.pulse_sums.pulse_modes import NODES

GENTLE = 66.0
"""dB: its attenuation."""


def grid_factor(sonar: Sonar) -> int:
    """Samples of the grid that pulses are added on, for one of the sonar: room for a gentle filter over its band."""
    return 1 if 2.0 * stop_frequency(sonar.antialias) < 0.92 * sonar.sampling_frequency else 2


def gentle(chosen: Filter, rate: float) -> Fir:
    """A filter that passes what the sonar's does, and stops what would fold into that on a grid of that rate (Hz)."""
    own = fir(chosen)
    low, stop = max(own.low - own.transition, 0.0), stop_frequency(chosen)
    width = min(rate - 2.0 * stop, 1.05 * low or np.inf)
    return Fir(max(low - 0.5 * width, 0.0), stop + 0.5 * width, width, GENTLE)


def node_frequencies(sonar: Sonar) -> Floats:
    """Frequencies (node,) in Hz that modes are made at: Chebyshev nodes over all that the gentle filter passes."""
    passing = gentle(sonar.antialias, sonar.sampling_frequency * grid_factor(sonar))
    low = max(passing.low - 0.5 * passing.transition, 0.0)
    high = passing.high + 0.5 * passing.transition
    return 0.5 * (low + high) + 0.5 * (high - low) * chebyshev(NODES)
