"""The collapse of a cavitation bubble from rest, solved once, evaluable at any time; `bubble_equations` says of what.

Steps of eighth order in the stretched clock: about 45 to a collapse and its rebound, 8 ms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble.bubble_equations import (
    Cavity,
    Numbers,
    ambient_pressure,
    force,
    hard_core,
    numbers,
    ratio,
    unrest,
)
from sonarsynth.equations.bubble.snap_pressure import Wall

if TYPE_CHECKING:
    from scipy.integrate import OdeSolution

__all__ = ["Cavity", "Collapse", "ambient_pressure", "collapse", "energy", "hard_core", "pressure", "wall"]

REASONS: Final = (
    "good",
    "the wall passes 0.3 times the speed of sound: the radiated peak is doubtful",
    "the wall passes 0.5 times the speed of sound: the theory does not hold at the collapse",
    "nothing stops the collapse: it ends at a point, with an infinite pressure and a finite spectrum",
    "the bubble settles without a collapse",
)
"""What `Collapse.flag` means."""
DOUBTFUL, BEYOND, SINGULAR, SETTLED = 1, 2, 3, 4

POINT: Final = -40.0
"""ln(R/R0) where a bubble that nothing stops has become a point: the flow R^2 R' left is 1e-8 of its largest."""

MOST_STEPS: Final = 20_000
"""Steps from turn to turn of the wall after which a bubble is given up (25 are usual)."""


class Turn(NamedTuple):
    """Where the wall stands still."""

    time: float  # s from the first collapse
    radius: float  # m


@dataclass(frozen=True, eq=False)
class Collapse:
    """A solved bubble. Times are from its first collapse: the first smallest radius, or the point of a singular one."""

    cavity: Cavity
    flag: int  # REASONS
    collapse_time: float  # s from rest to the first collapse; NaN for none
    mach: float  # largest wall speed over the speed of sound; infinite for a singular one
    smallest: tuple[Turn, ...]  # one for each collapse
    largest: tuple[Turn, ...]  # one for each rebound
    steps: Floats  # (step + 1,) s of the stretched clock
    clock: Floats  # (step + 1,) s from the first collapse
    state: OdeSolution  # of the stretched clock: (q, W, t/T from rest)
    evaluations: int  # of the equation, to solve it

    @property
    def reason(self) -> str:
        """The flag in words."""
        return REASONS[self.flag]

    @property
    def minimum_radius(self) -> float:
        """Smallest radius (m) of the first collapse; 0 for a point, NaN for none."""
        return self.smallest[0].radius if self.smallest else float("nan")


class Motion(NamedTuple):
    """A bubble at places of the stretched clock, each of their shape."""

    time: Floats  # s from the first collapse
    rate: Floats  # s: dt/ds
    wall: Wall
    pressure: Floats  # Pa at 1 m
    impulse: Floats  # Pa s, its integral up to there: rho R^2 R'


@lru_cache(maxsize=64)
def collapse(cavity: Cavity, rebounds: int = 0, tolerance: float = 1e-10) -> Collapse:
    """The bubble from rest through its first collapse to the top of its rebound, and through so many collapses more.

    `tolerance` is the solver's relative one: 1e-10 gives the smallest radius to 1e-9 and times to 1e-11 of the
    collapse. Raises ValueError for a cavity that cannot collapse or be followed; one that settles, or moves too fast
    for the theory, is flagged (`REASONS`). One that settles after a collapse ends there, with fewer turns.
    """
    from scipy.integrate import DOP853, OdeSolution  # half the time of all that SciPy loads

    n = numbers(cavity)

    def derivative(_: float, y: Floats) -> tuple[float, float, float]:
        x, F, swell = force(y[0], y[1], n)
        return y[1] * swell, F, x * x * np.sqrt(x)

    with np.errstate(all="ignore"):  # trial steps may overflow: they are refused
        rtol, atol = max(tolerance, 3e-14), 0.1 * tolerance
        solver = DOP853(derivative, 0.0, [0.0, 0.0, 0.0], 1e300, rtol=rtol, atol=atol)
        steps, pieces, turns = _march(solver, 2 * (rebounds + 1), n, 30.0 * tolerance)
        state = OdeSolution(steps, pieces)
        steps[-1] = turns[-1] if len(turns) == 2 * (rebounds + 1) else steps[-1]
        return _solved(cavity, n, np.array(steps), turns, state, int(solver.nfev))


def _march(solver: Any, wanted: int, n: Numbers, still: float) -> tuple[list[float], list[Any], list[float]]:
    """Step until the wall has turned so often, or is a point, or has settled: edges, interpolants, and s of the
    turns."""
    steps, pieces, last = [0.0], [], 0
    turns: list[float] = []
    while len(turns) < wanted and solver.y[0] > POINT:
        solver.step()
        if solver.status == "failed" or len(steps) - last > MOST_STEPS:
            raise ValueError(f"the bubble cannot be followed past R/R0 = {ratio(solver.y[0], n):.3g}")
        steps.append(solver.t)
        pieces.append(solver.dense_output())
        if unrest(solver.y[0], solver.y[1], n) <= still:
            break
        down = len(turns) % 2 == 0  # towards the next smallest radius
        if solver.y[1] > 0 if down else solver.y[1] < 0:
            turns.append(_root(pieces[-1], steps[-2], steps[-1]))
            last = len(steps)
    return steps, pieces, turns


def _root(piece: Any, low: float, high: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda s: float(piece(s)[1]), low, high, xtol=1e-15, rtol=1e-15))


def _solved(
    cavity: Cavity, n: Numbers, steps: Floats, turns: list[float], state: OdeSolution, evaluations: int
) -> Collapse:
    singular = state(steps[-1])[0] <= POINT
    at = np.append(turns, steps[-1]) if singular else np.array(turns)
    stood = [(n.time * float(tau), cavity.radius * float(ratio(q, n))) for q, _, tau in state(at).T] if at.size else []
    zero = stood[0][0] if stood else np.nan
    turned = [Turn(t - zero, R) for t, R in stood]
    if singular:
        turned[-1] = Turn(turned[-1].time, 0.0)
    fastest = np.inf if singular else _fastest(n, steps, state) * n.speed / cavity.sound_speed
    flag = SINGULAR if singular else int(fastest > 0.3) + int(fastest > 0.5) if turned else SETTLED
    return Collapse(
        cavity,
        flag,
        zero,
        fastest,
        tuple(turned[::2]),
        tuple(turned[1::2]),
        steps,
        n.time * state(steps)[2] - zero,
        state,
        evaluations,
    )


def _fastest(n: Numbers, steps: Floats, state: OdeSolution) -> float:
    """Largest |R'|/U, at 64 places of each step: within 1e-4."""
    q, W, _ = state(np.linspace(steps[:-1], steps[1:], 65).ravel())
    return float((np.abs(W) * ratio(q, n) ** -1.5).max())


def stretched(time: npt.ArrayLike, collapse: Collapse) -> Floats:
    """The stretched clock s at times (s from the first collapse), NaN outside of what was solved: Newton's method
    between bisections, for dt/ds > 0."""
    t = np.asarray(time, float)
    if collapse.flag == SETTLED:
        return np.full(t.shape, np.nan)
    inside = (t >= collapse.clock[0]) & (t <= collapse.clock[-1])
    n = numbers(collapse.cavity)
    goal = np.where(inside, t, collapse.clock[0]).ravel()
    piece = np.clip(np.searchsorted(collapse.clock, goal, side="right") - 1, 0, collapse.steps.size - 2)
    low, high = collapse.steps[piece], collapse.steps[piece + 1]
    start, width = collapse.clock[piece], np.diff(collapse.clock)[piece]
    width = np.maximum(width, np.finfo(float).tiny)  # steps near a point are shorter than time can tell
    s = low + (high - low) * (goal - start) / width
    for _ in range(60):
        q, _, tau = collapse.state(s)
        miss = (n.time * tau - collapse.collapse_time) - goal
        low, high = np.where(miss <= 0, s, low), np.where(miss >= 0, s, high)
        newton = s - miss / (n.time * ratio(q, n) ** 2.5)
        new = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        done = np.abs(new - s) <= 4e-16 * np.abs(s) + 1e-16
        s = new
        if done.all():
            break
    return np.where(inside, s.reshape(t.shape), np.nan)


def moving(s: npt.ArrayLike, collapse: Collapse) -> Motion:
    """The bubble at places s of the stretched clock; NaN where s is."""
    clock = np.asarray(s, float)
    solved = np.isfinite(clock)
    c, n = collapse.cavity, numbers(collapse.cavity)
    state = collapse.state(np.where(solved, clock, 0.0).ravel()).reshape(3, *clock.shape)
    q, W, tau = np.where(solved, state, np.nan)
    x, F, _ = force(q, W, n)
    return Motion(
        n.time * tau - collapse.collapse_time,
        n.time * x**2.5,
        Wall(c.radius * x, n.speed * W * x**-1.5, n.speed**2 / c.radius * (F - 1.5 * W * W) / x**4),
        n.drive * c.radius * (F + 0.5 * W * W) / x**2,
        c.density * c.radius**2 * n.speed * W * np.sqrt(x),
    )


def wall(time: npt.ArrayLike, collapse: Collapse) -> Wall:
    """Radius R and its derivatives R', R'' at times (s from the first collapse); NaN outside of what was solved."""
    return moving(stretched(time, collapse), collapse).wall


def pressure(time: npt.ArrayLike, collapse: Collapse) -> Floats:
    """Pressure (Pa) at 1 m: rho (R^2 R'' + 2 R R'^2) with R'' of the equation; NaN outside of what was solved."""
    return moving(stretched(time, collapse), collapse).pressure


def energy(time: npt.ArrayLike, collapse: Collapse) -> Floats:
    """Energy (J) of the water's flow, the drive, the surface and the gas: constant for Rayleigh-Plesset without
    viscosity."""
    from scipy.special import boxcox

    c, n = collapse.cavity, numbers(collapse.cavity)
    q, W, _ = collapse.state(stretched(time, collapse))
    R = c.radius * ratio(q, n)
    gas = c.gas_pressure * (c.radius**3 - c.core**3) * boxcox(np.exp(-3.0 * q), c.exponent - 1.0)
    flow = 1.5 * c.density * c.radius**3 * (n.speed * W) ** 2
    return np.asarray(4 * np.pi / 3 * (flow + n.drive * R**3 + 3.0 * c.surface_tension * R**2 + gas))
