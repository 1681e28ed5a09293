"""Bubbles near collapse and without gas, against Rayleigh's closed form, energy, and the reasons of refusals."""

from __future__ import annotations

import numpy as np

from sonarsynth.equations.bubble import bubble_collapse
from sonarsynth.sources.snap_models import KellerMiksis
from sonarsynth.validation.bubbles.bubble_checks import RADIUS
from sonarsynth.validation.bubbles.bubbles_conserved import COLLAPSE, EMPTY, UNIT, drift, left, smallest
from sonarsynth.validation.extremes.outcomes import Case, CaseResult, holds, off, refused, together


def _rayleigh() -> CaseResult:
    """To the last billionth of the time: the radius over R0 is that of the incomplete beta function."""
    found = bubble_collapse.collapse(EMPTY, 0, 1e-13)
    before = np.geomspace(1e-9, 0.9, 30)
    exact = left(before)
    got = bubble_collapse.wall(-before * UNIT, found).radius / RADIUS
    return together(
        off(found.collapse_time / UNIT / COLLAPSE - 1.0, 1e-12, what="time of collapse"),
        off((got / exact - 1.0)[before > 1e-5], 1e-7, what="radius"),
        off((got / exact - 1.0), 1e-4, what="radius to 1e-9 before"),
        holds(found.flag == bubble_collapse.SINGULAR and found.mach == np.inf, found.reason),
    )


def _energy() -> CaseResult:
    """Without friction and tension the work of the drive is in the gas where the wall turns."""
    parts = []
    for gas in (1e-3, 1.0, 1e3, 1e4, 5e4):
        cavity = EMPTY._replace(gas_pressure=gas, exponent=1.4)
        found = bubble_collapse.collapse(cavity, 1, 1e-11)
        least = smallest(cavity)
        parts.append(off(found.minimum_radius / RADIUS / least - 1.0, 1e-8, what=f"{gas:g} Pa: smallest radius"))
        parts.append(off(drift(found), 1e-7, what="energy"))
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
