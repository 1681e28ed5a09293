"""Bubbles near collapse and without gas, against Rayleigh's closed form, energy, and the reasons of refusals."""

from __future__ import annotations

from math import gamma

import numpy as np
from scipy.optimize import brentq
from scipy.special import betaincinv, boxcox

from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.equations.bubble.bubble_collapse import Cavity
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together

RADIUS = 3.5e-3
EMPTY = Cavity(RADIUS, 0.0, 1e5, 0.0, 0.0, 0.0, 1000.0, compressible=False)
UNIT = RADIUS * np.sqrt(EMPTY.density / EMPTY.ambient_pressure)  # s
WHOLE = float(np.sqrt(np.pi / 6.0) * gamma(5.0 / 6.0) / gamma(4.0 / 3.0))


def _rayleigh() -> CaseResult:
    """To the last billionth of the time: the radius over R0 is that of the incomplete beta function."""
    found = bubble_collapse.collapse(EMPTY, 0, 1e-13)
    before = np.geomspace(1e-9, 0.9, 30)
    exact = np.cbrt(betaincinv(5.0 / 6.0, 0.5, before / WHOLE))
    got = bubble_collapse.wall(-before * UNIT, found).radius / RADIUS
    return together(
        off(found.collapse_time / UNIT / WHOLE - 1.0, 1e-12, what="time of collapse"),
        off((got / exact - 1.0)[before > 1e-5], 1e-7, what="radius"),
        off((got / exact - 1.0), 1e-4, what="radius to 1e-9 before"),
        holds(found.flag == bubble_collapse.SINGULAR and found.mach == np.inf, found.reason),
    )


def _energy() -> CaseResult:
    """Without friction and tension the work of the drive is in the gas where the wall turns."""
    parts = []
    for gas in (1e-3, 1.0, 1e3, 1e4, 5e4):
        cavity = EMPTY._replace(gas_pressure=gas, exponent=1.4)

        def left_over(q: float, gas: float = gas) -> float:
            return float(1e5 * (1.0 - np.exp(3.0 * q)) - gas * boxcox(np.exp(-3.0 * q), 0.4))

        least = np.exp(brentq(left_over, -25.0, -1e-3, xtol=1e-15, rtol=1e-15))
        found = bubble_collapse.collapse(cavity, 1, 1e-11)
        first, last = found.clock[[0, -1]]
        near = np.geomspace(1e-14, 1e-6, 40)
        time = np.concatenate([np.linspace(first, last, 500), -near, [0.0], near])
        drift = bubble_collapse.energy(time, found) / bubble_collapse.energy(first, found) - 1.0
        parts.append(off(found.minimum_radius / RADIUS / least - 1.0, 1e-8, what=f"{gas:g} Pa: smallest radius"))
        parts.append(off(drift, 1e-7, what="energy"))
    return together(*parts)


def _impulse() -> CaseResult:
    """The pressure is the slope of rho R^2 R', through the collapse: its integral, by the wall's own speed."""
    found = bubble_collapse.collapse(
        EMPTY._replace(gas_pressure=10.0, vapour_pressure=0.0, compressible=True), 0, 1e-11
    )
    s = np.linspace(found.steps[0], found.steps[-1], 200_001)
    moving = bubble_collapse.moving(s, found)
    total = np.concatenate(
        [[0.0], np.cumsum(0.5 * np.diff(moving.time) * (moving.pressure[1:] + moving.pressure[:-1]))]
    )
    flow = found.cavity.density * moving.wall.radius**2 * moving.wall.speed
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
    base, parts = EMPTY._replace(gas_pressure=1e3), []
    one = bubble_collapse.collapse(base)
    for size in (1e-6, 1.0, 1e3):
        found = bubble_collapse.collapse(base._replace(radius=size))
        parts.append(off(found.collapse_time / size / (one.collapse_time / RADIUS) - 1.0, 1e-9, what=f"{size:g} m:"))
        parts.append(off(found.minimum_radius / size / (one.minimum_radius / RADIUS) - 1.0, 1e-8))
    return together(*parts)


CASES = (
    Case("an empty bubble, to a billionth before its collapse", "Rayleigh's closed form; the reason", _rayleigh),
    Case("gas of 1e-3 Pa to half an atmosphere", "smallest radius and energy by conservation", _energy),
    Case("pressure through a violent collapse", "finite; its integral is the flow's", _impulse),
    Case("bubbles that make no snap", "refused, with the reason", _gas_free),
    Case("bubbles of 1 um, 1 m and 1 km", "alike, times their size", _any_size),
)
