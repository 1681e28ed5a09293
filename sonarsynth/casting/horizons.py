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
def _over_facet(middle: Floats, normal: Floats, side: Floats, corner: Floats) -> float:
    """The same of a facet with these corners (3, xyz)."""
    height = -math.inf
    for x in range(3):
        if max(side[x] * corner[0, x], side[x] * corner[1, x], side[x] * corner[2, x]) < side[x] * middle[x] - BESIDE:
            return 0.0
    for j in range(3):
        x, y, z = corner[j, 0] - middle[0], corner[j, 1] - middle[1], corner[j, 2] - middle[2]
        height = max(height, normal[0] * x + normal[1] * y + normal[2] * z)
    if height <= FLAT:
        return 0.0
    return _steepest(height, to_triangle(middle, corner[0], corner[1], corner[2]))


@compiled(borrows=True)
def _horizon(
    middle: Floats, normal: Floats, side: Floats, last: int, nodes: Floats, order: Int32s, corners: Floats,
    stack: Ints, over: Floats,
) -> tuple[float, int]:  # fmt: skip
    """The horizon of a facet in an octant, and the facet that makes it; last: that of another, which is tried first."""
    leaves, count, steepest = len(nodes) // 2, len(order), last
    highest, depth, stack[0], over[0] = _over_facet(middle, normal, side, corners[last]), 1, 1, 1.0
    while depth > 0:
        depth -= 1
        node = stack[depth]
        if over[depth] <= highest:
            continue
        if node >= leaves:
            for k in range((node - leaves) * count // leaves, (node - leaves + 1) * count // leaves):
                sine = _over_facet(middle, normal, side, corners[order[k]])
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
def horizons(vertices: Floats, faces: Int32s, nodes: Floats, order: Int32s) -> Floats:
    """Bounds (facet, octant) on the sine of the elevation, over the plane of each facet and seen from its middle, of
    any part of the same mesh that is in an octant about the middle; 0 where nothing there is above that plane. Bits of
    the number of an octant: whether x, y and z are below 0 in it. nodes, order: `facet_tree`."""
    horizon, stack, over = np.empty((len(faces), 8)), np.empty(LEVELS, np.int64), np.empty(LEVELS)
    corners, middle, side, steepest = np.empty((len(faces), 3, 3)), np.empty(3), np.empty(3), np.zeros(8, np.int64)
    for f in range(len(faces)):
        for j in range(3):
            corners[f, j] = vertices[faces[f, j]]
    for f in order:
        normal = np.cross(corners[f, 1] - corners[f, 0], corners[f, 2] - corners[f, 0])
        normal /= math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
        for x in range(3):
            middle[x] = (corners[f, 0, x] + corners[f, 1, x] + corners[f, 2, x]) / 3.0
        for octant in range(8):
            for x in range(3):
                side[x] = -1.0 if octant >> x & 1 else 1.0
            highest, steepest[octant] = _horizon(
                middle, normal, side, steepest[octant], nodes, order, corners, stack, over
            )
            horizon[f, octant] = highest if normal[0] == normal[0] else 1.0  # without an area nothing is known
    return horizon
