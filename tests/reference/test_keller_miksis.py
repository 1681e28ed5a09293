"""The collapsing bubble: the printed equation and closed forms against one another, the accuracy table, its pulse."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from sonarsynth.equations.bubble import bubble_collapse, bubble_pulse, pulses
from sonarsynth.equations.bubble.bubble_collapse import moving, stretched
from sonarsynth.equations.bubble.bubble_equations import Cavity, ambient_pressure
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.signals.filtered_pulse import snap_gains, snap_levels
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.state import Emission
from sonarsynth.validation.bubbles import bubble_accuracy, bubble_checks
from sonarsynth.validation.bubbles.bubble_checks import described, equation_rows, exact, level_rows, tolerance_rows
from sonarsynth.validation.bubbles.bubbles_logarithmic import logarithmic_rows
from sonarsynth.validation.extremes import extreme_bubbles

R0 = 3.5e-3
NUMBERS = {
    ("Rayleigh-Plesset", 1000.0): (264.931205028e-6, 115.131170396e-6, 194639.11, 529.7965203e-6, 3.499278989e-3),
    ("Keller-Miksis", 1000.0): (266.595948477e-6, 172.320125199e-6, 53529.824, 462.5012497e-6, 2.549506611e-3),
    ("Rayleigh-Plesset", 100.0): (263.105018922e-6, 17.1129325736e-6, 8678555.5, 526.1318877e-6, 3.499125169e-3),
    ("Keller-Miksis", 100.0): (264.646120412e-6, 58.5736406583e-6, 169198.31, 380.7513615e-6, 1.516192155e-3),
}
"""Equation and gas (Pa) at 5 m: time (s) and radius (m) of the collapse, pressure there (Pa at 1 m), time and radius of
the rebound. Two formulations and two solvers agreed on them to 1e-14."""


@pytest.mark.parametrize(("equation", "gas"), list(NUMBERS))
def test_the_printed_equation_has_the_frozen_numbers_to_their_last_digit(equation: str, gas: float) -> None:
    time, radius, pressure, again, rebound = NUMBERS[equation, gas]
    best = exact(described(gas, compressible=equation == "Keller-Miksis"))
    assert best.times == pytest.approx((time, again), rel=2e-10)
    assert best.radii == pytest.approx((radius, rebound), rel=3e-10)
    assert best.pressures[0] == pytest.approx(pressure, rel=1e-7)


def test_the_printed_equation_leaves_no_impulse_and_loses_what_it_should() -> None:
    """Without losses a Rayleigh-Plesset bubble comes back to where it was; its smallest radius is that of energy."""
    best = exact(described(1000.0))
    assert abs(best.weight @ best.pressure) < 1e-10 * (best.weight @ np.abs(best.pressure))
    ideal = described(1000.0, compressible=False)._replace(viscosity=0.0, surface_tension=0.0)
    best = exact(ideal)
    assert best.radii[1] == pytest.approx(ideal.radius, rel=1e-12)
    assert best.times[1] == pytest.approx(2.0 * best.times[0], rel=1e-12)
    assert best.radii[0] == pytest.approx(extreme_bubbles.smallest(ideal) * ideal.radius, rel=1e-12)
    assert extreme_bubbles.smallest(ideal) == pytest.approx(0.03289765638, abs=1e-11)


def test_the_last_of_an_empty_cavity_is_rayleighs() -> None:
    """The time left at R/R0 = x is sqrt(3/2) times the integral of 1/sqrt(1/u^3 - 1) up to x."""
    for part in (0.999, 0.5, 1e-3):
        time = part * extreme_bubbles.COLLAPSE
        x = float(extreme_bubbles.radius_before(np.array(time)))
        integral = quad(lambda u: np.sqrt(1.5 * u**3 / (1.0 - u**3)), 0.0, x)[0]
        assert integral == pytest.approx(time, rel=1e-6)
    assert extreme_bubbles.radius_before(np.array(1e-8)) == pytest.approx((25.0 / 6.0) ** 0.2 * 1e-8**0.4, rel=1e-6)


def test_bubbles_have_the_numbers_of_tables_and_of_the_printed_equation() -> None:
    """Collapse, rebound, levels, errors over the tolerance, and the formula of the logarithmic bubble."""
    solved = [*equation_rows(True), *level_rows(False), *tolerance_rows(False)]
    assert [row for row in (*solved, *logarithmic_rows(True)) if not row.ok] == []


@pytest.mark.long
def test_the_table_holds() -> None:
    assert [row for row in bubble_accuracy(quick=True) if not row.ok] == []


def test_a_bubble_that_is_wrong_fails_its_rows() -> None:
    coarse, cost = bubble_checks.solved(described(1000.0), tolerance=1e-4)
    verdicts = {row.quantity: row.ok for row in bubble_checks.printed_rows("coarse", coarse, cost)}
    assert not any(verdicts.values())


def test_near_equilibrium_it_swings_as_minnaerts_bubble() -> None:
    """Minnaert (1933): angular frequency sqrt(3 g p/rho)/R of a small oscillation; the collapse takes half a period."""
    ambient, push = 101325.0, 1e-4
    found = bubble_collapse.collapse(Cavity(R0, ambient * (1 - push), ambient, 0.0, 0.0, 0.0, sound_speed=np.inf))
    assert (R0 - found.smallest[0].radius) / R0 == pytest.approx(2 * push / (3 * 1.4), rel=1e-3)
    assert found.collapse_time == pytest.approx(np.pi * R0 / np.sqrt(3 * 1.4 * ambient / 998.0), rel=1e-3)


def test_width_is_that_of_an_independent_solution() -> None:
    found = bubble_collapse.collapse(described(100.0))
    time, top = bubble_pulse.peak(found)
    t = time + np.linspace(-1.5e-7, 1.5e-7, 6001)
    p = moving(stretched(t, found), found).pressure
    assert top == pytest.approx(p.max(), rel=1e-6)
    assert np.ptp(t[p >= 0.5 * top]) == pytest.approx(66.6e-9, abs=3e-10)


@pytest.mark.parametrize("rebounds", [0, 1, 3])
def test_a_fade_takes_the_steps_at_the_ends_and_leaves_no_net_impulse(rebounds: int) -> None:
    found = bubble_collapse.collapse(described(2000.0), rebounds)
    f = np.array([0.0, 200e3, 500e3, 1e6])
    faded, cut = (pulses.spectrum(f, bubble_pulse.pulse(found, f[-1], fade)) for fade in (0.5, 0.0))
    assert abs(faded[0]) < 1e-9 * np.abs(cut).max() and abs(cut[0]) < 1e-9 * np.abs(cut).max()
    p = moving(found.steps[[0, -1]], found).pressure
    assert p[0] == pytest.approx(-R0 * (ambient_pressure(5.0) - 2339.0 - 2000.0 + 2 * 0.0725 / R0), rel=1e-6)
    steps = np.exp(-2j * np.pi * np.outer(f[1:], found.clock[[0, -1]])) @ (p * [1, -1]) / (2j * np.pi * f[1:])
    assert np.abs(cut - faded - np.append(0, steps)).max() < 1e-4 * np.abs(cut).max()
    assert len(found.smallest) == len(found.largest) == rebounds + 1


@pytest.mark.parametrize(("gas", "depth"), [(100.0, 0.0), (2000.0, 5.0), (10e3, 100.0)])
def test_the_peak_is_that_of_the_filtered_spectrum(gas: float, depth: float) -> None:
    made = bubble_pulse.pulse(
        bubble_collapse.collapse(described(gas, depth), 1), pulses.reach(low := bubble_pulse.LOW_PASS)
    )
    f, n = np.arange(0.0, pulses.reach(low), 500.0), 1 << 17
    wave = np.fft.irfft(pulses.spectrum(f, made) * filters.response(f, low), n) * n * 500.0
    assert made.peak == pytest.approx(wave.max(), rel=3e-4)


def test_an_imposed_level_is_heard_whatever_the_gas_and_the_own_one_is_stored() -> None:
    ear, heard = Fir(0.0, 200e3, 20e3, 60.0), []
    for gas in (1000.0, 3000.0):
        model = KellerMiksis(gas_pressure=gas, depth=5.0)
        snap = Emission(np.zeros(3), 0.0, model, 190.0, 1.0, 1.0)
        made = pulses.scaled(model.pulse(0.0, pulses.reach(ear)), float(snap_gains((snap,))[0]), 1.0)
        heard.append(pulses.levels(made, ear).peak)
    assert heard == pytest.approx([190.0] * 2, abs=0.3)
    own = Emission(np.zeros(3), 0.0, KellerMiksis(depth=5.0), None, 1.0, 1.0)
    assert snap_levels((own,)) == pytest.approx(205.85, abs=0.01)


def test_bubbles_that_cannot_be_followed_are_refused_in_one_line() -> None:
    for wrong, text in (
        (Cavity(R0, 200e3, 150e3), "does not collapse"),
        (Cavity(R0, 0.0, 2000.0), "not above the vapour"),
        (Cavity(3.0, 1e-12, 150e3), "cannot be followed"),
    ):
        with pytest.raises(ValueError, match=text) as error:
            bubble_collapse.collapse(wrong)
        assert "\n" not in str(error.value)
