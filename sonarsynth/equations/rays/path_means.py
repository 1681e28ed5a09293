"""Means over the depths that a ray passes, of what depends on depth alone: absorption."""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Ints

_X, _W = np.polynomial.legendre.leggauss(24)
NODE, WEIGHT = 0.5 - 0.5 * np.cos(0.5 * np.pi * (1.0 + _X)), 0.25 * np.pi * _W * np.sin(0.5 * np.pi * (1.0 + _X))
"""Where of a leg (0 to 1) a bent ray is looked at, closest at its ends, where it may turn; and the weights of depth."""
LEVEL = 1e-4
"""m: a straight leg over less depth has the value at its middle."""
LEAST_SINE = 1e-6
"""rad: of a ray that turns."""


@compiled(borrows=True)
def at(x: float, xs: Floats, ys: Floats) -> float:
    """Linear interpolation, constant beyond the ends."""
    n = len(xs)
    if x <= xs[0]:
        return float(ys[0])
    if x >= xs[n - 1]:
        return float(ys[n - 1])
    i = min(1 + int((x - xs[0]) / (xs[n - 1] - xs[0]) * (n - 1)), n - 1)
    if not xs[i - 1] < x <= xs[i]:  # the places are not even
        i = int(np.searchsorted(xs, x))
    return float(ys[i - 1] + (ys[i] - ys[i - 1]) * (x - xs[i - 1]) / (xs[i] - xs[i - 1]))


@compiled(borrows=True)
def up_to(x: float, table: tuple[Floats, Floats, Floats]) -> float:
    """Integral of a value over depth from the surface to x (m), by its integral up to each of the even nodes."""
    xs, ys, sums = table
    i = min(max(int((x - xs[0]) / (xs[-1] - xs[0]) * (len(xs) - 1)), 0), len(xs) - 2)
    d = x - xs[i]
    return float(sums[i] + d * (ys[i] + 0.5 * d * (ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i])))


@compiled(borrows=True)
def vertex(z: float, down: bool, fastest: float, bottom: float, depth: Floats, speed: Floats) -> float:
    """Depth (m) at which a ray that goes down, or up, from z meets its turning speed (m/s), or the boundary."""
    last_z, last_c = z, at(z, depth, speed)
    step = 1 if down else -1
    i = np.searchsorted(depth, z, side="right") if down else np.searchsorted(depth, z) - 1
    while 0 <= i < len(depth) and 0.0 < depth[i] < bottom:
        if speed[i] >= fastest:
            share = (fastest - last_c) / (speed[i] - last_c) if speed[i] > last_c else 0.0
            return float(last_z + min(max(share, 0.0), 1.0) * (depth[i] - last_z))
        last_z, last_c = depth[i], speed[i]
        i += step
    edge = bottom if down else 0.0
    c = at(edge, depth, speed)
    if c >= fastest and c > last_c:
        return float(last_z + min(max((fastest - last_c) / (c - last_c), 0.0), 1.0) * (edge - last_z))
    return edge


@compiled(borrows=True)
def leg(
    a: float, b: float, p: float, bent: bool, water: tuple[Floats, Floats], table: tuple[Floats, Floats, Floats]
) -> tuple[float, float]:
    """A monotone leg between two depths: its length, or depth where it is straight, and the value along it."""
    if not bent:
        deep = abs(b - a)
        within = deep * at(0.5 * (a + b), table[0], table[1])
        return deep, within if deep < LEVEL else abs(up_to(b, table) - up_to(a, table))
    total = along = 0.0
    for n in range(len(NODE)):
        z = a + (b - a) * NODE[n]
        c = at(z, water[0], water[1])
        length = abs(b - a) * WEIGHT[n] / max(np.sqrt(max(1.0 - (p * c) ** 2, 0.0)), LEAST_SINE)
        total += length
        along += length * at(z, table[0], table[1])
    return total, along


@compiled(borrows=True)
def means(start: Floats, end: Floats, climb: Floats, vertices: Ints, bent: Bools, bottom: float,
          water: tuple[Floats, Floats], table: tuple[Floats, Floats, Floats], out: Floats) -> None:  # fmt: skip
    """Mean (ray,) along rays from depths start to end (ray,) m of a value of depth.

    climb (ray,): upward component of the unit vector in which each leaves; vertices (ray,): how many times it turns or
    is reflected; bent (ray,): whether it follows Snell's law in water, depth and sound speed (node,), or is straight;
    bottom (m); table: even depths, values there and their integrals from the surface (node,). A ray with vertices goes
    to and fro between two depths.
    """
    for r in range(len(start)):
        z, z_end, n = start[r], end[r], vertices[r]
        p = np.sqrt(max(1.0 - climb[r] ** 2, 0.0)) / at(z, water[0], water[1]) if bent[r] else 0.0
        if n == 0:
            length, along = leg(z, z_end, p, bent[r], water, table)
        else:
            fastest = 1.0 / max(p, 1e-300) if bent[r] else np.inf
            upper = vertex(z, False, fastest, bottom, water[0], water[1])
            lower = vertex(z, True, fastest, bottom, water[0], water[1])
            first_down = climb[r] < 0.0
            last_down = first_down == (n % 2 == 1)
            first = leg(z, lower if first_down else upper, p, bent[r], water, table)
            between = leg(upper, lower, p, bent[r], water, table)
            last = leg(lower if last_down else upper, z_end, p, bent[r], water, table)
            length = first[0] + (n - 1) * between[0] + last[0]
            along = first[1] + (n - 1) * between[1] + last[1]
        out[r] = along / length if length > 0.0 else at(z, table[0], table[1])
