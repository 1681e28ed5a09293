"""The snap as the sonar hears it at 1 m: through the anti-alias filter."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.acoustics import snap as snaps
from sonarsynth.acoustics import spectra
from sonarsynth.acoustics.snap import Bubble, ComplexArray
from sonarsynth.acoustics.spectra import Fir
from sonarsynth.conventions import Floats
from sonarsynth.sonar import Filter, LowPass
from sonarsynth.world.moment import Snap
from sonarsynth.world.sources import LogarithmicBubble


def bubble(model: LogarithmicBubble) -> Bubble:
    """The constants of a described snap, as the equations take them."""
    return Bubble(model.a, model.k, model.m, model.q, model.density)


def fir(chosen: Filter) -> Fir:
    """The numbers of a described filter, as the equations take them."""
    low = 0.0 if isinstance(chosen, LowPass) else chosen.low
    high = chosen.cutoff if isinstance(chosen, LowPass) else chosen.high
    return Fir(low, high, chosen.transition, chosen.attenuation)


def pulse_support(
    model: LogarithmicBubble, chosen: Filter, tolerance: float = spectra.SUPPORT_TOLERANCE
) -> tuple[float, float]:
    """How long (s) before and after its collapse the filtered snap exceeds `tolerance` of its peak: for laying out
    windows."""
    return spectra.pulse_support(bubble(model), fir(chosen), tolerance)


@lru_cache(maxsize=64)
def _spectrum(model: LogarithmicBubble, chosen: Filter, sampling_frequency: float, samples: int) -> ComplexArray:
    f = np.asarray(np.arange(samples // 2 + 1) * (sampling_frequency / samples), float)
    value = snaps.spectrum(f, bubble(model)) * spectra.response(f, fir(chosen))
    value[2 * f >= sampling_frequency] = 0.0
    value.setflags(write=False)
    return value


def pulse_spectrum(
    model: LogarithmicBubble, chosen: Filter, sampling_frequency: float, samples: int
) -> tuple[Floats, ComplexArray]:
    """Frequencies (bin,) in Hz and spectrum (bin,) in Pa s of the filtered snap at 1 m, at the `rfft` bins of a sample
    grid.

    What the filter leaves at and above half the sampling frequency (under its attenuation) is left out, not folded.
    """
    f = np.asarray(np.arange(samples // 2 + 1) * (sampling_frequency / samples), float)
    return f, _spectrum(model, chosen, sampling_frequency, samples)


def snap_levels(heard: tuple[Snap, ...]) -> Floats:
    """(snap,) peak source level of each snap (dB re 1 uPa at 1 m)."""
    return np.array([snaps.source_level(bubble(s.model)) if s.source_level is None else s.source_level for s in heard])
