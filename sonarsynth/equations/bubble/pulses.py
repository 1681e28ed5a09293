"""A pulse at 1 m as point strengths: what every model of a snap becomes, and all that is asked of it after that.

    p(t) ~ sum_k strength_k delta(t - time_k)

stands for the pulse in every integral with waves up to a frequency: the nodes are those of a quadrature, or the samples
of a recording. Its spectrum, and its waveform behind a filter, are sums over the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.fft import irfft, rfft

from sonarsynth.conventions import REFERENCE_PRESSURE, Complexes, Floats
from sonarsynth.equations.kernels.fourier_sums import fourier_sums, parts
from sonarsynth.equations.noise.filters import SUPPORT_TOLERANCE, Fir, duration, impulse_response

FINER = 512
"""Steps of a period of the highest wave that passes a filter, in which strengths are laid on a grid."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A pulse at 1 m; time 0 is the collapse of a bubble, or the middle of a test pulse."""

    time: Floats  # (node,) s, rising
    strength: Floats  # (node,) Pa s
    start: float  # s: it is nothing before
    end: float  # s: nor after
    peak: float  # Pa, what a source level is of: the largest pressure, before any filter or behind the model's own


class Levels(NamedTuple):
    """Source levels of a filtered pulse, dB re 1 uPa at 1 m."""

    peak: float
    peak_to_peak: float


def spectrum(frequency: npt.ArrayLike, pulse: Pulse) -> Complexes:
    """Spectrum (Pa s) of the pulse at 1 m, int p(t) exp(-i 2 pi f t) dt, at frequencies (Hz) up to the highest that it
    was made for; of any shape."""
    f = np.asarray(frequency, float)
    return np.asarray(fourier_sums(f.ravel(), pulse.time, pulse.strength).reshape(f.shape))


def stretched_spectra(frequency: Floats, pulse: Pulse, longer: Floats) -> Complexes:
    """Spectra (stretch, bin) of the pulse at `longer` (stretch,) times frequencies (bin,) in Hz."""
    return fourier_sums(frequency, pulse.time, pulse.strength, longer)


def filtered(time: npt.ArrayLike, pulse: Pulse, fir: Fir) -> Floats:
    """Pressure (Pa) of the filtered pulse at 1 m at times (s): sum_k strength_k h(t - time_k), to 2e-5 of its peak.

    The pulse must be made for waves up to `reach(fir)`. The error is that of the small steps at the ends of h (80 dB).
    """
    t = np.asarray(time, float)
    flat, out = t.ravel(), np.zeros(t.size)
    for block in parts(flat, pulse.time.size):
        now = flat[block]
        near = (pulse.time >= now.min() - 0.5 * duration(fir)) & (pulse.time <= now.max() + 0.5 * duration(fir))
        out[block] = impulse_response(now[:, None] - pulse.time[near], fir) @ pulse.strength[near]
    return out.reshape(t.shape)


def reach(fir: Fir) -> float:
    """Highest frequency (Hz) that a pulse must be made for to be heard through a filter: its stop band counts too."""
    return 2.0 * (fir.high + fir.transition)


def _waveform(pulse: Pulse, fir: Fir, steps: int) -> tuple[Floats, Floats]:
    """Times (s) and pressures (Pa) of all of the filtered pulse, in so many steps a period of the highest wave.

    Strengths are shared between the two nearest points of a grid of `FINER` steps a period: to 1e-5 of the peak.
    """
    half, step = 0.5 * duration(fir), 1.0 / (steps * (fir.high + 0.5 * fir.transition))
    time, finer = np.arange(pulse.start - half, pulse.end + half + step, step), FINER // steps
    fine, size = step / finer, time.size * finer
    h = impulse_response(np.arange(-half, half, fine), fir)
    first, rest = np.divmod(np.maximum(pulse.time - pulse.start, 0.0) / fine, 1.0)
    shares = (1.0 - rest) * pulse.strength, rest * pulse.strength
    strength = sum(np.bincount(first.astype(int) + n, share, size) for n, share in enumerate(shares))
    return time, irfft(rfft(strength) * rfft(h, size), size)[::finer]


def levels(pulse: Pulse, fir: Fir) -> Levels:
    """Source levels of the pulse behind a filter, to 0.001 dB. The pulse must be made for waves up to `reach(fir)`."""
    _, p = _waveform(pulse, fir, 16)
    high, low = _top(p), _top(-p)
    return Levels(*(float(20.0 * np.log10(x / REFERENCE_PRESSURE)) for x in (max(high, low), high + low)))


def _top(p: Floats) -> float:
    """The largest value between samples: of the parabola through three."""
    i = int(np.clip(np.argmax(p), 1, p.size - 2))
    a, b, c = p[i - 1 : i + 2]
    bend = 2.0 * b - a - c
    return float(b + (c - a) ** 2 / (8.0 * bend)) if bend > 0 else float(p.max())


def support(pulse: Pulse, fir: Fir, tolerance: float = SUPPORT_TOLERANCE) -> tuple[float, float]:
    """How long (s) before and after time 0 the filtered pulse exceeds `tolerance` of its peak; never negative."""
    time, p = _waveform(pulse, fir, 8)
    loud = np.flatnonzero(np.abs(p) > tolerance * np.abs(p).max())
    step = float(time[1] - time[0])
    return max(step - float(time[loud[0]]), 0.0), max(float(time[loud[-1]]) + step, 0.0)


def scaled(pulse: Pulse, gain: float, width: float) -> Pulse:
    """The pulse gain p(t/width): louder, and longer. It holds for waves up to the highest over the width."""
    return Pulse(
        width * pulse.time, gain * width * pulse.strength, width * pulse.start, width * pulse.end, gain * pulse.peak
    )


def gain_for_level(pulse: Pulse, level: float | None) -> float:
    """Factor that gives the peak a source level (dB re 1 uPa at 1 m); 1 for None.

    Raises ValueError where the peak is infinite.
    """
    if level is None:
        return 1.0
    if not np.isfinite(pulse.peak):
        raise ValueError("the peak of this snap is infinite: impose a level behind a filter instead")
    return float(REFERENCE_PRESSURE * 10.0 ** (level / 20.0) / pulse.peak)
