"""Echoes of pulses from facets: the frequency domain, exact arithmetic, and what mirrors, edges and corners return."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import snap_pressure
from sonarsynth.equations.scattering.kirchhoff_integral import facet_amplitude
from sonarsynth.equations.scattering.kirchhoff_pulse import (
    Waveform,
    divided_impulse,
    facet_echo,
    sampled_waveform,
    snap_waveform,
)
from sonarsynth.geometry import unit
from sonarsynth.sources.shrimp import LogarithmicBubble

WIDTH, OMEGA = 6e-6, 2 * np.pi * 60e3
_b = LogarithmicBubble()
SNAP = snap_pressure.Bubble(_b.a, _b.k, _b.m, _b.q, _b.density)


def _impulse(t: Floats) -> Floats:
    return np.exp(-0.5 * (t / WIDTH) ** 2) * np.cos(OMEGA * t)


def _pressure(t: Floats) -> Floats:
    u = -t / WIDTH**2
    return np.exp(-0.5 * (t / WIDTH) ** 2) * (u * np.cos(OMEGA * t) - OMEGA * np.sin(OMEGA * t))


def _slope(t: Floats) -> Floats:
    u = -t / WIDTH**2
    wave = (u * u - WIDTH**-2 - OMEGA**2) * np.cos(OMEGA * t) - 2 * u * OMEGA * np.sin(OMEGA * t)
    return np.exp(-0.5 * (t / WIDTH) ** 2) * wave


GABOR = Waveform(_impulse, _pressure, _slope, 1 / (OMEGA + 3 / WIDTH))
TIMES = np.linspace(-5 * WIDTH, 5 * WIDTH, 20001)


def gabor_spectrum(f: Floats) -> np.ndarray:
    w = 2 * np.pi * f
    lines = np.exp(-0.5 * (WIDTH * (w - OMEGA)) ** 2) + np.exp(-0.5 * (WIDTH * (w + OMEGA)) ** 2)
    return 1j * w * WIDTH * np.sqrt(np.pi / 2) * lines


def in_frequency(t: Floats, corners: Floats, incident: Floats, scattered: Floats) -> Floats:
    """The echo as an integral over frequencies: even steps, which for such a pulse converge as fast as its tails."""
    f = np.arange(1, 3001) * 100.0
    spectrum = facet_amplitude(corners, incident, scattered, 2 * np.pi * f / 1500.0) * gabor_spectrum(f)
    return 200.0 * np.real(np.exp(2j * np.pi * np.outer(t, f)) @ spectrum)


def exact_difference(impulse, times: Floats, apart: float) -> float:
    """S[t0, t1, t2] in 60 digits; equal times are moved apart by so much (s)."""
    t = [mp.mpf(float(x)) + mp.mpf(apart) * i for i, x in enumerate(times)]
    return float(sum(impulse(t[i]) / ((t[i] - t[i - 1]) * (t[i] - t[i - 2])) for i in range(3)))


@pytest.mark.parametrize("size", [1e-6, 1e-3, 0.01, 0.1])
def test_time_and_frequency_domain_agree(size: float) -> None:
    rng = np.random.default_rng(int(1 / size))
    t = np.linspace(-100e-6, 100e-6, 120)
    for case in range(6):
        corners = rng.normal(size=(3, 3)) * size
        normal = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
        a, b = unit(rng.normal(size=(2, 3)))
        if case % 3 == 1:  # the mirror direction: all corners at once
            b = a - 2 * (a @ normal) * normal
        if case % 3 == 2:  # two corners at once
            across = unit(np.cross(normal, corners[1] - corners[0]))
            a, b = -unit(normal + 0.3 * across), unit(normal + 0.1 * across)
        expected = in_frequency(t, corners, a, b)
        got = facet_echo(t, corners, a, b, GABOR)
        scale = abs(facet_echo(np.linspace(-200e-6, 200e-6, 4000), corners, a, b, GABOR)).max()
        assert abs(got - expected).max() < 1e-10 * scale


@pytest.mark.parametrize("gap", 10.0 ** np.arange(-14, -3))
def test_differences_of_a_smooth_pulse_agree_with_exact_arithmetic(gap: float) -> None:
    def impulse(t):
        return mp.exp(-((t / mp.mpf(WIDTH)) ** 2) / 2) * mp.cos(mp.mpf(OMEGA) * t)

    rng = np.random.default_rng(int(-np.log10(gap)))
    largest = 0.5 * abs(_slope(TIMES)).max()
    with mp.workdps(80):
        for case in range(12):
            share = np.sort(rng.uniform(size=3))
            share[1] = (share[1], share[0], share[0] + 1e-3, share[2])[case % 4]
            times = rng.permutation(rng.normal() * WIDTH + gap * share)
            exact = exact_difference(impulse, times, 1e-30)
            assert abs(float(divided_impulse(times, GABOR)) - exact) < 3e-14 * largest


@pytest.mark.parametrize("gap", 10.0 ** np.arange(-12, -3))
def test_differences_of_the_snap_agree_with_exact_arithmetic_across_its_corner(gap: float) -> None:
    def impulse(t):
        if t >= 0:
            return mp.mpf(0)
        a, k, m, q, density = (mp.mpf(v) for v in SNAP)
        z = k * (t - m) / mp.sqrt(2)
        growth, collapse = mp.erfc(-z), mp.log1p(q * t)
        speed = mp.sqrt(2 / mp.pi) * k * mp.exp(-z * z) * collapse + growth * q / (1 + q * t)
        return density * a**3 * (growth * collapse) ** 2 * speed

    waveform = snap_waveform(SNAP)
    largest = 0.5 * abs(waveform.slope(-np.geomspace(1e-10, 1e-3, 4000))).max()
    rng = np.random.default_rng(int(-np.log10(gap)))
    with mp.workdps(80):
        for case in range(9):
            share = np.sort(rng.uniform(size=3))
            share[1] = share[0] if case % 3 == 1 else share[1]
            times = gap * share - (0.5 * gap, gap, gap + 2e-5)[case % 3]
            exact = exact_difference(impulse, times, 1e-34)
            assert abs(float(divided_impulse(times, waveform)) - exact) < 1e-13 * largest


def test_the_waveform_of_the_snap_is_its_own_derivative_and_antiderivative() -> None:
    waveform = snap_waveform(SNAP)
    edges = np.concatenate([-np.geomspace(1.2e-3, 1e-8, 300), [0.0]])
    node, weight = np.polynomial.legendre.leggauss(12)
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    t = middle[:, None] + half[:, None] * node
    for whole, part in ((waveform.impulse, waveform.pressure), (waveform.pressure, waveform.slope)):
        got, change = half * (part(t) @ weight), np.diff(whole(edges))
        np.testing.assert_allclose(got, change, atol=1e-13 * abs(whole(edges)).max())
    assert waveform.slope(np.array([1e-9, 1.0])).tolist() == [0.0, 0.0]


def square(size: float) -> Floats:
    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * size
    return corners[[[0, 1, 2], [0, 2, 3]]]


def test_a_mirror_differentiates_and_an_edge_repeats_the_pulse() -> None:
    t, down = TIMES, np.array([0.0, 0, -1.0])
    mirrored = facet_echo(t, square(0.2), down, -down, GABOR).sum(axis=0)
    np.testing.assert_allclose(mirrored, 0.04 / (2 * np.pi * 1500.0) * 2 * _slope(t) / 2, atol=1e-9)
    tilted = unit(np.array([0.5, 0.0, -1.0]))
    edge = facet_echo(t - 0.2 * tilted[0] / 1500.0, square(0.2), tilted, -tilted, GABOR).sum(axis=0)
    rise = 2 * tilted[0] / 1500.0
    np.testing.assert_allclose(edge, -0.2 * tilted[2] / (2 * np.pi * 1500.0) * _pressure(t) / rise * 2 / 2, atol=1e-9)


def test_samples_stand_for_a_pulse_with_the_stated_error() -> None:
    frequency, width = 100e3, 60e-6
    rng = np.random.default_rng(0)
    times = rng.uniform(-2 * width, 2 * width, (4000, 1)) + rng.uniform(-1, 1, (4000, 3)) * 10 ** rng.uniform(
        -9, -5, (4000, 1)
    )

    def gabor(t: Floats) -> Floats:
        return np.exp(-0.5 * (t / width) ** 2) * np.cos(2 * np.pi * frequency * t + 0.3)

    def slope(t: Floats) -> Floats:
        wave = 2 * np.pi * frequency * np.sin(2 * np.pi * frequency * t + 0.3)
        return -t / width**2 * gabor(t) - np.exp(-0.5 * (t / width) ** 2) * wave

    together = np.repeat(times[:, :1], 3, axis=1)
    for samples, error in ((4, 7e-4), (8, 2e-6), (16, 1.2e-8)):
        step = 1 / (samples * frequency)
        grid = np.arange(-12 * width, 12 * width, step)
        waveform = sampled_waveform(grid[0], step, gabor(grid))
        off = abs(2 * divided_impulse(together, waveform) - slope(times[:, 0])).max() / (2 * np.pi * frequency)
        assert 0.1 * error < off < error
        fine = sampled_waveform(-12 * width, 1 / (40 * frequency), gabor(np.arange(-12 * width, 12 * width, 0.25e-6)))
        apart = abs(divided_impulse(times, waveform) - divided_impulse(times, fine)).max()
        assert 2 * apart < error * 2 * np.pi * frequency
    assert waveform.pressure(np.array([-1.0, 1.0])).tolist() == [0.0, 0.0]
    assert waveform.impulse(np.array([-1.0])).tolist() == [0.0]


def test_bad_samples_are_refused() -> None:
    with pytest.raises(ValueError, match="more than 7 samples"):
        sampled_waveform(0.0, 1e-6, np.zeros(7))
    with pytest.raises(ValueError, match="more than 7 samples"):
        sampled_waveform(0.0, 1e-6, np.full(20, np.nan))
    with pytest.raises(ValueError, match="interval above 0"):
        sampled_waveform(0.0, 0.0, np.zeros(20))
