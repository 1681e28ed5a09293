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
    origin: Floats, direction: Floats, near: Floats, far: Floats, proposed: Ints, vertices: Floats, faces: Int32s,
    first: Int32s, around: Int32s, size: float, facet: Ints, distance: Floats, any_hit: bool = False,
) -> None:  # fmt: skip
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
    origin: Floats, direction: Floats, near: Floats, far: Floats, vertices: Floats, faces: Int32s, size: float,
    facet: Ints, distance: Floats,
) -> None:  # fmt: skip
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
def over_horizon(direction: Floats, slope: float, facet: int, normal: Floats, horizon: Floats) -> bool:
    """Whether all of a cone of rays, along a direction of any length, leaves a facet above all of its mesh that is in
    the octants of the cone; slope: its radius over the distance along it, 0 of a ray; horizon (facet, octant):
    `horizons`."""
    square, along, octant = 0.0, 0.0, 0
    for x in range(3):
        square, along = square + direction[x] ** 2, along + direction[x] * normal[facet, x]
        octant |= (direction[x] < 0.0) << x
    lowest, highest = along, horizon[facet, octant]
    if slope > 0.0:
        lowest, radius = along - slope * math.sqrt(max(square - along * along, 0.0)), slope * math.sqrt(square)
        for octant in range(8):
            within = True
            for x in range(3):
                within = within and (-direction[x] if octant >> x & 1 else direction[x]) >= -radius
            highest = max(highest, horizon[facet, octant]) if within else highest
    return bool(lowest > (highest + CLEAR) * math.sqrt(square * (1.0 + slope * slope)))


@compiled
def off_facets(
    rows: Ints, place: Floats, centroid: Floats, normal: Floats, horizon: Floats, offset: float, centre: Floats,
    size: float, facet: Ints, origin: Floats, heading: Floats, far: Floats, ray: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Write those of facets (row,) on whose outer side a place (xyz) is, facet (row,); and of the rays to it from their
    middles, moved off them by `offset` (m), those that may meet the mesh again: where they begin, directions and
    lengths, in its unit, and which of these facets they are of. Returns how many of each. centre (xyz) and size (m): of
    its sphere."""
    faced = count = 0
    for f in rows:
        square, beside, way = 0.0, offset, heading[count]
        for x in range(3):
            way[x] = place[x] - centroid[f, x] - offset * normal[f, x]
            square, beside = square + way[x] ** 2, beside + way[x] * normal[f, x]
        if not beside > 0.0:
            continue
        facet[faced], ray[count] = f, faced
        faced += 1
        if over_horizon(way, 0.0, f, normal, horizon):
            continue
        distance = math.sqrt(square)
        for x in range(3):
            origin[count, x] = (centroid[f, x] + offset * normal[f, x] - centre[x]) / size
            way[x] /= distance
        far[count] = distance / size
        count += 1
    return faced, count


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
        if facet[i] >= 0 and over_horizon(heading[count], 0.0, facet[i], normal, horizon):
            continue
        far[count], segment[count] = to_sphere(origin[count], heading[count]), i
        count += far[count] > 0.0
    return count
