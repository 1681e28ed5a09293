"""What an array hears of louder echoes beside its beams, by side lobes and grating lobes."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import diric

from sonarsynth.conventions import Bools, Floats
from sonarsynth.equations.arrays.apertures import live_gain
from sonarsynth.ranging.picking.peak_kernels import farthest, over_lobes
from sonarsynth.ranging.received_window import ReceivedWindow
from sonarsynth.receiver import Band, Elements

LOBES = 8.0
"""Times what lobes bring of louder peaks that a peak must exceed: echoes are of more than their peaks."""
LOBE_BINS = 48
"""Frequencies that lobes are summed over."""
LOBE_STEPS, LOBE_ERROR = 128, 4e-4
"""Steps a period at the highest frequency that lobes are tabulated at; and what such a table errs by."""


def clear_of_lobes(
    window: ReceivedWindow, width: float, direction: Floats, delay: Floats, height: Floats, least: Floats
) -> Bools:
    """Whether `least` (peak,) is more than what lobes bring of louder peaks from directions (peak, xyz), at delays
    (peak,) in s, of heights (peak,)."""
    loud, c = np.argsort(-height, kind="stable"), window.sonar.assumed_sound_speed
    array = _lobes(window.elements, window.sonar.band, c)
    own = np.empty(len(height), bool)
    own[loud] = over_lobes(
        direction[loud] / c,
        delay[loud],
        height[loud],
        array.position,
        array.weight,
        array.frequency,
        array.taper,
        2.0 * width / c,
        least[loud] / LOBES,
        array.table,
        array.rate,
        LOBE_ERROR,
    )
    return own


class _Lobes(NamedTuple):
    """An array as `over_lobes` takes it."""

    position: Floats  # (sensor, xyz) m: of live elements
    weight: Floats  # (sensor,) of sum one
    frequency: Floats  # (bin,) Hz
    taper: Floats  # (bin,)
    table: Floats  # (2, delay)
    rate: float  # Hz: of the table


@lru_cache(maxsize=16)
def _lobes(elements: Elements, band: Band, sound_speed: float) -> _Lobes:
    live, rate = np.flatnonzero(elements.gain), LOBE_STEPS * band.high
    position, weight = elements.position[live], live_gain(elements.gain)[live]
    steps = int(np.ceil((4.0 * farthest(position) / sound_speed + 2.0 / (band.high - band.low)) * rate)) + 2
    taper = np.sin(np.pi * (np.arange(LOBE_BINS) + 0.5) / LOBE_BINS) ** 2
    table = _lobe_table(band.low, band.high, rate, steps)
    return _Lobes(position, weight, np.linspace(band.low, band.high, LOBE_BINS), taper, table, rate)


def _lobe_table(low: float, high: float, rate: float, steps: int) -> Floats:
    """Sum (2, delay) over the band low to high (Hz), tapered, at delays in steps of 1/rate (Hz), `steps` either way."""
    delay = np.arange(-steps, steps + 1) / rate
    bin_angle, taper_angle = 2.0 * np.pi * delay * (high - low) / (LOBE_BINS - 1), 2.0 * np.pi / LOBE_BINS
    # sin^2 is a constant and a cosine: three sums of a geometric series
    size = diric(bin_angle, LOBE_BINS)
    size += 0.5 * (diric(bin_angle + taper_angle, LOBE_BINS) + diric(bin_angle - taper_angle, LOBE_BINS))
    turn = np.pi * (low + high) * delay
    return np.ascontiguousarray([size * np.cos(turn), size * np.sin(turn)])
