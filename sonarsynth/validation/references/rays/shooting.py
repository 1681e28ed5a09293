"""Rays in a smooth sound speed by shooting: the ray equations integrated by DOP853, a fan of launch angles, Newton.

Over the horizontal distance x, with the grazing angle t down positive and c = c(z):
    dz/dx = tan t,  dt/dx = -c'/c,  dT/dx = 1/(c cos t)
(e.g. Jensen, Kuperman, Porter and Schmidt 2011, Computational Ocean Acoustics, section 3.2) and, for their change with
the launch angle a,
    d(dz/da)/dx = (dt/da)/cos^2 t,  d(dt/da)/dx = -(c''/c - (c'/c)^2) dz/da.
Only rays that meet neither surface nor bottom are followed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.validation.rays.ray_matching import Rays

TOLERANCE = 1e-13  # of the integration
COARSE = 1e-8  # of the fan
ROUNDS = 8  # of Newton's iteration


@dataclass(frozen=True, eq=False)
class Smooth:
    """A smooth sound speed: speed (m/s), its first and second derivative at depths (m), and the bottom (m)."""

    name: str
    bottom_depth: float
    speed: Callable[[Floats], Floats]
    first: Callable[[Floats], Floats]
    second: Callable[[Floats], Floats]


def munk(name: str = "Munk", bottom_depth: float = 5000.0, axis: float = 1300.0, scale: float = 650.0) -> Smooth:
    """The canonical profile of Munk (1974), c = 1500 (1 + 0.00737 (e^-n + n - 1)) m/s with n = (z - axis)/scale."""
    low, perturbation = 1500.0, 0.00737

    def reduced(z: Floats) -> Floats:
        return np.asarray((z - axis) / scale)

    return Smooth(
        name,
        bottom_depth,
        lambda z: low * (1.0 + perturbation * (np.exp(-reduced(z)) + reduced(z) - 1.0)),
        lambda z: low * perturbation / scale * (1.0 - np.exp(-reduced(z))),
        lambda z: low * perturbation / scale**2 * np.exp(-reduced(z)),
    )


@dataclass(frozen=True, eq=False)
class Flight:
    """Rays of a fan where they have covered the distance; NaN where they met a boundary."""

    depth: Floats  # (ray,) m
    angle: Floats  # (ray,) rad, down positive
    time: Floats  # (ray,) s
    stretch: Floats  # (ray,) m/rad: dz/da
    turning: Floats  # (ray,) turning points


def fly(water: Smooth, start: float, launch: Floats, distance: float, tolerance: float) -> Flight:
    """Follow rays from a depth (m) at launch angles (ray,) rad, down positive, over a horizontal distance (m)."""
    from scipy.integrate import solve_ivp

    count = len(launch)

    def slopes(x: float, state: Floats) -> Floats:
        z, t, _, stretch, turn = state.reshape(5, count)
        z = np.clip(z, -0.1 * water.bottom_depth, 1.1 * water.bottom_depth)
        t = np.clip(t, -1.5, 1.5)
        c, bend = water.speed(z), water.first(z)
        relative, cosine = bend / c, np.cos(t)
        focus = -(water.second(z) / c - relative**2) * stretch
        return np.concatenate([np.tan(t), -relative, 1.0 / (c * cosine), turn / cosine**2, focus])

    first = np.concatenate([np.full(count, start), launch, np.zeros(2 * count), np.ones(count)])
    scale = np.repeat([1.0, 1e-2, distance / 1500.0, distance, 1.0], count)
    solution = solve_ivp(slopes, (0.0, distance), first, method="DOP853", rtol=tolerance, atol=tolerance * scale)
    z, t, time, stretch, _ = solution.y.reshape(5, count, -1)
    lost = (z <= 0.0).any(axis=1) | (z >= water.bottom_depth).any(axis=1)
    turning = np.sum(np.signbit(t[:, 1:]) != np.signbit(t[:, :-1]), axis=1)
    ends = (z[:, -1], t[:, -1], time[:, -1], stretch[:, -1], turning)
    return Flight(*(np.where(lost, np.nan, value) for value in ends))


def shooting_rays(
    water: Smooth, start: float, ends: Floats, distance: float, vertices: int, rays: int = 1500, steepest: float = 0.35
) -> Rays:
    """Every ray without reflections and with up to `vertices` turning points from a depth to depths (pair,) m.

    A fan of `rays` launch angles within `steepest` (rad) brackets them by the signs of its misses.
    """
    launch = np.linspace(-steepest, steepest, rays)
    fan = fly(water, start, launch, distance, COARSE)
    pairs, roots = [], []
    for i, end in enumerate(ends):
        miss = fan.depth - end
        with np.errstate(invalid="ignore"):
            crossed = np.flatnonzero(miss[1:] * miss[:-1] < 0)
        fraction = miss[crossed] / (miss[crossed] - miss[crossed + 1])
        roots.append(launch[crossed] + fraction * (launch[crossed + 1] - launch[crossed]))
        pairs.append(np.full(len(crossed), i))
    pair, angle = np.concatenate(pairs), np.concatenate(roots)
    flight = fly(water, start, angle, distance, TOLERANCE)
    for _ in range(ROUNDS):
        step = (flight.depth - ends[pair]) / flight.stretch
        angle = angle - np.clip(np.nan_to_num(step), launch[0] - launch[1], launch[1] - launch[0])
        flight = fly(water, start, angle, distance, TOLERANCE)
        if np.nanmax(np.abs(flight.depth - ends[pair]), initial=0.0) < 1e-8:
            break
    return _rays(water, pair, start, angle, flight, distance, vertices)


def _rays(
    water: Smooth, pair: np.ndarray, start: float, angle: Floats, flight: Flight, distance: float, vertices: int
) -> Rays:
    c_start, c_end = water.speed(np.asarray(start)), water.speed(flight.depth)
    tube = distance * np.abs(flight.stretch) * np.cos(flight.angle)
    amplitude = np.sqrt(c_end / c_start * np.cos(angle) / tube)
    keep: Bools = np.isfinite(flight.time) & (flight.turning <= vertices)
    none = np.zeros(int(keep.sum()), int)
    return Rays(
        pair[keep],
        flight.time[keep],
        -angle[keep],
        -flight.angle[keep],
        amplitude[keep],
        none,
        none,
        flight.turning[keep].astype(int),
    )
