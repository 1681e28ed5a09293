"""Bubbles where they are stiff: little gas or none, great depth, tiny, thick water, and those without a collapse."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, pulses
from sonarsynth.equations.bubble.bubble_collapse import Cavity
from sonarsynth.equations.noise.filters import Fir

R0 = 3.5e-3
FIR = Fir(0.0, 110e3, 20e3, 80.0)


def cavity(gas: float, depth: float, **other: float) -> Cavity:
    return Cavity(R0, gas, bubble_collapse.ambient_pressure(depth), **other)  # type: ignore[arg-type]


@pytest.mark.parametrize("compressible", [True, False])
@pytest.mark.parametrize("core", [True, False])
@pytest.mark.parametrize("depth", [0.0, 1000.0])
@pytest.mark.parametrize("gas", [1e-3, 1.0, 100.0, 10_000.0])
def test_solved_or_flagged(gas: float, depth: float, core: bool, compressible: bool) -> None:
    ambient = bubble_collapse.ambient_pressure(depth)
    h = bubble_collapse.hard_core(R0, gas, ambient) if core else 0.0
    found, tight = (
        bubble_collapse.collapse(Cavity(R0, gas, ambient, core=h, compressible=compressible), 1, tolerance=e)
        for e in (1e-10, 1e-12)
    )
    assert found.minimum_radius == pytest.approx(tight.minimum_radius, rel=1e-7)
    assert found.largest[1].radius == pytest.approx(tight.largest[1].radius, rel=1e-6)
    assert h < found.minimum_radius < found.largest[1].radius <= found.largest[0].radius * (1 + 1e-9) < R0 * (1 + 1e-9)
    assert found.flag == (2 if found.mach > 0.5 else 1 if found.mach > 0.3 else 0)
    assert ("theory" in found.reason) == (found.mach > 0.5)
    time = np.concatenate([np.linspace(found.clock[0], found.clock[-1], 200), np.geomspace(1e-15, found.clock[-1], 40)])
    for values in (*bubble_collapse.wall(time, found), bubble_collapse.pressure(time, found)):
        assert np.isfinite(values).all()
    S = pulses.spectrum(np.array([0.0, 50e3, 110e3]), bubble_pulse.pulse(found, 110e3))
    assert np.isfinite(S).all() and abs(S[0]) < 1e-6 * abs(S[1])


@pytest.mark.parametrize("compressible", [True, False])
@pytest.mark.parametrize("depth", [0.0, 100.0])
def test_without_gas_a_point_with_a_finite_spectrum(depth: float, compressible: bool) -> None:
    found = bubble_collapse.collapse(cavity(0.0, depth, compressible=compressible))
    nearly = bubble_collapse.collapse(cavity(1e-6, depth, compressible=compressible))
    assert found.flag == bubble_collapse.SINGULAR and "point" in found.reason
    assert found.minimum_radius == 0.0 and found.mach == np.inf
    assert bubble_pulse.peak(found) == (0.0, np.inf) and bubble_pulse.source_level(found) == np.inf
    assert found.collapse_time == pytest.approx(nearly.collapse_time, rel=1e-6)
    pulse = bubble_pulse.pulse(found, pulses.reach(FIR))
    assert np.isfinite(pulse.strength).all() and abs(pulse.strength.sum()) < 1e-7 * np.abs(pulse.strength).sum()
    assert 150 < pulses.levels(pulse, FIR).peak < 250
    with pytest.raises(ValueError, match="infinite"):
        pulses.gain_for_level(pulse, 190.0)


def test_less_gas_tends_to_none() -> None:
    f = np.array([25e3, 50e3, 110e3])
    none, *some = (
        pulses.spectrum(f, bubble_pulse.pulse(bubble_collapse.collapse(cavity(g, 5.0)), 110e3))
        for g in (0, 10, 1e-1, 1e-3)
    )
    far = [np.abs(s - none).max() for s in some]
    assert far[0] > far[1] > far[2] and far[2] < 0.6 * far[1] < 0.6 * far[0]


def test_near_equilibrium_it_swings_as_minnaerts_bubble() -> None:
    """Minnaert (1933): angular frequency sqrt(3 g p/rho)/R of a small oscillation; the collapse takes half a period."""
    ambient = 101325.0
    push = 1e-4
    gas = ambient * (1 - push)
    found = bubble_collapse.collapse(Cavity(R0, gas, ambient, 0.0, 0.0, 0.0, sound_speed=1e9))
    swing = (R0 - found.minimum_radius) / R0
    assert swing == pytest.approx(2 * push / (3 * 1.4), rel=1e-3)
    assert found.collapse_time == pytest.approx(np.pi * R0 / np.sqrt(3 * 1.4 * ambient / 998.0), rel=1e-3)


def test_thick_water_and_tiny_bubbles_settle() -> None:
    for settled in (cavity(1000.0, 5.0, viscosity=100.0), Cavity(1e-9, 1000.0, 150e3)):
        found = bubble_collapse.collapse(settled)
        assert found.flag == bubble_collapse.SETTLED and found.smallest == () and "settles" in found.reason
        assert np.isnan([found.collapse_time, found.minimum_radius, *bubble_pulse.peak(found)]).all()
        assert np.isnan(bubble_collapse.pressure([0.0, 1e-6], found)).all()
        assert all(np.isnan(v).all() for v in bubble_collapse.wall(0.0, found))
        with pytest.raises(ValueError, match="settles"):
            bubble_pulse.pulse(found, 1e5)


def test_outside_of_what_was_solved_is_nothing_known() -> None:
    found = bubble_collapse.collapse(cavity(1000.0, 5.0))
    first, last = found.clock[[0, -1]]
    outside = np.array([-np.inf, first - 1e-9, last + 1e-9, np.inf, np.nan])
    assert np.isnan(bubble_collapse.pressure(outside, found)).all()
    assert np.isfinite(bubble_collapse.pressure([first, 0.0, last], found)).all()
    assert bubble_collapse.wall(np.zeros((2, 3)), found).radius.shape == (2, 3)
    assert float(bubble_collapse.wall(first, found).radius) == pytest.approx(R0, rel=1e-14)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        (Cavity(R0, 200e3, 150e3), "does not collapse"),
        (Cavity(R0, 0.0, 2000.0), "not above the vapour"),
        (Cavity(R0, 1000.0, 150e3, core=4e-3), "hard core"),
        (Cavity(R0, 0.0, 150e3, core=1e-5), "hard core"),
        (Cavity(-1.0, 1000.0, 150e3), "must have a size"),
        (Cavity(R0, np.nan, 150e3), "must have a size"),
        (Cavity(R0, 1000.0, 150e3, exponent=0.9), "exponent >= 1"),
        (Cavity(R0, 1000.0, np.inf), "must have a size"),
    ],
)
def test_what_cannot_collapse_is_refused(wrong: Cavity, text: str) -> None:
    with pytest.raises(ValueError, match=text) as error:
        bubble_collapse.collapse(wrong)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("fade", [-0.1, 1.1, np.nan])
def test_a_fade_is_a_part(fade: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        bubble_pulse.pulse(bubble_collapse.collapse(cavity(1000.0, 5.0)), 1e5, fade)
