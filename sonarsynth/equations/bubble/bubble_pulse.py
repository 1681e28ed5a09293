"""What a collapsing bubble radiates: its largest pressure, its width, and its pulse as the nodes of a quadrature.

A collapse radiates for nanoseconds, between hundreds of microseconds of quiet: the nodes stand on the solver's own
steps, which follow it, in its stretched clock, where the pressure times dt/ds is smooth.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble.bubble_collapse import Collapse, Motion, moving, stretched
from sonarsynth.equations.bubble.pulses import Pulse, filtered, reach
from sonarsynth.equations.noise.filters import Fir

NODES, PERIODS = 12, 1.5
"""Gauss-Legendre nodes of a panel, and the most periods of the highest wave in one."""

LOW_PASS = Fir(0.0, 200e3, 40e3, 80.0)
"""Behind it the peak of a pulse is taken: what an instrument hears of a peak that lasts nanoseconds. From 1 to 3000 Pa
of gas at 5 m it moves by 3 dB, the unfiltered one by 32 dB."""


def _pressure(s: float, collapse: Collapse) -> float:
    return float(moving(s, collapse).pressure)


@lru_cache(maxsize=64)
def peak(collapse: Collapse) -> tuple[float, float]:
    """Time (s from the first collapse) and size (Pa) of the largest pressure at 1 m, before any filter."""
    from scipy.optimize import minimize_scalar

    s = np.unique(np.linspace(collapse.steps[:-1], collapse.steps[1:], 5))
    p = moving(s, collapse).pressure
    i = int(np.clip(np.argmax(p), 1, s.size - 2))
    best = minimize_scalar(
        lambda u: -_pressure(u, collapse), bounds=(s[i - 1], s[i + 1]), method="bounded", options={"xatol": 1e-12}
    )
    return float(moving(best.x, collapse).time), -float(best.fun)


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
    """The bubble's pulse at 1 m for waves up to `highest` (Hz); its peak is that behind `LOW_PASS`.

    The model begins at rest, with a step of pressure, and is cut at the top of its last rebound, with another: its flow
    is faded in over the part `fade` of the time to the collapse, and out over that part of the time from the last
    collapse; 0 keeps the steps. Spectra are good to 1e-8 of their peak at the default tolerance of the solver.
    """
    return Pulse(*_nodes(collapse, highest, fade), peak_below(collapse))


def _nodes(collapse: Collapse, highest: float, fade: float) -> tuple[Floats, Floats, float, float]:
    """Times (node,) in s, strengths (node,) in Pa s, start and end (s) of a pulse."""
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
    return moved.time, (half[:, None] * weight).ravel() * moved.rate * _gate(moved, begins, ends), start, end


@lru_cache(maxsize=64)
def peak_below(collapse: Collapse) -> float:
    """Largest pressure (Pa) at 1 m of the first collapse behind `LOW_PASS`; good to 1e-4."""
    emitted = Pulse(*_nodes(collapse, reach(LOW_PASS), 0.5), np.nan)

    def filtered_pressure(time: Floats) -> Floats:
        return filtered(time, emitted, LOW_PASS)

    period = 1.0 / LOW_PASS.high
    time, step = peak(collapse)[0] + np.linspace(-1.0, 1.0, 33) * period, period / 16.0
    around = time[np.argmax(filtered_pressure(time))] + np.linspace(-step, step, 33)
    return float(filtered_pressure(around).max())
