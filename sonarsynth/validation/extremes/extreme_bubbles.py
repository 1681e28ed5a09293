"""Bubbles near collapse, against Rayleigh's closed form, energy, and the reasons of refusals."""

from __future__ import annotations

from math import gamma

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincinv, boxcox

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.equations.bubble.bubble_collapse import moving, stretched
from sonarsynth.equations.bubble.bubble_equations import Cavity
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.bubbles.bubble_checks import RADIUS
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together

EMPTY = Cavity(RADIUS, 1e-9, 1e5, 0.0, 0.0, 0.0, 1000.0, np.inf)
"""With next to no gas, in water without compression, friction and tension."""
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


def _rayleigh() -> CaseResult:
    """To the last billionth of the time: the radius over R0 is that of the incomplete beta function."""
    bubble = bubble_collapse.collapse(EMPTY, 0, 1e-13)
    before = np.geomspace(1e-9, 0.9, 30)
    exact = radius_before(before)
    radius = moving(stretched(-before * UNIT, bubble), bubble).radius / RADIUS
    return together(
        off(bubble.collapse_time / UNIT / COLLAPSE - 1.0, 1e-12, what="time of collapse"),
        off((radius / exact - 1.0)[before > 1e-5], 1e-7, what="radius"),
        off((radius / exact - 1.0), 1e-4, what="radius to 1e-9 before"),
    )


def _energy() -> CaseResult:
    """Without friction and tension the work of the drive is in the gas where the wall turns, and it comes back."""
    results = []
    for gas in (1e-3, 1.0, 1e3, 1e4, 5e4):
        cavity = EMPTY._replace(gas_pressure=gas)
        bubble = bubble_collapse.collapse(cavity, 1, 1e-11)
        least = np.array([turn.radius for turn in bubble.smallest]) / RADIUS / smallest(cavity)
        results.append(off(least - 1.0, 1e-8, what=f"{gas:g} Pa: smallest radii"))
        results.append(off(np.array([turn.radius for turn in bubble.largest]) / RADIUS - 1.0, 1e-8, what="largest"))
    return together(*results)


def _impulse() -> CaseResult:
    """The pressure is the slope of rho R^2 R', through the collapse: its integral, by the wall's own speed."""
    bubble = bubble_collapse.collapse(EMPTY._replace(gas_pressure=10.0, sound_speed=1482.0), 0, 1e-11)
    time, _, _, pressure, flow = moving(np.linspace(bubble.steps[0], bubble.steps[-1], 200_001), bubble)
    total = np.append(0.0, np.cumsum(0.5 * np.diff(time) * (pressure[1:] + pressure[:-1])))
    return together(
        holds(bool(np.isfinite(pressure).all()), f"finite, {np.abs(pressure).max():.3g} Pa at most"),
        off((flow - flow[0] - total) / np.abs(flow).max(), 1e-4, what="impulse"),
    )


def _no_snap() -> CaseResult:
    return together(
        refused(lambda: KellerMiksis(gas_pressure=0.01).pulse(5.0, 110e3), "times the speed of sound"),
        refused(lambda: KellerMiksis(gas_pressure=150e3).pulse(5.0, 110e3), "does not collapse"),
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
        results.append(off(bubble.smallest[0].radius / size / (reference.smallest[0].radius / RADIUS) - 1.0, 1e-8))
    return together(*results)


CASES = (
    Case("an empty bubble, to a billionth before its collapse", "Rayleigh's closed form", _rayleigh),
    Case("gas of 1e-3 Pa to half an atmosphere", "smallest and largest radii by conservation of energy", _energy),
    Case("pressure through a violent collapse", "finite; its integral is the flow's", _impulse),
    Case("bubbles that make no snap", "refused, with the reason", _no_snap),
    Case("bubbles of 1 um, 1 m and 1 km", "alike, times their size", _any_size),
)
