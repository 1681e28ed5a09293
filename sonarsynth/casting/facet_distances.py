"""Squared distances of a point from boxes and triangles, compiled."""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats


@compiled(borrows=True)
def to_box(point: Floats, node: Floats) -> float:
    """Square of the distance to a box; infinite to an empty one."""
    square = 0.0
    for x in range(3):
        if node[3 + x] < 0.0:
            return np.inf
        square += max(abs(point[x] - node[x]) - node[3 + x], 0.0) ** 2
    return square


@compiled(borrows=True)
def to_triangle(p: Floats, a: Floats, b: Floats, c: Floats) -> float:
    """Square of the distance to a triangle: to its plane where the foot is inside all edges, else to the nearest edge.

    Source: Ericson (2005), Real-Time Collision Detection, section 5.1.5.
    """
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    square = nx * nx + ny * ny + nz * nz
    beyond_v = (y * vz - z * vy) * nx + (z * vx - x * vz) * ny + (x * vy - y * vx) * nz
    beyond_u = (uy * z - uz * y) * nx + (uz * x - ux * z) * ny + (ux * y - uy * x) * nz
    if square > 0.0 and beyond_v >= 0.0 and beyond_u >= 0.0 and beyond_v + beyond_u <= square:
        return float((x * nx + y * ny + z * nz) ** 2 / square)
    return min(_to_edge(p, a, b), _to_edge(p, b, c), _to_edge(p, c, a))


@compiled(borrows=True)
def _to_edge(p: Floats, a: Floats, b: Floats) -> float:
    """Square of the distance to an edge."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    square = ux * ux + uy * uy + uz * uz
    t = min(max((x * ux + y * uy + z * uz) / square, 0.0), 1.0) if square > 0.0 else 0.0
    return float((x - t * ux) ** 2 + (y - t * uy) ** 2 + (z - t * uz) ** 2)
