"""Straight rays whose ends move, compiled: when sound meets them, and where (`tracing.doppler` has the equations)."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints

ROUNDS = 2
"""Of solving for how much longer legs get while ends move: each leaves v/c v t/r of the error."""


@compiled
def elongation(length: float, along: Floats, dx: float, dy: float, dz: float) -> float:
    """How much longer in m a straight leg gets when its ends come apart by d, more than by what is along it.

    |r a + d| - r - a.d of a leg r m along a unit vector a (xyz); never negative, and without cancellation.
    """
    forward = along[0] * dx + along[1] * dy + along[2] * dz
    x, y, z = dx - forward * along[0], dy - forward * along[1], dz - forward * along[2]
    square = x * x + y * y + z * z
    forward += length
    return float(square / max(math.sqrt(forward * forward + square) + forward, 1e-300))


@compiled
def meet(
    length: Floats, arrival: Floats, gone: Floats, speed: Floats, velocity: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """When sound meets ends that move: s (ray,) after they are where rays lead, and directions of arrival (ray, xyz)
    and lengths (ray,) m then, and how far they have yet to go (ray, xyz) m to where rays lead. gone (ray,) s: by how
    much later than that it would be there were they at rest; speed (ray,) of sound there, velocity (ray, xyz) m/s of
    the ends."""
    late, (towards, left), far = np.empty(len(gone)), np.empty((2, len(gone), 3)), np.empty(len(gone))
    for i in range(len(gone)):
        a, v = arrival[i], velocity[i]
        per_metre = 1.0 / (speed[i] - (v[0] * a[0] + v[1] * a[1] + v[2] * a[2]))
        start = t = gone[i] * speed[i] * per_metre
        for _ in range(ROUNDS):
            t = start + elongation(length[i], a, v[0] * t, v[1] * t, v[2] * t) * per_metre
        x, y, z = length[i] * a[0] + v[0] * t, length[i] * a[1] + v[1] * t, length[i] * a[2] + v[2] * t
        late[i], far[i] = t, math.sqrt(x * x + y * y + z * z)
        one = 1.0 / far[i]
        towards[i, 0], towards[i, 1], towards[i, 2] = x * one, y * one, z * one
        left[i, 0], left[i, 1], left[i, 2] = -v[0] * t, -v[1] * t, -v[2] * t
    return late, towards, far, left


@compiled
def hear(
    length: Floats, arrival: Floats, gone: Floats, velocity: Floats, speed: float, bounces: Ints, point: Floats,
    departure: Floats, met: Floats, of_point: Floats, speed_there: Floats,
) -> tuple[Floats, Floats, Floats, Floats]:  # fmt: skip
    """When an array at a velocity (xyz) m/s hears rays from points (ray, xyz) m which, or images of which, have moved
    for `met` (ray,) s at velocities of_point (ray, xyz) m/s: s (ray,) after it is where rays lead, and directions of
    arrival (ray, xyz) and lengths (ray,) m then, and where the points are (ray, xyz) m. gone (ray,) s: as of `meet`,
    were the points where they were; departure (ray, xyz) there; speed: of sound at the array, speed_there (ray,)."""
    late, (towards, there), far = np.empty(len(gone)), np.empty((2, len(gone), 3)), np.empty(len(gone))
    ux, uy, uz = velocity[0], velocity[1], velocity[2]
    for i in range(len(gone)):
        a, d, v = arrival[i], departure[i], of_point[i]
        x, y, z = v[0] * met[i], v[1] * met[i], v[2] * met[i]
        nearer = (x * d[0] + y * d[1] + z * d[2]) / speed_there[i]
        there[i, 0], there[i, 1], there[i, 2] = point[i, 0] + x, point[i, 1] + y, point[i, 2] + z
        z = -z if bounces[i] % 2 == 1 else z
        per_metre = 1.0 / (speed - (a[0] * ux + a[1] * uy + a[2] * uz))
        start = t = (gone[i] - nearer) * speed * per_metre
        for _ in range(ROUNDS):
            t = start + elongation(length[i], a, ux * t - x, uy * t - y, uz * t - z) * per_metre
        x, y, z = length[i] * a[0] + (ux * t - x), length[i] * a[1] + (uy * t - y), length[i] * a[2] + (uz * t - z)
        late[i], far[i] = t, math.sqrt(x * x + y * y + z * z)
        one = 1.0 / far[i]
        towards[i, 0], towards[i, 1], towards[i, 2] = x * one, y * one, z * one
    return late, towards, far, there
