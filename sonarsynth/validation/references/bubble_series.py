"""The bubble's equation as printed, in R and t, by its power series in arithmetic of many digits.

    D R'' = N,   D = (1 - R'/c) R + 4 mu/(rho c),
    N = (1 + R'/c) p/rho + R/(rho c) (dp/dt + 4 mu R''/R) - 3/2 (1 - R'/(3 c)) R'^2,
    p = p_v + p_g0 ((R0^3 - h^3)/(R^3 - h^3))^g - 2 s/R - 4 mu R'/R - p_inf

(Keller and Miksis 1980, eq. 3.7; 1/c = 0 is Rayleigh-Plesset.) A step takes the coefficients of R one after the other
from those of the products, quotients and powers that make it up (Moore 1966, Interval Analysis, chapter 11), and is as
long as the last of them allow. It shares nothing with the solvers: no stretched clock, no logarithm, no float64.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.bubble.bubble_collapse import Cavity

DIGITS, ORDER = 20, 24
GUARD = 5
"""Digits that are carried beyond those that count."""
NODES, PANEL = 20, 1e-6
"""Gauss-Legendre nodes of a panel, and its greatest length (s): good for waves up to 1 MHz and more."""


@dataclass(frozen=True, eq=False)
class ExactCollapse:
    """A bubble from rest to the top of its rebound. Times are from rest."""

    times: tuple[float, ...]  # s, where the wall stands still: smallest, largest
    radii: tuple[float, ...]  # m
    pressures: tuple[float, ...]  # Pa at 1 m
    node: Floats  # (node,) s, of a quadrature from rest to the end
    pressure: Floats  # (node,) Pa at 1 m
    weight: Floats  # (node,) s
    fastest: float  # m/s, the largest wall speed at a node
    steps: int


def exact_bubble(cavity: Cavity) -> ExactCollapse:
    """A bubble to 1e-17 through its collapse and rebound. Raises ModuleNotFoundError without mpmath."""
    import mpmath as mp

    with mp.workdps(DIGITS + GUARD):
        numbers = Cavity(*(mp.mpf(float(v)) for v in cavity))
        slowness = 1 / numbers.sound_speed if cavity.compressible else mp.mpf(0)
        R, v, t = numbers.radius, mp.mpf(0), mp.mpf(0)
        turns: list[tuple[Any, Any, Any]] = []
        pieces: list[tuple[Any, Any, list[Any]]] = []
        while len(turns) < 2:
            series = _series(R, v, numbers, slowness)
            speed = _slope(series)
            lasts = [k for k in (ORDER, ORDER + 1) if series[k]]  # every other one is 0 from rest without losses
            h = min((mp.mpf(10) ** -DIGITS * R / abs(series[k])) ** (mp.mpf(1) / k) for k in lasts)
            after = _at(speed, h)
            turned = after < 0 if turns else after > 0
            x = _turn(speed, h * v / (v - after)) if turned else h
            pieces.append((t, x if turns and turned else h, series))
            if turned:
                R_turn, bend = _at(series, x), _at(_slope(speed), x)
                turns.append((t + x, R_turn, numbers.density * R_turn**2 * bend))
            R, v, t = _at(series, h), after, t + h
    return _as_floats(turns, pieces, cavity.density)


def _at(series: list[Any], h: Any) -> Any:
    value = series[-1]
    for term in series[-2::-1]:
        value = value * h + term
    return value


def _slope(series: list[Any]) -> list[Any]:
    return [k * series[k] for k in range(1, len(series))]


def _turn(speed: list[Any], x: Any) -> Any:
    """Time within a step at which the wall stands still: Newton's method."""
    import mpmath as mp

    bend = _slope(speed)
    for _ in range(50):
        change = _at(speed, x) / _at(bend, x)
        x -= change
        if abs(change) <= mp.mpf(10) ** -DIGITS * abs(x):
            break
    return x


def _series(R: Any, v: Any, c: Cavity, slowness: Any) -> list[Any]:
    """Coefficients (order + 2,) of R(t + h) in powers of h."""
    series = _Parts(R, v, c, slowness)
    for k in range(ORDER):
        series.swell(k + 1)
        series.r.append(series.bending(k) / ((k + 1) * (k + 2)))
    return series.r


class _Parts:
    """Coefficients, as far as they are known, of R and of all that the equation is made up of."""

    def __init__(self, R: Any, v: Any, c: Cavity, slowness: Any) -> None:
        self.c, self.slowness = c, slowness
        volume = R**3 - c.core**3
        self.r = [R, v]
        self.square, self.volume, self.inverse = [R * R], [volume], [1 / R]  # R^2, R^3 - h^3, 1/R
        self.gas = [c.gas_pressure * ((c.radius**3 - c.core**3) / volume) ** c.exponent]
        self.slope: list[Any] = []  # the terms of R^3 - h^3 after the first, times their powers
        self.speed: list[Any] = []  # R'
        self.relative: list[Any] = []  # R'/R
        self.energy: list[Any] = []  # R'^2
        self.push: list[Any] = []  # p
        self.rate: list[Any] = []  # dp/dt + 4 mu R''/R
        self.D: list[Any] = []
        self.bend: list[Any] = []  # R''

    def swell(self, j: int) -> None:
        """The coefficients j of what depends on R alone; Miller's recurrence for the power of the gas."""
        import mpmath as mp

        r, g, volume = self.r, self.c.exponent, self.volume[0]
        self.square.append(_product(r, r, j))
        self.volume.append(_product(self.square, r, j))
        self.inverse.append(-mp.fdot(r[1 : j + 1], self.inverse[j - 1 :: -1]) / r[0])
        self.slope.append(j * self.volume[j])
        before = self.gas[j - 1 :: -1]
        terms = (1 - g) * mp.fdot(self.slope, before) - j * mp.fdot(self.volume[1:], before)
        self.gas.append(terms / (j * volume))

    def bending(self, k: int) -> Any:
        """The coefficient k of R''."""
        import mpmath as mp

        c, s, j = self.c, self.slowness, k + 1
        tension, friction = 2 * c.surface_tension, 4 * c.viscosity
        self.speed.append(j * self.r[j])
        self.relative.append(_product(self.speed, self.inverse, k))
        self.energy.append(_product(self.speed, self.speed, k))
        static_pressure = c.vapour_pressure - c.ambient_pressure if k == 0 else 0
        self.push.append(self.gas[k] - tension * self.inverse[k] - friction * self.relative[k] + static_pressure)
        losing = friction * _product(self.relative, self.relative, k)
        self.rate.append(j * (self.gas[j] - tension * self.inverse[j]) + losing)
        sound = _product(self.speed, self.push, k) + _product(self.r, self.rate, k)
        inertia = (3 * self.energy[k] - s * _product(self.speed, self.energy, k)) / 2
        N = (self.push[k] + s * sound) / c.density - inertia
        self.D.append(self.r[k] - s * _product(self.speed, self.r, k) + (friction * s / c.density if k == 0 else 0))
        self.bend.append((N - (mp.fdot(self.D[1:], self.bend[::-1]) if k else 0)) / self.D[0])
        return self.bend[k]


def _product(a: list[Any], b: list[Any], k: int) -> Any:
    """The coefficient k of a product."""
    import mpmath as mp

    return mp.fdot(a[: k + 1], b[k::-1])


def _as_floats(
    turns: list[tuple[Any, Any, Any]], pieces: list[tuple[Any, Any, list[Any]]], density: float
) -> ExactCollapse:
    """Turns and a quadrature in float64: pressures from the series of each step."""
    node, weight = np.polynomial.legendre.leggauss(NODES)
    times, pressures, weights = [], [], []
    fastest = 0.0
    for start, length, series in pieces:
        h = float(length)
        scaled = np.array([float(term * length**k) for k, term in enumerate(series)])
        panels = int(np.ceil(h / PANEL))
        x = ((np.arange(panels)[:, None] + 0.5 + 0.5 * node) / panels).ravel()  # parts of the step
        R, R1, R2 = (np.polynomial.Polynomial(scaled).deriv(m)(x) / h**m for m in range(3))
        times.append(float(start) + h * x)
        pressures.append(density * R * (R * R2 + 2.0 * R1 * R1))
        weights.append(np.tile(0.5 * weight * h / panels, panels))
        fastest = max(fastest, float(np.abs(R1).max()))
    times_of, radii, pressures_of = (tuple(map(float, column)) for column in zip(*turns, strict=True))
    node_of, pressure, weight_of = (np.concatenate(blocks) for blocks in (times, pressures, weights))
    return ExactCollapse(times_of, radii, pressures_of, node_of, pressure, weight_of, fastest, len(pieces))
