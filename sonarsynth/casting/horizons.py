"""How high a mesh stands over each of its facets, compiled: rays that leave a facet above its horizon meet nothing."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.casting.facet_distances import to_box, to_triangle
from sonarsynth.casting.facet_tree import LEVELS
from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Int32s, Ints

FLAT = 1e-7
"""Of the body's size: what stands no higher over the plane of a facet is below rays that start off it (`OFFSET`)."""
UNKNOWN = -1.0
"""In place of a horizon that nobody asked for yet."""
BESIDE = 1e-4
"""Of the body's size: what is so little beside an octant counts as in it: more than rays start off their facets."""


@compiled(borrows=True)
def _steepest(height: float, square: float) -> float:
    """Largest sine of elevation of what is no higher than that, and no nearer than the root of `square`."""
    if height <= FLAT:
        return 0.0
    return 1.0 if height * height >= square else height / math.sqrt(square)


@compiled(borrows=True)
def _over_box(middle: Floats, normal: Floats, side: Floats, node: Floats) -> float:
    """The same of what is in a box; 0 where that is not in the octant about the middle with these signs, side (xyz)."""
    height = 0.0
    for x in range(3):
        if side[x] * (node[x] - middle[x]) + node[3 + x] < -BESIDE:
            return 0.0
        height += normal[x] * (node[x] - middle[x]) + abs(normal[x]) * node[3 + x]
    return _steepest(height, to_box(middle, node))


@compiled(borrows=True)
def _over_facet(middle: Floats, normal: Floats, side: Floats, vertices: Floats, corner: Int32s) -> float:
    """The same of a facet with these corners (3,)."""
    a, b, c, height = vertices[corner[0]], vertices[corner[1]], vertices[corner[2]], -math.inf
    for x in range(3):
        if max(side[x] * a[x], side[x] * b[x], side[x] * c[x]) < side[x] * middle[x] - BESIDE:
            return 0.0
    for at in (a, b, c):
        x, y, z = at[0] - middle[0], at[1] - middle[1], at[2] - middle[2]
        height = max(height, normal[0] * x + normal[1] * y + normal[2] * z)
    return 0.0 if height <= FLAT else _steepest(height, to_triangle(middle, a, b, c))


@compiled(borrows=True)
def _horizon(
    middle: Floats, normal: Floats, side: Floats, last: int, nodes: Floats, order: Int32s, vertices: Floats,
    faces: Int32s, stack: Ints, over: Floats,
) -> tuple[float, int]:  # fmt: skip
    """The horizon of a facet in an octant, and the facet that makes it; last: that of another, which is tried first."""
    leaves, count, steepest = len(nodes) // 2, len(order), last
    highest, depth, stack[0], over[0] = _over_facet(middle, normal, side, vertices, faces[last]), 1, 1, 1.0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if over[depth] <= highest:
            continue
        if node >= leaves:
            for k in range((node - leaves) * count // leaves, (node - leaves + 1) * count // leaves):
                sine = _over_facet(middle, normal, side, vertices, faces[order[k]])
                if sine > highest:
                    highest, steepest = sine, order[k]
            continue
        one = _over_box(middle, normal, side, nodes[2 * node])
        other = _over_box(middle, normal, side, nodes[2 * node + 1])
        low = 2 * node + (1 if one > other else 0)
        stack[depth], over[depth] = low, min(one, other)
        stack[depth + 1], over[depth + 1] = 4 * node + 1 - low, max(one, other)
        depth += 2
    return highest, steepest


@compiled
def look_up(facet: Ints, vertices: Floats, faces: Int32s, nodes: Floats, order: Int32s, horizon: Floats) -> None:
    """Write, for facets (row,) that nothing is known of yet, bounds (facet, octant) on the sine of the elevation, over
    the plane of each facet and seen from its middle, of any part of the same mesh that is in an octant about the
    middle; 0 where nothing there is above that plane, `UNKNOWN` as long as nobody asked. Bits of the number of an
    octant: whether x, y and z are below 0 in it. nodes, order: `facet_tree`; facets below 0 are none."""
    stack, over = np.empty(LEVELS, np.int64), np.empty(LEVELS)
    normal, middle, side, steepest = np.empty(3), np.empty(3), np.empty(3), np.zeros(8, np.int64)
    for f in facet:
        if f < 0 or horizon[f, 0] != UNKNOWN:
            continue
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        normal[:] = np.cross(b - a, c - a)
        normal /= math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        middle[:] = (a + b + c) / 3.0
        for octant in range(8):
            for x in range(3):
                side[x] = -1.0 if octant >> x & 1 else 1.0
            highest, steepest[octant] = _horizon(
                middle, normal, side, steepest[octant], nodes, order, vertices, faces, stack, over
            )
            horizon[f, octant] = highest if normal[0] == normal[0] else 1.0  # without an area nothing is known
