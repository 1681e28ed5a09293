"""The references of the bubbles' accuracy table against one another and closed forms; the table holds, and can fail."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.bubbles import bubble_accuracy, bubble_checks
from sonarsynth.validation.bubbles.bubble_checks import described, equation_rows, exact, level_rows, tolerance_rows
from sonarsynth.validation.bubbles.bubbles_logarithmic import logarithmic_rows
from sonarsynth.validation.extremes import extreme_bubbles

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
    assert extreme_bubbles.drift(bubble_collapse.collapse(described(1000.0), 1, 1e-9)) > 1e-3  # it radiates


def test_a_snap_that_may_be_fast_is_not_refused() -> None:
    slow, fast = KellerMiksis(gas_pressure=10.0), KellerMiksis(gas_pressure=10.0, largest_mach=3.0)
    with pytest.raises(ValueError, match=r"largest_mach 0\.5"):
        slow.pulse(5.0, 110e3)
    assert np.isfinite(fast.pulse(5.0, 110e3).strength).all()
