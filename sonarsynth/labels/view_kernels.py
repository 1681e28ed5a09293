"""Triangles cut along the edges of a view in azimuth and elevation.

The azimuths within +-a, a < 90 degrees, are between two planes through the z axis: s = x sin a -+ y cos a >= 0. The
elevations within +-e are outside two cones: s = hypot(x, y) sin e -+ z cos e >= 0. Along an edge s is linear for a
plane and convex for a cone, so that an edge with both ends out of view has no part in it.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from sonarsynth.conventions import Floats, Ints

SIDES = 4
MOST = 3 + 2 * SIDES
"""Corners of a triangle cut four times, and room to spare."""
HALVINGS = 60


@njit(cache=True, nogil=True)
def depth_in_view(p: Floats, side: int, half: Floats) -> float:
    """How far (m) a point (xyz) is on the inner side of one of the four edges of a view; half: sines and cosines."""
    if side < 2:
        return float(p[0] * half[0] + (1 - 2 * side) * p[1] * half[1])
    return float(np.hypot(p[0], p[1]) * half[2] + (5 - 2 * side) * p[2] * half[3])


@njit(cache=True, nogil=True)
def cross(a: Floats, b: Floats, side: int, half: Floats, out: Floats) -> None:
    """Where the edge from a, in view, to b, out of it, leaves."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        for i in range(3):
            out[i] = a[i] + middle * (b[i] - a[i])
        if depth_in_view(out, side, half) >= 0.0:
            low = middle
        else:
            high = middle


@njit(cache=True, nogil=True)
def cut(corner: Floats, count: int, side: int, half: Floats, other: Floats) -> int:
    """The part (corner, xyz) of a polygon on the inner side of one edge of the view: how many corners."""
    kept = 0
    for i in range(count):
        a, b = corner[i], corner[(i + 1) % count]
        a_in = depth_in_view(a, side, half) >= 0.0
        if a_in:
            other[kept] = a
            kept += 1
        if a_in != (depth_in_view(b, side, half) >= 0.0):
            if a_in:
                cross(a, b, side, half, other[kept])
            else:
                cross(b, a, side, half, other[kept])
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def widen(p: Floats, azimuth: float, elevation: float, found: Floats) -> None:
    """Widen bounds (4,) by a point, within the edges of the view."""
    az = min(max(np.arctan2(p[1], p[0]), -azimuth), azimuth)
    el = min(max(np.arctan2(p[2], np.hypot(p[0], p[1])), -elevation), elevation)
    found[0], found[1] = min(found[0], az), max(found[1], az)
    found[2], found[3] = min(found[2], el), max(found[3], el)


@njit(cache=True, nogil=True)
def steepest(a: Floats, b: Floats, out: Floats) -> bool:
    """The point between two ends where the elevation of an edge is extreme, if there is one."""
    d = b - a
    square, along, across = a[0] * a[0] + a[1] * a[1], a[0] * d[0] + a[1] * d[1], d[0] * d[0] + d[1] * d[1]
    rate = d[2] * along - a[2] * across
    t = (a[2] * along - d[2] * square) / rate if rate != 0.0 else -1.0
    for i in range(3):
        out[i] = a[i] + t * d[i]
    return 0.0 < t < 1.0


@njit(cache=True, nogil=True)
def bounds(seen: Floats, faces: Ints, azimuth: float, elevation: float, found: Floats) -> tuple[bool, bool]:
    """Bounds (4,) in azimuth and elevation (rad) of triangles (facet, 3) of points (vertex, xyz) within +-azimuth and
    +-elevation, in `found`; whether any part is in that view, and whether any is out of it."""
    half = np.array([np.sin(azimuth), np.cos(azimuth), np.sin(elevation), np.cos(elevation)])
    one, other, extreme = np.empty((MOST, 3)), np.empty((MOST, 3)), np.empty(3)
    inside, outside = False, False
    for f in range(len(faces)):
        for i in range(3):
            one[i] = seen[faces[f, i]]
        count = 3
        for side in range(SIDES):
            whole = True
            for i in range(count):
                whole &= depth_in_view(one[i], side, half) >= 0.0
            if whole:
                continue
            outside = True
            count = cut(one, count, side, half, other)
            one, other = other, one
        for i in range(count):
            inside = True
            widen(one[i], azimuth, elevation, found)
            if steepest(one[i], one[(i + 1) % count], extreme):
                widen(extreme, azimuth, elevation, found)
                outside |= depth_in_view(extreme, 2, half) < 0.0 or depth_in_view(extreme, 3, half) < 0.0
    return inside, outside
