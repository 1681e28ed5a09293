"""The snap against published values, 40-digit arithmetic and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.sources.shrimp import LogarithmicBubble

MODEL = LogarithmicBubble()
BUBBLE = snap_pressure.Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)


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


def test_energy_in_bands_is_the_published() -> None:
    f = np.arange(50.0, 1.2e5, 100.0)
    S = np.abs(snap_pressure.spectrum(f, BUBBLE)) ** 2 * 2 * 100.0 / 249.63
    assert S[(f > 25e3) & (f < 85e3)].sum() == pytest.approx(0.234, abs=1e-3)
    assert 1 - S[f < 98e3].sum() == pytest.approx(0.030, abs=5e-4)
    assert 1 - S[f < 110e3].sum() == pytest.approx(0.023, abs=7e-4)
