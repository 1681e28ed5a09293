"""Rays against triangles in float64, compiled: what decides after a float32 ray caster has proposed a facet."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from sonarsynth.conventions import Floats, Ints

Int32s = npt.NDArray[np.int32]
EDGE = 1e-14  # of the square of the body's size: rays this close to an edge hit either facet, never neither


@njit(cache=True, error_model="numpy", nogil=True)
def distance_to_facet(o: Floats, d: Floats, corners: Floats, facet: int, tolerance: float) -> float:
    """Distance along the ray o + t d to a facet (3, xyz), from either side; NaN where it misses.

    Signed volumes of the ray with the three edges have one sign inside: Moeller & Trumbore (1997) in a symmetric form.
    """
    ax, ay, az = corners[facet, 0, 0] - o[0], corners[facet, 0, 1] - o[1], corners[facet, 0, 2] - o[2]
    bx, by, bz = corners[facet, 1, 0] - o[0], corners[facet, 1, 1] - o[1], corners[facet, 1, 2] - o[2]
    cx, cy, cz = corners[facet, 2, 0] - o[0], corners[facet, 2, 1] - o[1], corners[facet, 2, 2] - o[2]
    u = d[0] * (by * cz - bz * cy) + d[1] * (bz * cx - bx * cz) + d[2] * (bx * cy - by * cx)
    v = d[0] * (cy * az - cz * ay) + d[1] * (cz * ax - cx * az) + d[2] * (cx * ay - cy * ax)
    w = d[0] * (ay * bz - az * by) + d[1] * (az * bx - ax * bz) + d[2] * (ax * by - ay * bx)
    if min(u, v, w) < -tolerance and max(u, v, w) > tolerance:
        return math.nan
    ex, ey, ez = bx - ax, by - ay, bz - az
    fx, fy, fz = cx - ax, cy - ay, cz - az
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    along = nx * d[0] + ny * d[1] + nz * d[2]
    if along == 0.0:
        return math.nan
    return float((nx * ax + ny * ay + nz * az) / along)


@njit(cache=True, error_model="numpy", nogil=True)
def confirm(
    origin: Floats,
    direction: Floats,
    near: Floats,
    far: Floats,
    proposed: Ints,
    corners: Floats,
    faces: Int32s,
    first: Ints,
    around: Ints,
    size: float,
    facet: Ints,
    distance: Floats,
) -> None:
    """The nearest hit in [near, far] among each proposed facet and those that share a corner with it; -1, NaN for none.

    first, around: facets round each vertex, around[first[v] : first[v + 1]].
    """
    tolerance = EDGE * size * size
    for i in range(len(proposed)):
        facet[i], distance[i] = -1, math.nan
        if proposed[i] < 0:
            continue
        best = math.inf
        for corner in range(3):
            vertex = faces[proposed[i], corner]
            for j in range(first[vertex], first[vertex + 1]):
                t = distance_to_facet(origin[i], direction[i], corners, around[j], tolerance)
                if near[i] <= t <= far[i] and (t < best or (t == best and around[j] < facet[i])):
                    best, facet[i], distance[i] = t, around[j], t


@njit(cache=True, error_model="numpy", nogil=True)
def search(
    origin: Floats,
    direction: Floats,
    near: Floats,
    far: Floats,
    corners: Floats,
    size: float,
    facet: Ints,
    distance: Floats,
) -> None:
    """The nearest hit in [near, far] among all facets: slow and exact."""
    tolerance = EDGE * size * size
    for i in range(len(origin)):
        facet[i], distance[i] = -1, math.nan
        best = math.inf
        for j in range(len(corners)):
            t = distance_to_facet(origin[i], direction[i], corners, j, tolerance)
            if near[i] <= t <= far[i] and t < best:
                best, facet[i], distance[i] = t, j, t
