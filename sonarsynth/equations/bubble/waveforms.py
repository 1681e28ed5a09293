"""Waveforms whose pulse is known: the logarithmic bubble, a recording, sweeps, and test pulses with exact spectra."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.equations.bubble.snap_pressure import Bubble

MOST_SAMPLES = 1 << 24
"""Samples of a recording that is made denser."""

SPREAD = 6.5
"""Standard deviations (times sqrt 2) of a Gaussian that is down to 5e-19."""

OVERSAMPLED = 2.0
"""Rate of the samples of a sweep, over what its middle would need: its ends have waves beyond its band."""
ENDS, MOST_ENDS = 200.0, 2e4
"""Samples of a sweep at least, where each of its ends is a twentieth of it: what aliases is 8e-6 of it then; more where
they are shorter, up to so many."""


def logarithmic(bubble: Bubble, highest: float) -> Pulse:
    """The logarithmic bubble's pulse for waves up to `highest` (Hz)."""
    x, w = snap_pressure.quadrature(bubble, highest)
    return Pulse(
        -x[::-1],
        (w * snap_pressure.pressure(-x, bubble))[::-1],
        snap_pressure.onset(bubble),
        0.0,
        snap_pressure.peak(bubble)[1],
    )


def recorded(pressure: npt.ArrayLike, sampling_frequency: float, zero: float, highest: float) -> Pulse:
    """The pulse of samples (sample,) in Pa at 1 m; `zero` is the sample (a fraction, too) at time 0.

    What is between the samples is the band-limited signal through them: nothing at and above half the sampling
    frequency. For waves higher than that the samples are made denser; raises ValueError where that takes over 16
    million of them. The recording must be quiet at its ends.
    """
    p = np.asarray(pressure, float)
    finer = max(int(np.ceil(2.0 * highest / sampling_frequency)), 1)
    if finer > 1 and 2 * finer * p.size > MOST_SAMPLES:
        raise ValueError(
            f"{p.size} samples at {sampling_frequency:.6g} Hz are too coarse for waves of {highest:.6g} Hz"
        )
    dense, before = _denser(p, finer)
    step = 1.0 / (finer * sampling_frequency)
    time = np.asarray((np.arange(dense.size) - before - finer * zero) * step, float)
    return Pulse(time, dense * step, float(time[0]), float(time[-1]), float(np.abs(p).max()))


def _denser(p: Floats, finer: int) -> tuple[Floats, int]:
    """Samples between samples (Fourier), with silence of their own length around; how many come before the first."""
    if finer == 1:
        return p, 0
    silent = np.zeros(p.size // 2 + 1)
    padded = np.concatenate([silent, p, silent])
    spectrum = np.fft.rfft(padded)
    if padded.size % 2 == 0:
        spectrum[-1] = 0.0  # half the sampling frequency: it has no phase
    return np.asarray(finer * np.fft.irfft(spectrum, finer * padded.size), float), finer * silent.size


def ricker(frequency: float, peak: float, highest: float) -> Pulse:
    """A Ricker wavelet, peak (1 - 2 u^2) exp(-u^2) with u = pi frequency t, whose spectrum is largest at `frequency`.

    Source: Ricker (1953), Geophysics 18, 10.
    """
    time, step = _grid(SPREAD / (np.pi * frequency), highest + SPREAD * frequency)
    u2 = (np.pi * frequency * time) ** 2
    return Pulse(time, peak * (1.0 - 2.0 * u2) * np.exp(-u2) * step, float(time[0]), float(time[-1]), abs(peak))


def gabor(frequency: float, cycles: float, peak: float, highest: float) -> Pulse:
    """A tone in a Gaussian, peak cos(2 pi frequency t) exp(-t^2/(2 s^2)), with so many cycles in its width at half its
    height. Source: Gabor (1946), J. IEE 93, 429."""
    s = _deviation(frequency, cycles)
    time, step = _grid(SPREAD * np.sqrt(2.0) * s, highest + frequency + SPREAD / (np.sqrt(2.0) * np.pi * s))
    p = peak * np.cos(2.0 * np.pi * frequency * time) * np.exp(-0.5 * (time / s) ** 2)
    return Pulse(time, p * step, float(time[0]), float(time[-1]), abs(peak))


def sweep(start: float, stop: float, duration: float, taper: float, hyperbolic: bool, highest: float) -> Pulse:
    """A sweep of 1 Pa from a frequency f1 to f2 (start, stop, Hz) in a duration T (s), whose ends are raised cosines:
    both together a share `taper` of it.

    Its phase, t (s) from its beginning, is 2 pi (f1 t + (f2 - f1) t^2/(2 T)) if linear. Hyperbolic, the period changes
    evenly: 2 pi ln(1 + f1 k t)/k, k = (1/f2 - 1/f1)/T. Source: Altes & Titlebaum (1970), J. Acoust. Soc. Am. 48, 1014.
    """
    least = min(ENDS * max(0.1 / taper, 1.0) ** (2.0 / 3.0), MOST_ENDS)  # corners of the ends: waves fall by 1/f^3
    time, step = _grid(0.5 * duration, max(OVERSAMPLED * (highest + max(start, stop)), least / duration))
    since = time + 0.5 * duration
    if hyperbolic and start != stop:
        rate = (1.0 / stop - 1.0 / start) / duration
        cycles = np.log1p(start * rate * since) / rate
    else:
        cycles = start * since + 0.5 * (stop - start) / duration * since**2
    edge = np.clip(np.minimum(since, duration - since) / (0.5 * taper * duration), 0.0, 1.0)
    p = np.sin(2.0 * np.pi * cycles) * np.sin(0.5 * np.pi * edge) ** 2
    return Pulse(time, p * step, float(time[0]), float(time[-1]), 1.0)


def _deviation(frequency: float, cycles: float) -> float:
    return float(cycles / frequency / np.sqrt(8.0 * np.log(2.0)))


def _grid(half: float, rate: float) -> tuple[Floats, float]:
    """Even times (s) within +-half, and their step: a sum over them is the integral, to rounding, where the highest
    wave and the pulse's own band together are under the rate (Hz)."""
    count = int(np.ceil(half * rate)) + 1
    return np.asarray(np.arange(-count, count + 1) * (half / count), float), half / count
