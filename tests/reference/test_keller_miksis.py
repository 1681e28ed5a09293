"""The collapsing bubble against published values, closed forms, conserved quantities and an independent solution."""

from __future__ import annotations

from math import gamma

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, pulses
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse

R0 = 3.5e-3
AMBIENT = bubble_collapse.ambient_pressure(5.0)
EMPTY = Cavity(R0, 0.0, 1e5, 0.0, 0.0, 0.0, 1000.0, compressible=False)
T, U = R0 * np.sqrt(1e3 / 1e5), np.sqrt(1e5 / 1e3)


def cavity(gas: float, depth: float = 5.0, **other: float) -> Cavity:
    return Cavity(R0, gas, bubble_collapse.ambient_pressure(depth), **other)  # type: ignore[arg-type]


def test_a_core_that_vanishes_is_no_core() -> None:
    soft, hard = bubble_collapse.collapse(cavity(1000)), bubble_collapse.collapse(cavity(1000, core=1e-8))
    assert hard.minimum_radius == pytest.approx(soft.minimum_radius, rel=1e-9)


def test_spectrum_of_a_point_falls_as_the_fifth_root() -> None:
    """R = A R0 (-t/T)^(2/5) at the end, so that rho R^2 R' = -0.4 rho R0^2 U A^3 (-t/T)^(1/5)."""
    pulse = bubble_pulse.pulse(bubble_collapse.collapse(EMPTY), 1e7)
    f = np.array([1e5, 1e6, 1e7])
    law = 0.08 * 1000 * R0**2 * U * (25 / 6) ** 0.6 * gamma(0.2) * (2 * np.pi * f * T) ** -0.2 * np.exp(0.1j * np.pi)
    got = pulses.spectrum(f, pulse) / law
    assert np.abs(got - 1)[0] < 3e-3 and np.abs(got - 1)[1] < 2e-4 and np.abs(got - 1)[2] < 2e-5


def gauss(found: Collapse) -> tuple[bubble_collapse.Motion, Floats]:
    node, weight = np.polynomial.legendre.leggauss(20)
    a, b = found.steps[:-1, None], found.steps[1:, None]
    moved = bubble_collapse.moving((0.5 * (a + b) + 0.5 * (b - a) * node).ravel(), found)
    return moved, (0.5 * (b - a) * weight).ravel() * moved.rate


def test_viscosity_takes_the_energy_that_is_lost() -> None:
    found = bubble_collapse.collapse(cavity(1000, viscosity=1.0, compressible=False))
    before, after = bubble_collapse.energy(found.clock[[0, -1]], found)
    moved, weight = gauss(found)
    assert before - after == pytest.approx(
        16 * np.pi * np.sum(weight * moved.wall.radius * moved.wall.speed**2), rel=1e-8
    )


def test_sound_takes_the_energy_that_is_lost_to_first_order() -> None:
    miss, mach = [], []
    for gas in (3000.0, 10e3, 20e3):
        found = bubble_collapse.collapse(cavity(gas, viscosity=0.0))
        before, after = bubble_collapse.energy(found.clock[[0, -1]], found)
        moved, weight = gauss(found)
        radiated = 4 * np.pi / (998.0 * 1482.0) * np.sum(weight * moved.pressure**2)
        miss.append(1 - float((before - after) / radiated))
        mach.append(found.mach)
    assert 0 < miss[2] < miss[1] < miss[0] < 0.2 * mach[0]
    assert miss[2] < 1e-3


def test_slow_sound_gone_keller_miksis_is_rayleigh_plesset() -> None:
    swift, still = (
        bubble_collapse.collapse(cavity(1000, sound_speed=c, compressible=k)) for c, k in ((1e9, True), (1482.0, False))
    )
    assert swift.minimum_radius == pytest.approx(still.minimum_radius, rel=1e-5)
    assert swift.collapse_time == pytest.approx(still.collapse_time, rel=1e-7)


def test_derivatives_are_those_of_the_radius() -> None:
    found = bubble_collapse.collapse(cavity(1000.0), tolerance=1e-13)
    t, h = np.array([-2e-4, -1e-5, -2e-6, 3e-6, 1e-4]), 1e-9
    wall, after, before = (bubble_collapse.wall(t + d, found) for d in (0.0, h, -h))
    assert wall.speed == pytest.approx((after.radius - before.radius) / (2 * h), rel=1e-5)
    assert wall.acceleration == pytest.approx((after.speed - before.speed) / (2 * h), rel=1e-5)
    flow = [w.radius**2 * w.speed for w in (after, before)]
    assert bubble_collapse.pressure(t, found) == pytest.approx(998.0 * (flow[0] - flow[1]) / (2 * h), rel=1e-4)


def test_width_is_that_of_an_independent_solution() -> None:
    found = bubble_collapse.collapse(cavity(100.0))
    time, top = bubble_pulse.peak(found)
    t = time + np.linspace(-1.5e-7, 1.5e-7, 6001)
    p = bubble_collapse.pressure(t, found)
    assert top == pytest.approx(p.max(), rel=1e-6)
    assert np.ptp(t[p >= 0.5 * top]) == pytest.approx(66.6e-9, abs=3e-10)


@pytest.mark.parametrize("rebounds", [0, 1, 3])
def test_a_fade_takes_the_steps_at_the_ends_and_leaves_no_net_impulse(rebounds: int) -> None:
    found = bubble_collapse.collapse(cavity(2000.0), rebounds)
    f = np.array([0.0, 200e3, 500e3, 1e6])
    faded, cut = (pulses.spectrum(f, bubble_pulse.pulse(found, f[-1], fade)) for fade in (0.5, 0.0))
    assert abs(faded[0]) < 1e-9 * np.abs(cut).max() and abs(cut[0]) < 1e-9 * np.abs(cut).max()
    ends = found.clock[[0, -1]]
    p = bubble_collapse.pressure(ends, found)
    assert p[0] == pytest.approx(-R0 * (AMBIENT - 2339.0 - 2000.0 + 2 * 0.0725 / R0), rel=1e-6)
    steps = np.exp(-2j * np.pi * np.outer(f[1:], ends)) @ (p * [1, -1]) / (2j * np.pi * f[1:])
    assert np.abs(cut - faded - np.append(0, steps)).max() < 1e-4 * np.abs(cut).max()
    assert len(found.smallest) == len(found.largest) == rebounds + 1
