"""The bubble's equation as printed, in R and t, integrated.

    D R'' = N,   D = (1 - R'/c) R + 4 mu/(rho c),
    N = (1 + R'/c) p/rho + R/(rho c) (dp/dt + 4 mu R''/R) - 3/2 (1 - R'/(3 c)) R'^2,
    p = p_v + p_g0 ((R0^3 - h^3)/(R^3 - h^3))^g - 2 s/R - 4 mu R'/R - p_inf

(Keller and Miksis 1980, eq. 3.7; 1/c = 0 is Rayleigh-Plesset.) It shares nothing with the solver but SciPy's
integrator: no stretched clock and no logarithm, in which R may become 0. Here R and R' change by powers of ten within
nanoseconds, and steps are so short that this does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble.bubble_collapse import Cavity

TOLERANCE = 3e-14
"""Relative, of a step."""
NODES, PANEL = 20, 1e-6
"""Gauss-Legendre nodes of a panel, and its greatest length (s): good for waves up to 1 MHz and more."""


@dataclass(frozen=True, eq=False)
class PrintedBubble:
    """A bubble from rest to the top of its rebound. Times are from rest."""

    times: tuple[float, float]  # s, where the wall stands still: smallest, largest
    radii: tuple[float, float]  # m
    pressures: tuple[float, float]  # Pa at 1 m
    node: Floats  # (node,) s, of a quadrature from rest to the end
    pressure: Floats  # (node,) Pa at 1 m
    weight: Floats  # (node,) s


def wall_acceleration(R: Floats, v: Floats, c: Cavity) -> Floats:
    """R'' (...) in m/s2 of a wall at radii R (...) in m with speeds v (...) in m/s."""
    slowness = 1.0 / c.sound_speed if c.compressible else 0.0
    volume = R**3 - c.core**3
    gas = c.gas_pressure * ((c.radius**3 - c.core**3) / volume) ** c.exponent
    p = c.vapour_pressure + gas - 2.0 * c.surface_tension / R - 4.0 * c.viscosity * v / R - c.ambient_pressure
    rate = -3.0 * c.exponent * R**2 * v * gas / volume + (2.0 * c.surface_tension * v + 4.0 * c.viscosity * v**2) / R**2
    N = ((1.0 + slowness * v) * p + slowness * R * rate) / c.density - 1.5 * (1.0 - slowness * v / 3.0) * v**2
    return np.asarray(N / ((1.0 - slowness * v) * R + 4.0 * c.viscosity * slowness / c.density))


def printed_bubble(cavity: Cavity) -> PrintedBubble:
    """A bubble through its collapse and rebound, good to 1e-10 of the smallest radius."""
    from scipy.integrate import solve_ivp

    def slopes(_: float, state: Floats) -> tuple[float, float]:
        return state[1], float(wall_acceleration(state[0], state[1], cavity))

    def speed(_: float, state: Floats) -> float:
        return float(state[1])

    speed.terminal = True  # type: ignore[attr-defined]
    t, R, turns, pieces = 0.0, cavity.radius, [], []
    for speed.direction in (1.0, -1.0):  # type: ignore[attr-defined]
        way = solve_ivp(
            slopes, (t, 1.0), (R, 0.0), "DOP853", rtol=TOLERANCE, atol=1e-18, events=speed, dense_output=True
        )
        t, R = float(way.t[-1]), float(way.y[0, -1])
        turns.append((t, R, float(cavity.density * R**2 * wall_acceleration(np.array(R), np.array(0.0), cavity))))
        pieces.append(_quadrature(way.t, way.sol, cavity))
    first, last = turns
    times, radii, pressures = zip(first, last, strict=True)
    node, pressure, weight = (np.concatenate(column) for column in zip(*pieces, strict=True))
    return PrintedBubble(times, radii, pressures, node, pressure, weight)


def _quadrature(steps: Floats, state: object, cavity: Cavity) -> tuple[Floats, Floats, Floats]:
    """Nodes (node,) in s, pressures there in Pa at 1 m, and weights in s, over all steps of a solution."""
    assert callable(state)
    x, w = np.polynomial.legendre.leggauss(NODES)
    panels = np.maximum(np.ceil(np.diff(steps) / PANEL), 1).astype(int)
    edges = np.concatenate(
        [*(np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(steps, steps[1:], panels, strict=False)), steps[-1:]]
    )
    half, middle = 0.5 * np.diff(edges)[:, None], 0.5 * (edges[1:] + edges[:-1])[:, None]
    node = (middle + half * x).ravel()
    R, v = state(node)
    pressure = cavity.density * R * (R * wall_acceleration(R, v, cavity) + 2.0 * v**2)
    return node, pressure, (half * w).ravel()
