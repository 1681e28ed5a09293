"""The snap against published values, 40-digit arithmetic and closed forms."""

from __future__ import annotations

import itertools

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, minimize_scalar

from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.sources.shrimp import LogarithmicBubble

MODEL = LogarithmicBubble()
BUBBLE = snap_pressure.Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)
TAU = 1.0 / abs(BUBBLE.q)


def test_nothing_is_heard_after_the_collapse_and_no_delta_at_it() -> None:
    t = np.array([-1e-12, 0.0, 1e-12, 3e-6, TAU, 1.0])
    p = snap_pressure.pressure(t, BUBBLE)
    assert np.all(p[1:] == 0.0)
    A = BUBBLE.a * 2.0 * 0.5 * (1.0 + float(mp.erf(-BUBBLE.k * BUBBLE.m / mp.sqrt(2))))
    assert p[0] == pytest.approx(BUBBLE.density * 2.0 * A**3 / TAU**3 * 1e-12, rel=1e-6)  # the corner


def test_level_peak_and_widths() -> None:
    time, size = snap_pressure.peak(BUBBLE)
    assert size == pytest.approx(5368.12, abs=0.005)
    assert time == pytest.approx(-3.1007e-6, abs=5e-11)
    assert 20 * np.log10(size / 1e-6) == pytest.approx(194.60, abs=0.005)
    trough = minimize_scalar(
        lambda t: float(snap_pressure.pressure(t, BUBBLE)),
        bounds=(-4e-4, -1e-4),
        method="bounded",
        options={"xatol": 1e-12},
    )
    assert trough.fun == pytest.approx(-271.82, abs=0.005)
    assert trough.x == pytest.approx(-260.40e-6, abs=1e-7)
    assert 20 * np.log10((size - trough.fun) / 1e-6) == pytest.approx(195.03, abs=0.005)
    growth = minimize_scalar(
        lambda t: -float(snap_pressure.pressure(t, BUBBLE)),
        bounds=(-9e-4, -5e-4),
        method="bounded",
        options={"xatol": 1e-12},
    )
    assert (growth.x, -growth.fun) == pytest.approx((-665.8e-6, 128.75), rel=1e-4)
    assert brentq(lambda t: snap_pressure.pressure(t, BUBBLE), -1e-4, -1e-5) == pytest.approx(-38.87346e-6, abs=5e-12)
    for part, width in ((0.5, 10.20e-6), (1 / 3, 14.05e-6)):
        left, right = (
            brentq(lambda t, part=part: float(snap_pressure.pressure(t, BUBBLE)) - part * size, low, high, xtol=1e-12)
            for low, high in ((-3e-5, time), (time, 0.0))
        )
        assert right - left == pytest.approx(width, abs=5e-9)


def test_bubble_is_largest_where_published() -> None:
    found = minimize_scalar(
        lambda t: -float(snap_pressure.wall(t, BUBBLE).radius),
        bounds=(-5e-4, -1e-4),
        method="bounded",
        options={"xatol": 1e-12},
    )
    assert -found.fun == pytest.approx(3.2217e-3, abs=5e-8)
    assert found.x == pytest.approx(-302.84e-6, abs=1e-7)


def test_impulse_is_the_integral_of_pressure_and_ends_at_zero() -> None:
    for t in (-5e-4, -1e-5, -1e-7):
        edges = [snap_pressure.onset(BUBBLE), -1e-3, -6e-4, -3e-4, -1e-4, -3e-5, -1e-5, -3e-6, -1e-6]
        edges = [e for e in edges if e < t] + [t]
        total = sum(
            quad(lambda s: float(snap_pressure.pressure(s, BUBBLE)), u, v)[0] for u, v in itertools.pairwise(edges)
        )
        assert float(snap_pressure.impulse(t, BUBBLE)) == pytest.approx(total, abs=1e-10)
    assert float(snap_pressure.impulse(0.0, BUBBLE)) == 0.0


def test_energy_in_bands_is_the_published() -> None:
    f = np.arange(50.0, 1.2e5, 100.0)
    S = np.abs(snap_pressure.spectrum(f, BUBBLE)) ** 2 * 2 * 100.0 / 249.63
    assert S[(f > 25e3) & (f < 85e3)].sum() == pytest.approx(0.234, abs=1e-3)
    assert 1 - S[f < 98e3].sum() == pytest.approx(0.030, abs=5e-4)
    assert 1 - S[f < 110e3].sum() == pytest.approx(0.023, abs=7e-4)


def test_spectrum_falls_as_the_square_of_frequency() -> None:
    S = np.abs(snap_pressure.spectrum(np.array([2e6, 4e6]), BUBBLE))
    assert S[0] / S[1] == pytest.approx(4.0, rel=5e-3)
