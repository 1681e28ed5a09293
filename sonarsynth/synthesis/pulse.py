"""The snap as the sonar hears it at 1 m: through the anti-alias filter, and as paths change its shape."""

from __future__ import annotations

from functools import lru_cache
from math import inf

import numpy as np
from scipy.fft import ifft, irfft, rfft

from sonarsynth.acoustics import pulses, spectra
from sonarsynth.acoustics import snap as snaps
from sonarsynth.acoustics.pulses import Pulse
from sonarsynth.acoustics.snap import Bubble, ComplexArray
from sonarsynth.acoustics.spectra import Fir
from sonarsynth.acoustics.waveforms import logarithmic
from sonarsynth.conventions import Floats
from sonarsynth.sonar import Filter, LowPass, stop_frequency
from sonarsynth.synthesis.nodes import analysis, chebyshev, rounded_up
from sonarsynth.world.moment import Snap
from sonarsynth.world.sources import LogarithmicBubble

FEET = float(np.sqrt(-2.0 * np.log(spectra.SUPPORT_TOLERANCE)))
"""A Gaussian blur makes the support of a pulse longer at both ends by so many of its standard deviations."""


def bubble(model: LogarithmicBubble) -> Bubble:
    """The constants of a described snap, as the equations take them."""
    return Bubble(model.a, model.k, model.m, model.q, model.density)


def fir(chosen: Filter) -> Fir:
    """The numbers of a described filter, as the equations take them."""
    low = 0.0 if isinstance(chosen, LowPass) else chosen.low
    high = chosen.cutoff if isinstance(chosen, LowPass) else chosen.high
    return Fir(low, high, chosen.transition, chosen.attenuation)


def pulse_support(
    model: LogarithmicBubble,
    chosen: Filter,
    tolerance: float = spectra.SUPPORT_TOLERANCE,
    *,
    turned: bool = False,
) -> tuple[float, float]:
    """How long (s) before and after its collapse the filtered snap exceeds `tolerance` of its peak: for laying out
    windows.

    turned: at any constant phase. Such a pulse never ends: it falls as 1/t^3, because the snap has no net impulse, nor
    the impulse a net integral.
    """
    before, after = spectra.pulse_support(bubble(model), fir(chosen), tolerance)
    if not turned:
        return before, after
    early, late = _turned_support(model, chosen, tolerance)
    return max(before, early), max(after, late)


def _tapered(model: LogarithmicBubble, chosen: Filter, window: float) -> tuple[Floats, ComplexArray]:
    """Frequencies (bin,) from 0 to twice the stop edge in steps of 1/window, and the spectrum of the filtered snap,
    faded out from the stop edge on: cut there it would ring."""
    stop = stop_frequency(chosen)
    f = np.asarray(np.arange(2 * int(np.ceil(stop * window)) + 1) / window)
    fade = np.cos(0.5 * np.pi * np.clip(f / stop - 1.0, 0.0, 1.0)) ** 2
    return f, snaps.spectrum(f, bubble(model)) * spectra.response(f, fir(chosen)) * fade


@lru_cache(maxsize=64)
def _turned_support(model: LogarithmicBubble, chosen: Filter, tolerance: float) -> tuple[float, float]:
    """As `pulse_support`, of the envelope: the modulus of the pulse and i times its Hilbert transform."""
    window = 2.0 * sum(spectra.pulse_support(bubble(model), fir(chosen), tolerance))
    f, value = _tapered(model, chosen, window)
    samples = 2 * (f.size - 1)
    pulse = np.fft.fftshift(irfft(value, samples))
    for _ in range(7):
        padding, step = pulse.size // 2, window / samples
        pulse = np.pad(pulse, padding)  # a wider window, in which less of the tails is folded
        half = np.zeros(pulse.size, complex)
        half[: pulse.size // 2 + 1] = rfft(pulse)
        envelope = np.abs(ifft(half))
        loud = (np.flatnonzero(envelope > tolerance * envelope.max()) - pulse.size // 2) * step
        if max(-loud[0], loud[-1]) < 0.25 * pulse.size * step:
            break
    return max(float(step - loud[0]), 0.0), max(float(loud[-1] + step), 0.0)


@lru_cache(maxsize=64)
def silencing_blur(model: LogarithmicBubble, chosen: Filter, tolerance: float = spectra.SUPPORT_TOLERANCE) -> float:
    """The blur (s) that leaves no more than `tolerance` of the modulus of the filtered snap's spectrum."""
    window = 4.0 * sum(spectra.pulse_support(bubble(model), fir(chosen), tolerance))
    f, value = _tapered(model, chosen, window)
    mass = np.abs(value) / np.abs(value).sum()
    low, high = 0.0, 1e3 / f[1]
    while high > 1.01 * low and high > 1e-12:
        middle = np.sqrt(max(low, 1e-3 * high) * high)
        silent = mass @ np.exp(-0.5 * (2.0 * np.pi * middle * f) ** 2) <= tolerance
        low, high = (low, middle) if silent else (middle, high)
    return float(high)


@lru_cache(maxsize=64)
def _response(chosen: Filter, sampling_frequency: float, samples: int) -> Floats:
    value = spectra.response(_bins(sampling_frequency, samples), fir(chosen))
    value.setflags(write=False)
    return value


def _bins(sampling_frequency: float, samples: int) -> Floats:
    return np.asarray(np.arange(samples // 2 + 1) * (sampling_frequency / samples), float)


@lru_cache(maxsize=16)
def _pulse(model: LogarithmicBubble, highest: float) -> Pulse:
    return logarithmic(bubble(model), highest)


def _snap_spectrum(model: LogarithmicBubble, longer: float, frequency: Floats) -> ComplexArray:
    """Spectrum of the snap, unfiltered, at `longer` times evenly spaced frequencies (bin,)."""
    octave = rounded_up(1.2 * float(frequency[-1]), 2.0)  # few pulses serve all frequencies
    return pulses.spectrum(longer * frequency, _pulse(model, octave))


@lru_cache(maxsize=64)
def _spectrum(
    model: LogarithmicBubble, chosen: Filter, sampling_frequency: float, samples: int, doppler: float
) -> ComplexArray:
    f, longer = _bins(sampling_frequency, samples), 1.0 + doppler
    value = _snap_spectrum(model, longer, f) * _response(chosen, sampling_frequency, samples) * longer
    value[2 * f >= sampling_frequency] = 0.0
    value.setflags(write=False)
    return value


def pulse_spectrum(
    model: LogarithmicBubble, chosen: Filter, sampling_frequency: float, samples: int, doppler: float = 0.0
) -> tuple[Floats, ComplexArray]:
    """Frequencies (bin,) in Hz and spectrum (bin,) in Pa s of the filtered snap at 1 m, at the `rfft` bins of a sample
    grid.

    What the filter leaves at and above half the sampling frequency (under its attenuation) is left out, not folded.
    doppler stretches the snap, p(t/(1 + doppler)), before the filter, which is the receiver's and keeps its band.
    """
    value = _spectrum(model, chosen, sampling_frequency, samples, doppler)
    return _bins(sampling_frequency, samples), value


@lru_cache(maxsize=16)
def stretched_spectra(
    model: LogarithmicBubble, chosen: Filter, sampling_frequency: float, samples: int, widest: float, count: int
) -> ComplexArray:
    """Chebyshev coefficients (degree < count, bin) of `pulse_spectrum` in doppler/widest, from -1 to 1."""
    at = widest * chebyshev(count)
    value = analysis(count) @ [pulse_spectrum(model, chosen, sampling_frequency, samples, float(d))[1] for d in at]
    value.setflags(write=False)
    return np.asarray(value)


@lru_cache(maxsize=64)
def stretch_sizes(model: LogarithmicBubble, chosen: Filter, widest: float) -> tuple[float, ...]:
    """Mean moduli of the coefficients (degree < 16,) of `stretched_spectra` over frequency, over that of the first."""
    f = np.linspace(0.0, stop_frequency(chosen), 97)
    filtered = spectra.response(f, fir(chosen))
    at = 1.0 + widest * chebyshev(16)
    value = analysis(16) @ [_snap_spectrum(model, float(x), f) * x * filtered for x in at]
    sizes = np.abs(value).sum(axis=1)
    return tuple((sizes / sizes[0]).tolist()) if sizes[0] > 0.0 else (1.0, inf)


def snap_levels(heard: tuple[Snap, ...]) -> Floats:
    """(snap,) peak source level of each snap (dB re 1 uPa at 1 m)."""
    return np.array([snaps.source_level(bubble(s.model)) if s.source_level is None else s.source_level for s in heard])
