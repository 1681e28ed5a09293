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

TABLE = """
-1e-3          3.52237389815e-4   2.45465275512    12757.8888076   5.82757238674
-6.172539e-4   2.15816862664e-3   5.75148805193    -5826.65160123  115.644026228
-5e-4          2.76465467209e-3   4.37185412275    -17079.3116843  -24.86027771
-3e-4          3.22159373731e-3   -0.0726494674525 -25652.3809623  -266.203492664
-1e-4          2.56902250565e-3   -8.10965448584   -89814.9063812  -254.856085993
-3e-5          1.59819751731e-3   -25.3905600289   -706006.202619  257.347704633
-1e-5          8.60483598328e-4   -56.3076805892   -3391937.59041  2944.92175469
-3.1e-6        3.58614020993e-4   -96.1760084114   -9845072.00622  5368.1177839
-1e-6          1.31231474904e-4   -122.490681213   -15949602.2535  3663.30616824
-1e-7          1.39779179399e-5   -138.746338251   -20453915.5656  534.168784329
0              0                  -140.822279346   -21069470.5597  0
"""
ROWS = [tuple(map(float, line.split())) for line in TABLE.strip().splitlines()]


@pytest.mark.parametrize("row", ROWS)
def test_radius_derivatives_and_pressure_are_the_tabulated(row: tuple[float, ...]) -> None:
    t, *expected = row
    got = [*(float(v) for v in snap_pressure.wall(t, BUBBLE)), float(snap_pressure.pressure(t, BUBBLE))]
    assert got == pytest.approx(expected, rel=3e-11, abs=1e-30)


def test_derivatives_agree_with_forty_digits() -> None:
    mp.mp.dps = 40
    a, k, m, q = (mp.mpf(v) for v in BUBBLE[:4])

    def radius(t: mp.mpf) -> mp.mpf:
        return a * (1 + mp.erf(k * (t - m) / mp.sqrt(2))) * mp.log(1 + q * t)

    for t in (-2e-3, -1.2e-3, -3e-4, -4.7e-5, -1e-6, -1e-9):
        got = snap_pressure.wall(t, BUBBLE)
        for order in range(3):
            exact = float(mp.diff(radius, mp.mpf(t), order))
            assert float(got[order]) == pytest.approx(exact, rel=2e-14)


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
    assert snap_pressure.source_level(BUBBLE) == pytest.approx(194.60, abs=0.005)
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


def test_near_collapse_it_is_the_frozen_growth_form() -> None:
    """R = A ln(1 + x/tau): p = rho A^3 L (2 - L)/(tau + x)^2, largest at L = (3 - sqrt 5)/2."""
    slow = BUBBLE._replace(k=1e-3, m=-1e6)  # erf = 1, frozen
    A = slow.a * 2.0
    x = TAU * np.array([0.01, 0.46517, 1.0, 6.389, 20.0])
    L = np.log1p(x / TAU)
    np.testing.assert_allclose(
        snap_pressure.pressure(-x, slow), slow.density * A**3 * L * (2 - L) / (TAU + x) ** 2, rtol=1e-9, atol=1e-6
    )
    best = (3 - np.sqrt(5)) / 2
    found = minimize_scalar(
        lambda y: -float(snap_pressure.pressure(-y, slow)),
        bounds=(0, 3 * TAU),
        method="bounded",
        options={"xatol": 1e-12},
    )
    assert found.x / TAU == pytest.approx(0.46517, abs=2e-5)
    assert -found.fun == pytest.approx(best * (2 - best) * np.exp(-2 * best) * slow.density * A**3 / TAU**2, rel=1e-9)


def test_impulse_is_the_integral_of_pressure_and_ends_at_zero() -> None:
    for t in (-5e-4, -1e-5, -1e-7):
        edges = [snap_pressure.onset(BUBBLE), -1e-3, -6e-4, -3e-4, -1e-4, -3e-5, -1e-5, -3e-6, -1e-6]
        edges = [e for e in edges if e < t] + [t]
        total = sum(
            quad(lambda s: float(snap_pressure.pressure(s, BUBBLE)), u, v)[0] for u, v in itertools.pairwise(edges)
        )
        assert float(snap_pressure.impulse(t, BUBBLE)) == pytest.approx(total, abs=1e-10)
    assert float(snap_pressure.impulse(0.0, BUBBLE)) == 0.0


def test_energy_and_loudness() -> None:
    x, w = snap_pressure.quadrature(BUBBLE, 2e5)
    p = snap_pressure.pressure(-x, BUBBLE)
    assert w @ p**2 == pytest.approx(249.63, abs=0.005)
    assert 10 * np.log10(w @ p**2 / 1e-12) == pytest.approx(143.97, abs=0.005)
    t = np.linspace(snap_pressure.onset(BUBBLE), 0.0, 2_000_001)
    assert np.trapezoid(np.abs(snap_pressure.pressure(t, BUBBLE)), t) == pytest.approx(0.1989, abs=5e-5)


def test_spectrum_is_the_integral() -> None:
    edges = np.append(-np.geomspace(3e-7, -snap_pressure.onset(BUBBLE), 30)[::-1], 0.0)
    for f in (0.0, 1311.0, 2e3, 5e4, 1.1e5):
        parts = [
            sum(
                quad(
                    lambda t, f=f, g=g: float(snap_pressure.pressure(t, BUBBLE)) * g(2 * np.pi * f * t), u, v, limit=200
                )[0]
                for u, v in itertools.pairwise(edges)
            )
            for g in (np.cos, np.sin)
        ]
        assert complex(snap_pressure.spectrum(f, BUBBLE)) == pytest.approx(parts[0] - 1j * parts[1], abs=1e-9 * 0.127)


def test_spectrum_levels_are_the_published() -> None:
    f = np.linspace(0.5e3, 3e3, 2501)
    S = np.abs(snap_pressure.spectrum(f, BUBBLE))
    assert S.max() == pytest.approx(0.12743, abs=5e-6)
    assert f[S.argmax()] == pytest.approx(1.311e3, abs=5.0)
    assert 10 * np.log10(2 * S.max() ** 2 / 1e-12) == pytest.approx(105.1, abs=0.05)
    published = {5: -5.00, 10: -6.36, 20: -9.16, 25: -10.43, 50: -15.71, 85: -21.22, 100: -23.15, 150: -28.50}
    published |= {200: -32.67, 300: -38.96}
    for kilohertz, level in published.items():
        got = 20 * np.log10(abs(complex(snap_pressure.spectrum(1e3 * kilohertz, BUBBLE))) / S.max())
        assert got == pytest.approx(level, abs=0.02)


def test_energy_in_bands_is_the_published() -> None:
    f = np.arange(50.0, 1.2e5, 100.0)
    S = np.abs(snap_pressure.spectrum(f, BUBBLE)) ** 2 * 2 * 100.0 / 249.63
    assert S[(f > 25e3) & (f < 85e3)].sum() == pytest.approx(0.234, abs=1e-3)
    assert 1 - S[f < 98e3].sum() == pytest.approx(0.030, abs=5e-4)
    assert 1 - S[f < 110e3].sum() == pytest.approx(0.023, abs=7e-4)


def test_spectrum_falls_as_the_square_of_frequency() -> None:
    S = np.abs(snap_pressure.spectrum(np.array([2e6, 4e6]), BUBBLE))
    assert S[0] / S[1] == pytest.approx(4.0, rel=5e-3)


def test_a_source_level_scales_the_peak() -> None:
    gain = snap_pressure.gain_for_level(BUBBLE, 187.0)
    assert 20 * np.log10(gain * snap_pressure.peak(BUBBLE)[1] / 1e-6) == pytest.approx(187.0, abs=1e-9)
    assert snap_pressure.gain_for_level(BUBBLE, None) == 1.0
