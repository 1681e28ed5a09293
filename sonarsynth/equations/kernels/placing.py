"""Surface elements placed in the world, compiled, of those alone that are on the right side."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints


@compiled
def distances(points: Floats, place: Floats) -> Floats:
    """How far (point,) in m points (point, xyz) are from a place (xyz)."""
    out = np.empty(len(points))
    for i in range(len(points)):
        x, y, z = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        out[i] = math.sqrt(x * x + y * y + z * z)
    return out


@compiled
def in_front(rows: Ints, position: Floats, normal: Floats, eye: Floats, slack: float, lights: Floats) -> Ints:
    """Those of some elements (row,) that have an eye (xyz), or what is within `slack` (m) of it, on their outer side,
    and one of some lights (light, xyz), where there are any, as well, or have no normal; all in one frame."""
    kept, count = np.empty(len(rows), np.int64), 0
    for row in rows:
        x, y, z = position[row, 0], position[row, 1], position[row, 2]
        nx, ny, nz = normal[row, 0], normal[row, 1], normal[row, 2]
        keep = nx == 0.0 and ny == 0.0 and nz == 0.0
        if not keep and nx * (eye[0] - x) + ny * (eye[1] - y) + nz * (eye[2] - z) > -slack:
            keep = len(lights) == 0
            for n in range(len(lights)):
                keep = keep or nx * (lights[n, 0] - x) + ny * (lights[n, 1] - y) + nz * (lights[n, 2] - z) > 0.0
        if keep:
            kept[count] = row
            count += 1
    return kept[:count]


@compiled
def placed(
    rows: Ints, position: Floats, normal: Floats, rotation: Floats, origin: Floats, offset: float
) -> tuple[Floats, Floats, Floats]:
    """Places of some elements (row, xyz) in the world, their normals, and places off them by `offset` (m), or by what
    places are rounded by; position and normal (element, xyz) in a frame with this rotation and origin (m)."""
    point, turned, clear = np.empty((len(rows), 3)), np.empty((len(rows), 3)), np.empty((len(rows), 3))
    for i in range(len(rows)):
        p, n, far = position[rows[i]], normal[rows[i]], 0.0
        for x in range(3):
            point[i, x] = rotation[x, 0] * p[0] + rotation[x, 1] * p[1] + rotation[x, 2] * p[2] + origin[x]
            turned[i, x] = rotation[x, 0] * n[0] + rotation[x, 1] * n[1] + rotation[x, 2] * n[2]
            far = max(far, abs(point[i, x]))
        off = max(offset, 8.0 * 2.220446049250313e-16 * far)
        for x in range(3):
            clear[i, x] = point[i, x] + off * turned[i, x]
    return point, turned, clear
