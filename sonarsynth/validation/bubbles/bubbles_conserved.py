"""Bubbles whose motion is known in closed form, or whose energy is: Rayleigh-Plesset without losses."""

from __future__ import annotations

from collections.abc import Iterator
from math import gamma

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincinv, boxcox

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.equations.bubble.bubble_collapse import Cavity, Collapse
from sonarsynth.validation.bubbles.bubble_checks import RADIUS, described, row, timed
from sonarsynth.validation.validation_rows import Row

RAYLEIGH, ENERGY = "Rayleigh's closed form", "energy"
EMPTY = Cavity(RADIUS, 0.0, 1e5, 0.0, 0.0, 0.0, 1000.0, compressible=False)
UNIT = RADIUS * np.sqrt(EMPTY.density / EMPTY.ambient_pressure)  # s
COLLAPSE = float(np.sqrt(np.pi / 6.0) * gamma(5.0 / 6.0) / gamma(4.0 / 3.0))  # 0.914681356501962
LAW = (25.0 / 6.0) ** 0.2
"""R/R0 over the power 2/5 of the time that is left, at last."""


def left(time: Floats) -> Floats:
    """R/R0 of an empty cavity so long before its collapse (R0 sqrt(rho/p)): from Rayleigh's speed, R'^2 = 2/3 ((R0/R)^3
    - 1), the time is COLLAPSE I((R/R0)^3; 5/6, 1/2), with the incomplete beta function I."""
    return np.asarray(np.cbrt(betaincinv(5.0 / 6.0, 0.5, time / COLLAPSE)))


def rayleigh_rows() -> Iterator[Row]:
    """The collapse of an empty cavity to a point."""
    case = "empty cavity"
    bubble, cost = timed(EMPTY)
    yield row(case, RAYLEIGH, "collapse time", "1", 1e-10, bubble.collapse_time / UNIT / COLLAPSE - 1.0, cost, bubble)
    before = np.geomspace(1e-4, 0.9, 20)
    wall, x = bubble_collapse.wall(-before * UNIT, bubble), left(before)
    yield row(case, RAYLEIGH, "radius over time", "1", 1e-7, np.abs(wall.radius / RADIUS / x - 1.0).max(), cost, bubble)
    before = np.array([1e-1, 1e-2, 1e-3, 1e-4])
    wall, x = bubble_collapse.wall(-before * UNIT, bubble), left(before)
    exponent = wall.speed * -before * UNIT / wall.radius
    law = np.sqrt(2.0 / 3.0 * (x**-3 - 1.0)) * before / x
    yield row(case, RAYLEIGH, "exponent towards 2/5", "1", 1e-7, np.abs(exponent - law).max(), cost, bubble)
    tight, cost = timed(EMPTY, 1e-13)
    end = float(bubble_collapse.wall(-1e-6 * UNIT, tight).radius) / RADIUS / 1e-6**0.4 / LAW
    yield row(f"{case}, tolerance 1e-13", "the 2/5 law", "radius at last", "1", 1e-6, end - 1.0, cost, tight)


def conserved_rows(quick: bool) -> Iterator[Row]:
    """Energy over four collapse times, and the smallest radius that it allows, without friction and surface tension."""
    for gas in (1000.0,) if quick else (10.0, 100.0, 1000.0, 3000.0, 10e3):
        cavity = described(gas, compressible=False)._replace(viscosity=0.0, surface_tension=0.0)
        case = f"Rayleigh-Plesset without losses, {gas:g} Pa"
        bubble, cost = timed(cavity)
        least = smallest(cavity) * RADIUS
        yield row(case, ENERGY, "smallest radius", "1", 1e-9, bubble.minimum_radius / least - 1.0, cost, bubble)
        bubble, cost = timed(cavity, 1e-9, rebounds=1)
        case += ", tolerance 1e-9"
        yield row(case, ENERGY, "energy, two collapses", "1", 1e-8, drift(bubble), cost, bubble)


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
