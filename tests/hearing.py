"""A window that holds all of some paths, at an array."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.products import Arrivals
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals import pulse_support
from sonarsynth.signals.segments import Reception
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_pulses import waveform


def hearing(
    of: Arrivals,
    sonar: Sonar,
    array: Elements,
    absorption: Callable[[Floats], Floats] | None = None,
    *,
    margin: float = 1e-4,
) -> Reception:
    """Of snaps of a logarithmic bubble, of any shape, and `margin` (s) at either end."""
    rough = float(of.height_delay_std.max())
    before, after = pulse_support(waveform(LogarithmicBubble()), sonar.antialias, turned=True, rough=rough)
    reach = array.aperture / of.sound_speed + margin
    start, stop = float(of.delay.min() - before - reach), float(of.delay.max() + after + reach)
    return Reception(array, sonar, absorption, start, int(np.ceil((stop - start) * sonar.sampling_frequency)) + 1)
