"""Bubbles near collapse and without gas, against Rayleigh's closed form, energy, and the reasons of refusals."""

from __future__ import annotations

from math import gamma

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincinv, boxcox

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.bubbles.bubble_checks import RADIUS
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together

EMPTY = Cavity(RADIUS, 0.0, 1e5, 0.0, 0.0, 0.0, 1000.0, compressible=False)
UNIT = RADIUS * np.sqrt(EMPTY.density / EMPTY.ambient_pressure)  # s
COLLAPSE = float(np.sqrt(np.pi / 6.0) * gamma(5.0 / 6.0) / gamma(4.0 / 3.0))  # 0.914681356501962


def radius_before(time: Floats) -> Floats:
    """R/R0 of an empty cavity so long before its collapse (R0 sqrt(rho/p)): from Rayleigh's speed, R'^2 = 2/3 ((R0/R)^3
    - 1), the time is COLLAPSE I((R/R0)^3; 5/6, 1/2), with the incomplete beta function I."""
    return np.asarray(np.cbrt(betaincinv(5.0 / 6.0, 0.5, time / COLLAPSE)))


def smallest(cavity: Cavity) -> float:
    """Smallest R/R0 of a cavity without friction and tension, of energy alone: the work of the drive is in the gas."""
    drive, g = cavity.ambient_pressure - cavity.vapour_pressure, cavity.exponent - 1.0

    def left_over(q: float) -> float:
        return float(drive * (1.0 - np.exp(3.0 * q)) - cavity.gas_pressure * boxcox(np.exp(-3.0 * q), g))

    return float(np.exp(brentq(left_over, -25.0, -1e-3, xtol=1e-15, rtol=1e-15)))


def drift(bubble: Collapse) -> float:
    """Largest change of the energy over all of what was solved, relative; times are dense about each collapse."""
    first, last = bubble.clock[[0, -1]]
    near = np.geomspace(1e-12, 1e-5, 40)
    about = np.concatenate([turn.time + np.append(-near, near) for turn in bubble.smallest])
    time = np.concatenate([np.linspace(first, last, 2000), bubble.clock, about])
    return float(np.abs(bubble_collapse.energy(time, bubble) / bubble_collapse.energy(first, bubble) - 1.0).max())


def _rayleigh() -> CaseResult:
    """To the last billionth of the time: the radius over R0 is that of the incomplete beta function."""
    bubble = bubble_collapse.collapse(EMPTY, 0, 1e-13)
    before = np.geomspace(1e-9, 0.9, 30)
    exact = radius_before(before)
    radius = bubble_collapse.wall(-before * UNIT, bubble).radius / RADIUS
    return together(
        off(bubble.collapse_time / UNIT / COLLAPSE - 1.0, 1e-12, what="time of collapse"),
        off((radius / exact - 1.0)[before > 1e-5], 1e-7, what="radius"),
        off((radius / exact - 1.0), 1e-4, what="radius to 1e-9 before"),
        holds(bubble.flag == bubble_collapse.SINGULAR and bubble.mach == np.inf, bubble.reason),
    )


def _energy() -> CaseResult:
    """Without friction and tension the work of the drive is in the gas where the wall turns."""
    results = []
    for gas in (1e-3, 1.0, 1e3, 1e4, 5e4):
        cavity = EMPTY._replace(gas_pressure=gas, exponent=1.4)
        bubble = bubble_collapse.collapse(cavity, 1, 1e-11)
        least = smallest(cavity)
        results.append(off(bubble.minimum_radius / RADIUS / least - 1.0, 1e-8, what=f"{gas:g} Pa: smallest radius"))
        results.append(off(drift(bubble), 1e-7, what="energy"))
    return together(*results)


def _impulse() -> CaseResult:
    """The pressure is the slope of rho R^2 R', through the collapse: its integral, by the wall's own speed."""
    bubble = bubble_collapse.collapse(
        EMPTY._replace(gas_pressure=10.0, vapour_pressure=0.0, compressible=True), 0, 1e-11
    )
    s = np.linspace(bubble.steps[0], bubble.steps[-1], 200_001)
    moving = bubble_collapse.moving(s, bubble)
    total = np.concatenate(
        [[0.0], np.cumsum(0.5 * np.diff(moving.time) * (moving.pressure[1:] + moving.pressure[:-1]))]
    )
    flow = bubble.cavity.density * moving.wall.radius**2 * moving.wall.speed
    size = np.abs(flow).max()
    return together(
        holds(bool(np.isfinite(moving.pressure).all()), f"finite, {np.abs(moving.pressure).max():.3g} Pa at most"),
        off((flow - flow[0] - total) / size, 1e-4, what="impulse"),
    )


def _gas_free() -> CaseResult:
    return together(
        refused(lambda: KellerMiksis(gas_pressure=0.0).pulse(5.0, 110e3), "nothing stops"),
        refused(lambda: KellerMiksis(gas_pressure=0.01).collapse(5.0), "largest_mach"),
        refused(lambda: KellerMiksis(gas_pressure=150e3).collapse(5.0), "does not collapse"),
        refused(lambda: KellerMiksis(surface_pressure=0.0, depth=0.0).collapse(0.0), "not above the vapour"),
        refused(lambda: KellerMiksis(viscosity=100.0).collapse(5.0), "settles"),
    )


def _any_size() -> CaseResult:
    """Times and radii scale with the radius where friction and tension are nothing."""
    base, results = EMPTY._replace(gas_pressure=1e3), []
    reference = bubble_collapse.collapse(base)
    for size in (1e-6, 1.0, 1e3):
        bubble = bubble_collapse.collapse(base._replace(radius=size))
        results.append(
            off(bubble.collapse_time / size / (reference.collapse_time / RADIUS) - 1.0, 1e-9, what=f"{size:g} m:")
        )
        results.append(off(bubble.minimum_radius / size / (reference.minimum_radius / RADIUS) - 1.0, 1e-8))
    return together(*results)


CASES = (
    Case("an empty bubble, to a billionth before its collapse", "Rayleigh's closed form; the reason", _rayleigh),
    Case("gas of 1e-3 Pa to half an atmosphere", "smallest radius and energy by conservation", _energy),
    Case("pressure through a violent collapse", "finite; its integral is the flow's", _impulse),
    Case("bubbles that make no snap", "refused, with the reason", _gas_free),
    Case("bubbles of 1 um, 1 m and 1 km", "alike, times their size", _any_size),
)
