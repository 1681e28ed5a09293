"""Filters and interpolation kernels.

The filters are the Kaiser-window FIR filters of `scipy.signal.firwin` and `kaiserord` in the limit of a high design
rate: their impulse response is a function of time, symmetric and of finite length, so that a filtered snap is finite
too, and it is the same on every sample grid.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import i0, i0e

from sonarsynth.conventions import Floats
from sonarsynth.equations.kernels.fourier_sums import fourier_sums

SUPPORT_TOLERANCE = 1e-7
"""What a filtered snap may be, relative to its peak, outside of its support."""


TAPS = 64
"""Samples that `windowed_sinc` weighs."""


class Fir(NamedTuple):
    """A zero-phase FIR filter: pass band low to high (Hz, at -6 dB; low = 0 is a low pass)."""

    low: float
    high: float
    transition: float  # Hz, full width of each transition
    attenuation: float  # dB


def kaiser_beta(attenuation: float) -> float:
    """Shape of the Kaiser window for a stop-band attenuation (dB). Source: Kaiser (1974); Oppenheim and Schafer, eq.
    7.75."""
    if attenuation > 50.0:
        return 0.1102 * (attenuation - 8.7)
    return float(0.5842 * max(attenuation - 21.0, 0.0) ** 0.4 + 0.07886 * max(attenuation - 21.0, 0.0))


def duration(fir: Fir) -> float:
    """Length (s) of the impulse response, half of it either side of 0. Source: Kaiser (1974), as
    `scipy.signal.kaiserord`."""
    return (fir.attenuation - 7.95) / (2.285 * 2.0 * np.pi * fir.transition)


def impulse_response(time: npt.ArrayLike, fir: Fir) -> Floats:
    """Impulse response (1/s): ideal band times Kaiser window, scaled to pass the middle of the band (0 of a low pass)
    unchanged."""
    return _unscaled(np.asarray(time, float), fir) / _scale(fir)


def _unscaled(t: Floats, fir: Fir) -> Floats:
    beta, half = kaiser_beta(fir.attenuation), 0.5 * duration(fir)
    inside = np.sqrt(np.maximum(1.0 - (t / half) ** 2, 0.0))
    window = np.where(np.abs(t) <= half, i0(beta * inside) / i0(beta), 0.0)
    ideal = 2.0 * fir.high * np.sinc(2.0 * fir.high * t) - 2.0 * fir.low * np.sinc(2.0 * fir.low * t)
    return np.asarray(ideal * window)


@lru_cache(maxsize=64)
def _scale(fir: Fir) -> float:
    middle = 0.0 if fir.low == 0.0 else 0.5 * (fir.low + fir.high)
    return float(_transform(np.array([middle]), fir)[0])


def _transform(f: Floats, fir: Fir) -> Floats:
    half = 0.5 * duration(fir)
    cycles = half * (fir.high + float(np.abs(f).max(initial=0.0)))
    panels = int(np.ceil(cycles / 4.0)) + 2
    node, weight = np.polynomial.legendre.leggauss(24)
    t = ((np.arange(panels)[:, None] + 0.5 + 0.5 * node) * (half / panels)).ravel()
    h = _unscaled(t, fir) * np.tile(weight * half / panels, panels)
    return np.asarray(fourier_sums(f, t, h)[0].real)


def response(frequency: npt.ArrayLike, fir: Fir) -> Floats:
    """Frequency response (real: zero phase) at frequencies (Hz), to 1e-13."""
    f = np.asarray(frequency, float)
    return (_transform(f.ravel(), fir) / _scale(fir)).reshape(f.shape)


def kaiser_bessel(x: npt.ArrayLike, width: float, beta: float) -> Floats:
    """Kaiser-Bessel kernel at distances x (samples), |x| <= width/2; 1 at 0. Source: Jackson et al. (1991), IEEE TMI
    10, 473."""
    inside = 1.0 - (2.0 * np.asarray(x, float) / width) ** 2
    root = beta * np.sqrt(np.maximum(inside, 0.0))
    return np.where(inside >= 0.0, i0e(root) * np.exp(root - beta) / i0e(beta), 0.0)


def windowed_sinc(x: Floats) -> Floats:
    """Weights of samples at distances x (samples) from a time, of the `TAPS` round it, that interpolate there."""
    return np.asarray(np.sinc(x) * kaiser_bessel(x, TAPS, 10.0))


def kaiser_bessel_transform(cycles: npt.ArrayLike, width: float, beta: float) -> Floats:
    """Fourier transform of `kaiser_bessel` at frequencies in cycles per sample."""
    square = beta**2 - (np.pi * width * np.asarray(cycles, float)) ** 2
    root = np.sqrt(np.abs(square))
    scaled = np.exp(-beta) / i0e(beta)
    with np.errstate(over="ignore"):
        inner = np.where(square > 0, np.sinh(np.where(square > 0, root, 0.0)), np.sin(root))
    return np.asarray(width * scaled * np.where(root > 1e-6, inner / np.maximum(root, 1e-6), 1.0))


def kaiser_bessel_beta(width: float, oversampling: float) -> float:
    """Shape of the kernel for a grid oversampled so many times. Source: Beatty et al. (2005), IEEE TMI 24, 799, eq.
    5."""
    s = width / oversampling
    return float(np.pi * np.sqrt(max((s * (oversampling - 0.5)) ** 2 - 0.8, 0.25)))
