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
from sonarsynth.equations.bubble.bubble_equations import Cavity, force, numbers

if TYPE_CHECKING:
    from scipy.integrate import OdeSolution

MOST_STEPS: Final = 20_000
"""Steps after which a bubble is given up (50 are usual to the top of its rebound)."""


class Turn(NamedTuple):
    """Where the wall stands still."""

    time: float  # s from the first collapse
    radius: float  # m


@dataclass(frozen=True, eq=False)
class Collapse:
    """A solved bubble. Times are from its first collapse, the first smallest radius."""

    cavity: Cavity
    collapse_time: float  # s from rest to the first collapse
    mach: float  # largest wall speed over the speed of sound
    smallest: tuple[Turn, ...]  # one for each collapse
    largest: tuple[Turn, ...]  # one for each rebound
    steps: Floats  # (step + 1,) s of the stretched clock
    clock: Floats  # (step + 1,) s from the first collapse
    state: OdeSolution  # of the stretched clock: (q, W, t/T from rest)
    evaluations: int  # of the equation, to solve it


class Motion(NamedTuple):
    """A bubble at places of the stretched clock, each of their shape."""

    time: Floats  # s from the first collapse
    rate: Floats  # s: dt/ds
    radius: Floats  # m
    pressure: Floats  # Pa at 1 m
    impulse: Floats  # Pa s, its integral up to there: rho R^2 R'


@lru_cache(maxsize=64)
def collapse(cavity: Cavity, rebounds: int = 0, tolerance: float = 1e-10) -> Collapse:
    """The bubble from rest through its first collapse to the top of its rebound, and through so many collapses more.

    `tolerance` is the solver's relative one: 1e-10 gives the smallest radius to 1e-9 and times to 1e-11 of the
    collapse. Raises ValueError for a cavity that cannot collapse or be followed.
    """
    from scipy.integrate import DOP853, OdeSolution  # half the time of all that SciPy loads

    n = numbers(cavity)

    def derivative(_: float, y: Floats) -> tuple[float, float, float]:
        x, F = force(y[0], y[1], n)
        return y[1], F, x * x * np.sqrt(x)

    with np.errstate(all="ignore"):  # trial steps may overflow: they are refused
        rtol, atol = max(tolerance, 3e-14), 0.1 * tolerance
        solver = DOP853(derivative, 0.0, [0.0, 0.0, 0.0], 1e300, rtol=rtol, atol=atol)
        steps, pieces, turns = _march(solver, 2 * (rebounds + 1))
    state = OdeSolution(steps, pieces)
    steps[-1] = turns[-1]
    q, _, tau = state(turns)
    zero, clock = n.time * float(tau[0]), n.time * state(steps)[2]
    stood = tuple(Turn(n.time * float(t) - zero, cavity.radius * float(np.exp(y))) for t, y in zip(tau, q, strict=True))
    mach = _fastest(np.array(steps), state) * n.speed / cavity.sound_speed
    edges, evaluations = np.array(steps), int(solver.nfev)
    return Collapse(cavity, zero, mach, stood[::2], stood[1::2], edges, clock - zero, state, evaluations)


def _march(solver: Any, wanted: int) -> tuple[list[float], list[Any], list[float]]:
    """Step until the wall has turned so often: edges, interpolants, and s of the turns."""
    steps, pieces, turns = [0.0], list[Any](), list[float]()
    while len(turns) < wanted:
        solver.step()
        if solver.status == "failed" or len(pieces) > MOST_STEPS:
            raise ValueError(f"the bubble cannot be followed past R/R0 = {np.exp(solver.y[0]):.3g}")
        steps.append(solver.t)
        pieces.append(solver.dense_output())
        if solver.y[1] < 0 if len(turns) % 2 else solver.y[1] > 0:
            turns.append(_root(pieces[-1], steps[-2], steps[-1]))
    return steps, pieces, turns


def _root(piece: Any, low: float, high: float) -> float:
    from scipy.optimize import brentq

    return float(brentq(lambda s: float(piece(s)[1]), low, high, xtol=1e-15, rtol=1e-15))


def _fastest(steps: Floats, state: OdeSolution) -> float:
    """Largest |R'|/U, at 64 places of each step: within 1e-4."""
    q, W, _ = state(np.linspace(steps[:-1], steps[1:], 65).ravel())
    return float((np.abs(W) * np.exp(-1.5 * q)).max())


def stretched(time: npt.ArrayLike, collapse: Collapse) -> Floats:
    """The stretched clock s at times (s from the first collapse) within what was solved.

    By Newton's method between bisections, for dt/ds > 0."""
    t = np.asarray(time, float)
    goal, n = t.ravel(), numbers(collapse.cavity)
    piece = np.clip(np.searchsorted(collapse.clock, goal, side="right") - 1, 0, collapse.steps.size - 2)
    low, high = collapse.steps[piece], collapse.steps[piece + 1]
    start, width = collapse.clock[piece], np.diff(collapse.clock)[piece]
    s = low + (high - low) * (goal - start) / width
    for _ in range(60):
        q, _, tau = collapse.state(s)
        miss = (n.time * tau - collapse.collapse_time) - goal
        low, high = np.where(miss <= 0, s, low), np.where(miss >= 0, s, high)
        newton = s - miss / (n.time * np.exp(2.5 * q))
        new = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        done = np.abs(new - s) <= 4e-16 * np.abs(s) + 1e-16
        s = new
        if done.all():
            break
    return np.asarray(s.reshape(t.shape))


def moving(s: npt.ArrayLike, collapse: Collapse) -> Motion:
    """The bubble at places s of the stretched clock; its pressure is rho (R^2 R'' + 2 R R'^2), R'' of the equation."""
    clock = np.asarray(s, float)
    c, n = collapse.cavity, numbers(collapse.cavity)
    q, W, tau = collapse.state(clock.ravel()).reshape(3, *clock.shape)
    x, F = force(q, W, n)
    return Motion(
        n.time * tau - collapse.collapse_time,
        n.time * x**2.5,
        c.radius * x,
        n.drive * c.radius * (F + 0.5 * W * W) / x**2,
        c.density * c.radius**2 * n.speed * W * np.sqrt(x),
    )
