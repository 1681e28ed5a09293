"""A pulse at 1 m as point strengths: what every model of a snap becomes, and all that is asked of it after that.

    p(t) ~ sum_k strength_k delta(t - time_k)

stands for the pulse in every integral with waves up to a frequency: the nodes are those of a quadrature, or the samples
of a recording. Its spectrum, and its waveform behind a filter, are sums over the nodes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble.snap_pressure import ComplexArray
from sonarsynth.equations.noise.filters import SUPPORT_TOLERANCE, Fir, duration, impulse_response

MOST = 1 << 21
"""Products of times and nodes that are held at once: bounds the memory."""


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


def spectrum(frequency: npt.ArrayLike, pulse: Pulse) -> ComplexArray:
    """Spectrum (Pa s) of the pulse at 1 m, int p(t) exp(-i 2 pi f t) dt, at frequencies (Hz) up to the highest that it
    was made for.

    Equal steps of frequency cost the exponentials of their square root only: exp(-i 2 pi (a + b) t) is a product.
    """
    f = np.asarray(frequency, float)
    flat = f.ravel()
    step = (flat[-1] - flat[0]) / (flat.size - 1) if flat.size > 1 else 0.0
    off = np.abs(flat - (flat[:1] + step * np.arange(flat.size)))
    even = bool((off <= 1e-13 * np.abs(flat).max(initial=0.0)).all())
    columns = int(np.ceil(np.sqrt(flat.size))) if even and flat.size else 1
    coarse, fine = flat[::columns], step * np.arange(columns)
    out = np.zeros((coarse.size, columns), complex)
    for near in _parts(pulse.time, coarse.size + columns):
        wave = np.exp(-2j * np.pi * np.outer(coarse, pulse.time[near])) * pulse.strength[near]
        out += wave @ np.exp(-2j * np.pi * np.outer(pulse.time[near], fine))
    return np.asarray(out.ravel()[: flat.size].reshape(f.shape))


def stretched_spectra(frequency: Floats, pulse: Pulse, longer: Floats) -> ComplexArray:
    """Spectra (stretch, bin) of the pulse at `longer` (stretch,) times frequencies (bin,) from 0 Hz in equal steps.

    As `spectrum` to rounding, by powers of one exponential a node: for many stretches, a quarter of the time.
    """
    columns = int(np.ceil(np.sqrt(frequency.size)))
    step = float(frequency[-1]) / max(frequency.size - 1, 1)
    out = np.zeros((longer.size, columns, columns), complex)
    for near in _parts(pulse.time, 2 * columns * longer.size):
        once = np.exp(-2j * np.pi * step * np.multiply.outer(longer, pulse.time[near]))
        fine = _powers(once, columns)  # (power, stretch, node)
        coarse = _powers(fine[-1] * once, columns) * pulse.strength[near]
        out += np.moveaxis(coarse, 0, 1) @ np.moveaxis(fine, 0, 2)
    return out.reshape(longer.size, -1)[:, : frequency.size]


def _powers(values: ComplexArray, count: int) -> ComplexArray:
    """Powers (power < count, ...) of values."""
    out = np.ones((count, *values.shape), complex)
    for before, power in pairwise(out):
        np.multiply(before, values, out=power)
    return out


def _parts(values: Floats, columns: int) -> Iterator[slice]:
    length = max(MOST // max(columns, 1), 16)
    return (slice(i, i + length) for i in range(0, values.size, length))


def filtered(time: npt.ArrayLike, pulse: Pulse, fir: Fir) -> Floats:
    """Pressure (Pa) of the filtered pulse at 1 m at times (s): sum_k strength_k h(t - time_k), to 2e-5 of its peak.

    The pulse must be made for waves up to `reach(fir)`. The error is that of the small steps at the ends of h (80 dB).
    """
    t = np.asarray(time, float)
    flat, out = t.ravel(), np.zeros(t.size)
    for block in _parts(flat, pulse.time.size):
        now = flat[block]
        near = (pulse.time >= now.min() - 0.5 * duration(fir)) & (pulse.time <= now.max() + 0.5 * duration(fir))
        out[block] = impulse_response(now[:, None] - pulse.time[near], fir) @ pulse.strength[near]
    return out.reshape(t.shape)


def reach(fir: Fir) -> float:
    """Highest frequency (Hz) that a pulse must be made for to be heard through a filter: its stop band counts too."""
    return 2.0 * (fir.high + fir.transition)


def _waveform(pulse: Pulse, fir: Fir, steps: int) -> tuple[Floats, Floats]:
    """Times (s) and pressures (Pa) of all of the filtered pulse, in so many steps a period of the highest wave."""
    half, step = 0.5 * duration(fir), 1.0 / (steps * (fir.high + 0.5 * fir.transition))
    time = np.arange(pulse.start - half, pulse.end + half + step, step)
    lag = np.linspace(-half, half, int(np.ceil(2.0 * half / step)) * 512 // steps + 1)  # a table of h, linear: 2e-5
    h = impulse_response(lag, fir)
    p = np.zeros(time.size)
    for block in _parts(time, pulse.time.size):
        near = slice(*np.searchsorted(pulse.time, [time[block][0] - half, time[block][-1] + half]))
        p[block] = np.interp(time[block, None] - pulse.time[near], lag, h, left=0.0, right=0.0) @ pulse.strength[near]
    return time, p


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
