"""The bubble's equation without the stretched clock, by the same solvers: what the transform is measured against.

`plain` has the unknowns R, R' and `logarithm` ln R, R', both over the time; the right side is the equation as printed.
"""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble.bubble_collapse import METHODS, MOST_STEPS, Cavity, Method

Form = Literal["plain", "logarithm"]


class Run(NamedTuple):
    """What a solver found: NaN where it failed."""

    time: float  # s from rest to the smallest radius
    radius: float  # m, the smallest
    rebound: float  # m, the largest after it
    evaluations: int  # of the right side


def acceleration(R: float, v: float, c: Cavity) -> float:
    """R'' (m/s2) of Keller-Miksis, or Rayleigh-Plesset without compression, without a hard core."""
    slowness = 1.0 / c.sound_speed if c.compressible else 0.0
    inside = c.gas_pressure * (c.radius / R) ** (3.0 * c.exponent)
    tension, friction = 2.0 * c.surface_tension / R, 4.0 * c.viscosity * v / R
    p = c.vapour_pressure + inside - tension - friction - c.ambient_pressure
    rate = (-3.0 * c.exponent * inside + tension + friction) * v / R
    push = ((1.0 + v * slowness) * p + R * slowness * rate) / c.density - 1.5 * (1.0 - v * slowness / 3.0) * v * v
    return float(push / ((1.0 - v * slowness) * R + 4.0 * c.viscosity * slowness / c.density))


def solve(cavity: Cavity, form: Form, method: Method, rtol: float) -> Run:
    """A bubble from rest through its collapse to the top of its rebound; absolute tolerances are scaled to each unknown
    as Dahlquist's test asks: 1e-3 of the largest radius, and the speed U of the driving pressure, times rtol."""
    R0, U = cavity.radius, np.sqrt((cavity.ambient_pressure - cavity.vapour_pressure) / cavity.density)
    logarithm = form == "logarithm"

    def derivative(_: float, y: Floats) -> tuple[float, float]:
        R, v = float(np.exp(y[0]) if logarithm else y[0]), float(y[1])
        try:
            return v / R if logarithm else v, acceleration(max(R, 0.0), v, cavity)
        except ArithmeticError:  # a trial step too far, or through the origin: it is refused
            return np.nan, np.nan

    start = [np.log(R0) if logarithm else R0, 0.0]
    atol = [rtol if logarithm else 1e-3 * R0 * rtol, U * rtol]
    with np.errstate(all="ignore"):  # trial steps may overflow
        solver = METHODS[method](derivative, 0.0, start, 1.0, rtol=max(rtol, 3e-14), atol=atol)
        turns = _turns(solver)
    (time, low), (_, high) = turns if len(turns) == 2 else ((np.nan, np.nan), (np.nan, np.nan))
    radii = np.exp([low, high]) if logarithm else (low, high)
    return Run(time, float(radii[0]), float(radii[1]), int(solver.nfev))


def _turns(solver: Any) -> list[tuple[float, float]]:
    """Time and first unknown where the wall stands still, twice; fewer where the solver fails."""
    turns: list[tuple[float, float]] = []
    for _ in range(100 * MOST_STEPS):
        solver.step()
        if solver.status != "running" or not np.isfinite(solver.y).all():
            break
        piece = solver.dense_output()
        if solver.y[1] > 0 if len(turns) == 0 else solver.y[1] < 0:
            at = float(brentq(lambda t, p=piece: float(p(t)[1]), solver.t_old, solver.t, xtol=1e-20, rtol=1e-15))
            turns.append((at, float(piece(at)[0])))
            if len(turns) == 2:
                break
    return turns
