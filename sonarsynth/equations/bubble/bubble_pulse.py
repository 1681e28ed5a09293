"""What a collapsing bubble radiates: its largest pressure, its width, and its pulse as the nodes of a quadrature.

A collapse radiates for nanoseconds, between hundreds of microseconds of quiet: the nodes stand on the solver's own
steps, which follow it, in its stretched clock, where the pressure times dt/ds is smooth.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble.bubble_collapse import SETTLED, SINGULAR, Collapse, Motion, moving, stretched
from sonarsynth.equations.bubble.pulses import Pulse, filtered, reach
from sonarsynth.equations.noise.filters import Fir

NODES, PERIODS = 12, 1.5
"""Gauss-Legendre nodes of a panel, and the most periods of the highest wave in one."""

TRANSITION, ATTENUATION = 0.2, 80.0
"""Of the low pass of `peak_below`: width over its corner frequency, and dB."""


def _pressure(s: float, collapse: Collapse) -> float:
    return float(moving(s, collapse).pressure)


@lru_cache(maxsize=64)
def _peak(collapse: Collapse) -> tuple[float, float]:
    """Place (of the stretched clock) and size (Pa) of the largest pressure at 1 m of the first collapse."""
    from scipy.optimize import minimize_scalar

    s = np.unique(np.linspace(collapse.steps[:-1], collapse.steps[1:], 5))
    p = moving(s, collapse).pressure
    i = int(np.clip(np.argmax(p), 1, s.size - 2))
    best = minimize_scalar(
        lambda u: -_pressure(u, collapse), bounds=(s[i - 1], s[i + 1]), method="bounded", options={"xatol": 1e-12}
    )
    return float(best.x), -float(best.fun)


def peak(collapse: Collapse) -> tuple[float, float]:
    """Time (s from the collapse) and size (Pa) of the largest pressure at 1 m: infinite for a bubble that becomes a
    point, NaN for one that settles."""
    if collapse.flag in {SINGULAR, SETTLED}:
        return (0.0, np.inf) if collapse.flag == SINGULAR else (np.nan, np.nan)
    s, size = _peak(collapse)
    return float(moving(s, collapse).time), size


def source_level(collapse: Collapse) -> float:
    """Peak source level (dB re 1 uPa at 1 m) before any filter."""
    return float(20.0 * np.log10(peak(collapse)[1] / REFERENCE_PRESSURE))


def _gate(moved: Motion, begins: tuple[float, float], ends: tuple[float, float]) -> Floats:
    """Pressure (Pa) of a flow that is faded in and out between times (s): d(g J)/dt = g p + g' J keeps the net impulse
    at zero, where a faded pressure would not."""
    g, slope = np.ones_like(moved.time), np.zeros_like(moved.time)
    for first, last in (begins, ends[::-1]):
        if first != last:
            u = np.clip((moved.time - first) / (last - first), 0.0, 1.0)
            rise = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
            g, slope = g * rise, slope * rise + g * 30.0 * (u * (1.0 - u)) ** 2 / (last - first)
    return np.asarray(g * moved.pressure + slope * moved.impulse)


@lru_cache(maxsize=64)
def pulse(collapse: Collapse, highest: float, fade: float = 0.5) -> Pulse:
    """The bubble's pulse at 1 m for waves up to `highest` (Hz).

    The model begins at rest, with a step of pressure, and is cut at the top of its last rebound, with another: its flow
    is faded in over the part `fade` of the time to the collapse, and out over that part of the time from the last
    collapse; 0 keeps the steps. Spectra are good to 1e-8 of their peak at the default tolerance of the solver. Raises
    ValueError for a bubble that settles without a collapse.
    """
    if collapse.flag == SETTLED:
        raise ValueError(f"the bubble has no pulse: {collapse.reason}")
    if not 0.0 <= fade <= 1.0:
        raise ValueError(f"the part of a pulse that is faded must be between 0 and 1, not {fade}")
    start, end = float(collapse.clock[0]), float(collapse.clock[-1])
    begins = (start, start + fade * collapse.collapse_time)
    ends = (end - fade * (end - collapse.smallest[-1].time), end)
    corners = stretched(np.array([begins[1], ends[0]]), collapse)
    edges = np.unique(np.concatenate([collapse.steps, corners]))
    lasts = np.diff(moving(edges, collapse).time)
    count = np.maximum(np.ceil(lasts * highest / PERIODS), 1).astype(np.int64)
    half = np.repeat(0.5 * np.diff(edges) / count, count)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    middle = np.repeat(edges[:-1], count) + half * (2 * within + 1)
    node, weight = np.polynomial.legendre.leggauss(NODES)
    moved = moving((middle[:, None] + half[:, None] * node).ravel(), collapse)
    strength = (half[:, None] * weight).ravel() * moved.rate * _gate(moved, begins, ends)
    return Pulse(moved.time, strength, start, end, peak(collapse)[1])


@lru_cache(maxsize=256)
def peak_below(collapse: Collapse, frequency: float, fade: float = 0.5) -> float:
    """Largest pressure (Pa) at 1 m of the first collapse below a frequency (Hz): after a low-pass filter whose
    gain is a half there; good to 1e-4.

    This is what an instrument hears of a peak that lasts nanoseconds. It hardly depends on the gas, and is finite for
    a bubble that becomes a point. Raises ValueError for a bubble that settles.
    """
    low_pass = Fir(0.0, frequency, TRANSITION * frequency, ATTENUATION)
    emitted = pulse(collapse, reach(low_pass), fade)

    def filtered_pressure(time: Floats) -> Floats:
        return filtered(time, emitted, low_pass)

    time, step = peak(collapse)[0] + np.linspace(-1.0, 1.0, 33) / frequency, 1.0 / (16.0 * frequency)
    around = time[np.argmax(filtered_pressure(time))] + np.linspace(-step, step, 33)
    return float(filtered_pressure(around).max())
