"""Narrow cones of rays among bodies, compiled: whether nothing stands in any ray of a cone, or something in all.

A cone has its apex where the rays start, an axis of unit length and a slope: its radius over the distance along the
axis. Places in it are (x, y, t): t along the axis, from the apex. Meshes are those of `ray_casting.CastingMesh`, with
the trees of `facet_tree`.
"""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.casting.facet_tree import LEVELS
from sonarsynth.casting.intersections import over_horizon
from sonarsynth.casting.ray_casting import casting_mesh
from sonarsynth.casting.shadows import nearest_first
from sonarsynth.compiling import compiled
from sonarsynth.conventions import NO_TARGET, Floats, Int32s, Ints
from sonarsynth.geometry.placed_target import PlacedTarget

EMPTY, CLOSED, UNKNOWN = range(3)
"""No facet is in a cone; one piece of surface closes it from side to side; neither is certain."""
TRIED = 3
"""Surfaces that are tried for whether they close a cone."""
PATCH = 64
"""Facets of a surface that may be needed to close a cone."""


@compiled(borrows=True)
def _frame(axis: Floats, frame: Floats) -> None:
    """Write the axes x, y, t (xyz each) of a cone, and the inverse of what t is made of."""
    small = 0
    for j in range(1, 3):
        if abs(axis[j]) < abs(axis[small]):
            small = j
    second, third = (small + 1) % 3, (small + 2) % 3
    length = math.hypot(axis[second], axis[third])
    frame[0, small], frame[0, second], frame[0, third] = 0.0, axis[third] / length, -axis[second] / length
    frame[2, 0], frame[2, 1], frame[2, 2] = axis[0], axis[1], axis[2]
    frame[1, 0] = axis[1] * frame[0, 2] - axis[2] * frame[0, 1]
    frame[1, 1] = axis[2] * frame[0, 0] - axis[0] * frame[0, 2]
    frame[1, 2] = axis[0] * frame[0, 1] - axis[1] * frame[0, 0]
    for j in range(3):
        frame[3, j] = 1.0 / (axis[j] if abs(axis[j]) > 1e-12 else 1e-12)


@compiled(borrows=True)
def _corners(facet: int, apex: Floats, frame: Floats, vertices: Floats, faces: Int32s, corner: Floats) -> None:
    """Write the corners (3, xyt) of a facet in the frame of a cone."""
    for j in range(3):
        v = faces[facet, j]
        dx, dy, dz = vertices[v, 0] - apex[0], vertices[v, 1] - apex[1], vertices[v, 2] - apex[2]
        for x in range(3):
            corner[j, x] = frame[x, 0] * dx + frame[x, 1] * dy + frame[x, 2] * dz


@compiled(borrows=True)
def _misses_box(nodes: Floats, n: int, apex: Floats, axis: Floats, inverse: Floats, slope: float, reach: float) -> bool:
    """Whether a cone surely misses the box of a node: its axis misses the box enlarged by the width of the cone there.
    inverse: of the components of the axis."""
    dx, dy, dz = nodes[n, 0] - apex[0], nodes[n, 1] - apex[1], nodes[n, 2] - apex[2]
    hx, hy, hz = nodes[n, 3], nodes[n, 4], nodes[n, 5]
    along = dx * axis[0] + dy * axis[1] + dz * axis[2]
    half_extent = hx * abs(axis[0]) + hy * abs(axis[1]) + hz * abs(axis[2])
    if not (along + half_extent >= 0.0 and along - half_extent <= reach):
        return True
    wide = slope * (along + half_extent) + 1e-12
    x, y, z = dx * inverse[0], dy * inverse[1], dz * inverse[2]
    sx, sy, sz = (hx + wide) * abs(inverse[0]), (hy + wide) * abs(inverse[1]), (hz + wide) * abs(inverse[2])
    return bool(max(x - sx, y - sy, z - sz, 0.0) > min(x + sx, y + sy, z + sz, reach) * (1.0 + 1e-9) + 1e-12)


@compiled(borrows=True)
def _touches(a: Floats, b: Floats, square: float) -> bool:
    """Whether a segment from a to b meets a cone; square: of its slope."""
    ta, tb = a[2], b[2]
    if ta < 0.0 and tb < 0.0:
        return False
    ex, ey, te = b[0] - a[0], b[1] - a[1], tb - ta
    first = -ta / te if ta < 0.0 else 0.0
    last = -ta / te if tb < 0.0 else 1.0
    # square of the distance from the axis less that of the cone's radius: p u^2 + 2 q u + r, u from first to last
    p = ex * ex + ey * ey - square * te * te
    q = a[0] * ex + a[1] * ey - square * ta * te
    r = a[0] * a[0] + a[1] * a[1] - square * ta * ta
    if r + first * (2.0 * q + first * p) <= 0.0 or r + last * (2.0 * q + last * p) <= 0.0:
        return True
    if p <= 0.0:
        return False
    u = min(max(-q / p, first), last)
    return bool(r + u * (2.0 * q + u * p) <= 0.0)


@compiled(borrows=True)
def _on_axis(corner: Floats) -> bool:
    """Whether the axis meets a triangle with these corners."""
    u = corner[1, 0] * corner[2, 1] - corner[1, 1] * corner[2, 0]
    v = corner[2, 0] * corner[0, 1] - corner[2, 1] * corner[0, 0]
    w = corner[0, 0] * corner[1, 1] - corner[0, 1] * corner[1, 0]
    if min(u, v, w) < 0.0 and max(u, v, w) > 0.0:
        return False
    total = u + v + w
    return bool(total != 0.0 and (u * corner[0, 2] + v * corner[1, 2] + w * corner[2, 2]) / total >= 0.0)


@compiled(borrows=True)
def _beside(corner: Floats, slope: float, reach: float) -> bool:
    """Whether a triangle is surely beside a cone."""
    far = max(corner[0, 2], corner[1, 2], corner[2, 2])
    if far < 0.0 or min(corner[0, 2], corner[1, 2], corner[2, 2]) > reach:
        return True
    wide = slope * far
    for j in range(2):
        if (
            min(corner[0, j], corner[1, j], corner[2, j]) > wide
            or max(corner[0, j], corner[1, j], corner[2, j]) < -wide
        ):
            return True
    return False


@compiled(borrows=True)
def _across(facet: int, a: int, b: int, faces: Int32s, first: Int32s, around: Int32s) -> int:
    """The facet across the edge from vertex a to b of a facet; -1 unless there is one, with the same outer side."""
    neighbour = -1
    for i in range(first[a], first[a + 1]):
        candidate = around[i]
        if candidate == facet:
            continue
        for j in range(3):
            tail, head = faces[candidate, j], faces[candidate, (j + 1) % 3]
            if tail == b and head == a and neighbour < 0:
                neighbour = candidate
            elif (tail == a and head == b) or (tail == b and head == a):
                return -1
    return neighbour


@compiled(borrows=True)
def _crosses(corner: Floats, slope: float, far: float, sense: float) -> float:
    """From which side, 1 or -1, all lines of a cone cross the plane of a triangle, nearer than `far`; 0 where not all
    do, or not from the side `sense` (0: either)."""
    ex, ey, ez = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
    fx, fy, fz = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
    nx, ny, nz = ey * fz - ez * fy, ez * fx - ex * fz, ex * fy - ey * fx
    sign = sense if sense != 0.0 else math.copysign(1.0, nz)
    steep, lean = sign * nz, slope * math.hypot(nx, ny)
    if not steep > 1.001 * lean + 1e-9 * math.sqrt(nx * nx + ny * ny + nz * nz):
        return 0.0
    height = sign * (nx * corner[0, 0] + ny * corner[0, 1] + nz * corner[0, 2])
    return sign if height / (steep + lean) > 1e-5 and height / (steep - lean) < far else 0.0


@compiled(borrows=True)
def _closes(
    facet: int, apex: Floats, frame: Floats, slope: float, far: float, vertices: Floats, faces: Int32s, first: Int32s,
    around: Int32s, corner: Floats, patch: Ints,
) -> bool:  # fmt: skip
    """Whether the surface that a facet on the axis belongs to closes the cone, nearer than `far`.

    It is followed over the edges that are in the cone. All lines of the cone must cross it from the same side, so that
    it has no fold there, and each of its edges in the cone must join two facets. Then it has no rim within the cone,
    and cuts it in two.
    """
    patch[0], count, done, sense = facet, 1, 0, 0.0
    while done < count:
        current = patch[done]
        done += 1
        _corners(current, apex, frame, vertices, faces, corner)
        sense = _crosses(corner, slope, far, sense)
        if sense == 0.0:
            return False
        for j in range(3):
            if not _touches(corner[j], corner[(j + 1) % 3], slope * slope):
                continue
            next_facet = _across(current, faces[current, j], faces[current, (j + 1) % 3], faces, first, around)
            in_patch = False
            for i in range(count):
                in_patch = in_patch or patch[i] == next_facet
            if next_facet < 0 or (not in_patch and count == PATCH):
                return False
            if not in_patch:
                patch[count] = next_facet
                count += 1
    return True


@compiled(borrows=True)
def _look(
    apex: Floats, frame: Floats, slope: float, reach: float, far: float, nodes: Floats, order: Int32s,
    vertices: Floats, faces: Int32s, first: Int32s, around: Int32s, stack: Ints, patch: Ints, corner: Floats,
    verdict: int,
) -> int:  # fmt: skip
    """What is certain of one cone; see `look`."""
    leaves, tried, depth, stack[0] = len(nodes) // 2, 0, 1, 1
    wide = slope if verdict == EMPTY else 0.0
    while depth > 0 and tried < TRIED:
        depth -= 1
        node = stack[depth]
        if _misses_box(nodes, node, apex, frame[2], frame[3], wide, reach):
            continue
        if node < leaves:
            stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
            depth += 2
            continue
        for k in range((node - leaves) * len(order) // leaves, (node - leaves + 1) * len(order) // leaves):
            _corners(order[k], apex, frame, vertices, faces, corner)
            if _beside(corner, wide, reach):
                continue
            met = _on_axis(corner)
            if verdict == EMPTY:
                for j in range(3):
                    met_at_edge = _touches(corner[j], corner[(j + 1) % 3], slope * slope)
                    if met or met_at_edge:
                        verdict, wide = UNKNOWN, 0.0  # from now on what is on the axis is looked for
                        break
            if met:
                tried += 1
                if _closes(order[k], apex, frame, slope, far, vertices, faces, first, around, corner, patch):
                    return CLOSED
    return verdict


@compiled
def look(
    apex: Floats, axis: Floats, slope: Floats, reach: Floats, far: Floats, facet: Ints, normal: Floats, horizon: Floats,
    rotation: Floats, position: Floats, size: float, nodes: Floats, order: Int32s, vertices: Floats, faces: Int32s,
    first: Int32s, around: Int32s, verdict: Ints,
) -> None:  # fmt: skip
    """Write what is certain of cones (cone,) with apex and axis (cone, xyz), world, up to `reach` (m): EMPTY, CLOSED by
    a surface nearer than `far` (m), or UNKNOWN, as those may be already; first, around: facets round each vertex.

    facet (cone,): that the apex is off, -1: none; above the horizon (facet,) of it there is nothing. rotation (xyz,
    xyz), position (xyz) m: of the frame that the mesh is in, about its centre, in units of `size` (m).
    """
    stack, patch = np.empty(LEVELS, np.int64), np.empty(PATCH, np.int64)
    corner, frame, start, along = np.empty((3, 3)), np.empty((4, 3)), np.empty(3), np.empty(3)
    for i in range(len(apex)):
        if verdict[i] == CLOSED:
            continue
        for x in range(3):
            start[x] = along[x] = 0.0
            for y in range(3):
                start[x] += rotation[y, x] * (apex[i, y] - position[y]) / size
                along[x] += rotation[y, x] * axis[i, y]
        if facet[i] >= 0 and over_horizon(along, slope[i], facet[i], normal, horizon):
            continue
        _frame(along, frame)
        verdict[i] = _look(
            start, frame, slope[i], reach[i] / size, far[i] / size, nodes, order, vertices, faces, first, around, stack,
            patch, corner, verdict[i],
        )  # fmt: skip


def classify_cones(
    bodies: tuple[PlacedTarget, ...], apex: Floats, axis: Floats, slope: Floats, reach: Floats, far: Floats,
    facets: tuple[Ints | None, Ints | None] = (None, None),
) -> Ints:  # fmt: skip
    """What is certain of cones (cone,) among bodies: EMPTY of them up to `reach` (m) along the axis, CLOSED by one of
    them nearer than `far` (m), or UNKNOWN.

    apex, axis: (cone, xyz) world, axes of unit length; slope (cone,): radius of the cone over the distance along it;
    facets: the body (cone,) and the facet of it (cone,) that an apex is off, in the middle (`ray_casting.occluded`).
    Holds for any line that stays in the cone, bent or not, from its apex to where it ends.
    """
    verdicts, (owner, facet) = np.full(len(apex), EMPTY), facets
    for rows, number in nearest_first(bodies, apex):
        body, mesh = bodies[number], casting_mesh(bodies[number].mesh)
        own = np.full(len(apex), NO_TARGET) if facet is None else np.where(owner == number, facet, NO_TARGET)
        horizon = np.empty((0, 8)) if facet is None else mesh.horizon(own)
        place = body.pose.rotation, body.pose.to_world(mesh.centre), mesh.size
        cones = apex[rows], axis[rows], slope[rows], reach[rows], far[rows], own[rows], body.mesh.normal, horizon
        look(*cones, *place, *mesh.tree, mesh.vertices, mesh.faces, *mesh.around, verdicts[rows])
    return verdicts
