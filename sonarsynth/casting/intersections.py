"""Rays against triangles in float64, compiled: what decides after a float32 ray caster has proposed a facet."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Int32s, Ints

EDGE = 1e-14  # of the square of the body's size: rays this close to an edge hit either facet, never neither
SPHERE = 1.0 + 1e-5  # square of the radius of a sphere a little over the unit sphere
CLEAR = 1e-6  # by how much the sine of a ray's elevation is more than its facet's horizon: more than rounding


@compiled
def distance_to_facet(o: Floats, d: Floats, vertices: Floats, faces: Int32s, facet: int, tolerance: float) -> float:
    """Distance along the ray o + t d to a facet, from either side; NaN where it misses.

    Signed volumes of the ray with the three edges have one sign inside: Moeller & Trumbore (1997) in a symmetric form.
    """
    a, b, c = faces[facet, 0], faces[facet, 1], faces[facet, 2]
    ax, ay, az = vertices[a, 0] - o[0], vertices[a, 1] - o[1], vertices[a, 2] - o[2]
    bx, by, bz = vertices[b, 0] - o[0], vertices[b, 1] - o[1], vertices[b, 2] - o[2]
    cx, cy, cz = vertices[c, 0] - o[0], vertices[c, 1] - o[1], vertices[c, 2] - o[2]
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


@compiled
def confirm(
    origin: Floats,
    direction: Floats,
    near: Floats,
    far: Floats,
    proposed: Ints,
    vertices: Floats,
    faces: Int32s,
    first: Int32s,
    around: Int32s,
    size: float,
    facet: Ints,
    distance: Floats,
    any_hit: bool = False,
) -> None:
    """The nearest hit in [near, far] among each proposed facet and those that share a corner with it; -1, NaN for none.

    first, around: facets round each vertex, around[first[v] : first[v + 1]]; any_hit: that of the proposed one, where
    there is one, will do.
    """
    tolerance = EDGE * size * size
    for i in range(len(proposed)):
        facet[i], distance[i] = -1, math.nan
        if proposed[i] < 0:
            continue
        best = math.inf
        if any_hit:
            t = distance_to_facet(origin[i], direction[i], vertices, faces, proposed[i], tolerance)
            if near[i] <= t <= far[i]:
                facet[i], distance[i] = proposed[i], t
                continue
        for corner in range(3):
            vertex = faces[proposed[i], corner]
            for j in range(first[vertex], first[vertex + 1]):
                t = distance_to_facet(origin[i], direction[i], vertices, faces, around[j], tolerance)
                if near[i] <= t <= far[i] and (t < best or (t == best and around[j] < facet[i])):
                    best, facet[i], distance[i] = t, around[j], t


@compiled
def search(
    origin: Floats,
    direction: Floats,
    near: Floats,
    far: Floats,
    vertices: Floats,
    faces: Int32s,
    size: float,
    facet: Ints,
    distance: Floats,
) -> None:
    """The nearest hit in [near, far] among all facets: slow and exact."""
    tolerance = EDGE * size * size
    for i in range(len(origin)):
        facet[i], distance[i] = -1, math.nan
        best = math.inf
        for j in range(len(faces)):
            t = distance_to_facet(origin[i], direction[i], vertices, faces, j, tolerance)
            if near[i] <= t <= far[i] and t < best:
                best, facet[i], distance[i] = t, j, t


@compiled
def round_vertices(faces: Int32s, vertices: int) -> tuple[Int32s, Int32s]:
    """Facets round each vertex, in order: (vertex + 1,) where each list begins, and the lists."""
    first, around = np.zeros(vertices + 1, np.int32), np.empty(faces.size, np.int32)
    for facet in range(len(faces)):
        for corner in range(3):
            first[faces[facet, corner] + 1] += 1
    for vertex in range(vertices):
        first[vertex + 1] += first[vertex]
    next_slot = first.copy()
    for facet in range(len(faces)):
        for corner in range(3):
            vertex = faces[facet, corner]
            around[next_slot[vertex]] = facet
            next_slot[vertex] += 1
    return first, around


@compiled
def to_sphere(o: Floats, d: Floats) -> float:
    """Move the start o of a segment to o + d to where it enters a sphere a little over the unit sphere, make d a unit
    vector, and return how much of its length is left; 0 where it misses the sphere."""
    length = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    if not length > 0.0:
        return 0.0
    dx, dy, dz = d[0] / length, d[1] / length, d[2] / length
    nearest = -(o[0] * dx + o[1] * dy + o[2] * dz)
    fx, fy, fz = o[0] + nearest * dx, o[1] + nearest * dy, o[2] + nearest * dz
    half = SPHERE - (fx * fx + fy * fy + fz * fz)
    if half <= 0.0:
        return 0.0
    half = math.sqrt(half)
    enter, leave = max(nearest - half, 0.0), min(nearest + half, length)
    if not enter < leave:
        return 0.0
    o[0], o[1], o[2], d[0], d[1], d[2] = o[0] + enter * dx, o[1] + enter * dy, o[2] + enter * dz, dx, dy, dz
    return float(length - enter)


@compiled(borrows=True)
def over_horizon(direction: Floats, facet: int, normal: Floats, horizon: Floats) -> bool:
    """Whether a ray, of a direction of any length, leaves a facet above all of its mesh; horizon (facet,):
    `horizons`."""
    square = along = 0.0
    for x in range(3):
        square, along = square + direction[x] ** 2, along + direction[x] * normal[facet, x]
    return bool(along > (horizon[facet] + CLEAR) * math.sqrt(square))


@compiled
def off_facets(
    facet: Ints, direction: Floats, distance: Floats, centroid: Floats, normal: Floats, horizon: Floats,
    offset: float, centre: Floats, size: float, origin: Floats, far: Floats, ray: Ints,
) -> int:  # fmt: skip
    """Write those of rays (ray,) from the middles of facets, moved off them by `offset` (m), in directions of length
    one, up to distances (m), that may meet the mesh again: where they begin, directions and lengths, in its unit; and
    which they are. Returns how many. centre (xyz) and size (m): of its sphere."""
    count = 0
    for i in range(len(facet)):
        if over_horizon(direction[i], facet[i], normal, horizon):
            continue
        for x in range(3):
            origin[count, x] = (centroid[facet[i], x] + offset * normal[facet[i], x] - centre[x]) / size
            direction[count, x] = direction[i, x]
        far[count], ray[count] = distance[i] / size, i
        count += 1
    return count


@compiled
def into_mesh(
    start: Floats, end: Floats, skip: Bools, facet: Ints, normal: Floats, horizon: Floats, rotation: Floats,
    position: Floats, centre: Floats, size: float, origin: Floats, heading: Floats, far: Floats, segment: Ints,
) -> int:  # fmt: skip
    """Write the parts of segments (segment, xyz), world, that are within a sphere about a mesh, in its frame and unit:
    where they begin, unit directions, and lengths; and which segment each is of. Returns how many: others miss it, or
    are to be skipped, or leave a facet (segment,) of it above its horizon; -1: no facet of it.

    rotation (xyz, xyz), position (xyz) m: the pose of the mesh; centre (xyz) and size (m): of its sphere.
    """
    count = 0
    for i in range(len(start)):
        if skip[i]:
            continue
        for x in range(3):
            o = d = 0.0
            for y in range(3):
                o += rotation[y, x] * (start[i, y] - position[y])
                d += rotation[y, x] * (end[i, y] - start[i, y])
            origin[count, x], heading[count, x] = (o - centre[x]) / size, d / size
        if facet[i] >= 0 and over_horizon(heading[count], facet[i], normal, horizon):
            continue
        far[count], segment[count] = to_sphere(origin[count], heading[count]), i
        count += far[count] > 0.0
    return count


@compiled
def folded_pass_near(
    start: Floats, end: Floats, up: Bools, bounces: Ints, bottom: float, skip: Floats, reach: Floats, centre: Floats,
    radius: float, near: Bools,
) -> None:  # fmt: skip
    """Write whether straight rays from start to end (ray, xyz) with bounces come within radius + reach of a point.

    bounces (ray,): reflections from the surface z = 0 and the bottom z = -bottom (m); up: launched upwards; skip
    (ray,): m along the ray from its start that do not count; reach (ray,) m.
    """
    for i in range(len(start)):
        x0, y0, z0 = start[i, 0], start[i, 1], start[i, 2]
        n, rising = bounces[i], 1.0 if up[i] else -1.0
        climb = end[i, 2] - z0
        if n > 0:
            last_above = (n % 2 == 1) == up[i]
            climb = (
                (-z0 if up[i] else bottom + z0) + (n - 1) * bottom + (-end[i, 2] if last_above else bottom + end[i, 2])
            )
        dx, dy = end[i, 0] - x0, end[i, 1] - y0
        length = math.sqrt(dx * dx + dy * dy + climb * climb)
        within = (radius + reach[i]) ** 2
        near[i] = False
        done, z, sense = 0.0, z0, rising if n > 0 else 1.0
        for k in range(n + 1):  # piece by piece between boundaries, fraction: of the whole path
            edge = 0.0 if sense > 0.0 else -bottom
            fraction = 1.0 if k == n or climb == 0.0 else min(done + abs(edge - z) / climb, 1.0)
            z_after = end[i, 2] if k == n else edge
            first = max(done, min(fraction, skip[i] / length if length > 0.0 else 1.0))
            if fraction > first or (k == n and first == done):
                along = (first - done) / (fraction - done) if fraction > done else 0.0
                ax, ay, az = x0 + first * dx, y0 + first * dy, z + along * (z_after - z)
                sx, sy, sz = (fraction - first) * dx, (fraction - first) * dy, z_after - az
                cx, cy, cz = centre[0] - ax, centre[1] - ay, centre[2] - az
                square = sx * sx + sy * sy + sz * sz
                t = min(max((cx * sx + cy * sy + cz * sz) / square, 0.0), 1.0) if square > 0.0 else 0.0
                ex, ey, ez = cx - t * sx, cy - t * sy, cz - t * sz
                near[i] = near[i] or ex * ex + ey * ey + ez * ez <= within
            done, z, sense = fraction, z_after, -sense
