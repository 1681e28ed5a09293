"""How high a body rises above each of its facets, compiled: rays that leave higher than that meet it no more.

Most facets of a hull see the sky down to the horizon. Their rays need not be cast at the hull itself.
"""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.casting.facet_tree import LEVELS
from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Int32s, Ints

LOWEST = 0.1
"""Sine of the lowest elevation that is told from others."""
MARGIN = 1e-3
"""By how much rays that surely meet nothing leave higher than that."""


@compiled
def _edge(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Largest sine of elevation of places on an edge between two places, z upwards; -1 where it passes below."""
    a, b = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
    along = ax * bx + ay * by + az * bz
    highest = max(az / math.sqrt(max(a, 1e-300)), bz / math.sqrt(max(b, 1e-300)))
    first, last = az * b - bz * along, bz * a - az * along  # of the highest place of the great circle: between both
    if first > 0.0 and last > 0.0:
        square = a * b - along * along
        return max(highest, math.sqrt(min((az * first + bz * last) / square, 1.0))) if square > 0.0 else 1.0
    return highest


@compiled
def _facet(corner: Floats) -> float:
    """Largest sine of elevation of places on a triangle with corners (3, xyz), z upwards."""
    highest, inside, outside = -1.0, True, True
    for j in range(3):
        k = (j + 1) % 3
        turn = corner[j, 0] * corner[k, 1] - corner[j, 1] * corner[k, 0]
        inside, outside = inside and turn >= 0.0, outside and turn <= 0.0
        highest = max(
            highest, _edge(corner[j, 0], corner[j, 1], corner[j, 2], corner[k, 0], corner[k, 1], corner[k, 2])
        )
    return 1.0 if inside or outside else highest


@compiled
def _horizon(
    facet: int, normal: Floats, nodes: Floats, order: Int32s, vertices: Floats, faces: Int32s, stack: Ints,
    corner: Floats, axes: Floats,
) -> float:  # fmt: skip
    """Sine of elevation over which no other facet of a mesh rises, as seen from the middle of one."""
    leaves, centre = len(nodes) // 2, axes[3]
    x, y, z = normal[0], normal[1], normal[2]
    flat = math.copysign(1.0, z)
    share = -1.0 / (flat + z)  # axes across a normal: Duff et al. (2017), J. Comput. Graph. Tech. 6, 1
    axes[0, 0], axes[0, 1], axes[0, 2] = 1.0 + flat * x * x * share, flat * x * y * share, -flat * x
    axes[1, 0], axes[1, 1], axes[1, 2] = x * y * share, flat + y * y * share, -y
    axes[2, 0], axes[2, 1], axes[2, 2] = x, y, z
    for i in range(3):
        centre[i] = (vertices[faces[facet, 0], i] + vertices[faces[facet, 1], i] + vertices[faces[facet, 2], i]) / 3.0
    highest, depth, stack[0] = LOWEST, 1, 1
    while depth > 0 and highest < 1.0:
        depth -= 1
        node, up, square = stack[depth], 0.0, 0.0
        for i in range(3):
            away, half = nodes[node, i] - centre[i], nodes[node, 3 + i]
            up += away * normal[i] + half * abs(normal[i])
            square += max(abs(away) - half, 0.0) ** 2
        if up <= highest * math.sqrt(square):
            continue
        if node < leaves:
            stack[depth], stack[depth + 1] = 2 * node, 2 * node + 1
            depth += 2
            continue
        for k in range((node - leaves) * len(order) // leaves, (node - leaves + 1) * len(order) // leaves):
            above = False
            for j in range(3):
                for i in range(3):
                    corner[j, i] = 0.0
                    for n in range(3):
                        corner[j, i] += axes[i, n] * (vertices[faces[order[k], j], n] - centre[n])
                above = above or corner[j, 2] > 0.0
            if above and order[k] != facet:
                highest = max(highest, _facet(corner))
    return highest


@compiled
def clear_of_body(
    facet: Ints, direction: Floats, slope: Floats, normal: Floats, nodes: Floats, order: Int32s, vertices: Floats,
    faces: Int32s, horizon: Floats,
) -> Bools:  # fmt: skip
    """Which cones of rays (ray,) from the middles of facets about directions (ray, xyz), of length one, surely meet no
    other facet of a mesh; slope (ray,): radius of each over the distance along it. horizon (facet,) is what is known of
    each facet, NaN where it is not yet; the tree is that of `facet_tree`, the normals (facet, xyz) are those of the
    mesh."""
    stack, corner, axes = np.empty(LEVELS, np.int64), np.empty((3, 3)), np.empty((4, 3))
    out = np.zeros(len(facet), np.bool_)
    for i in range(len(facet)):
        n, f = normal[facet[i]], facet[i]
        sine = direction[i, 0] * n[0] + direction[i, 1] * n[1] + direction[i, 2] * n[2] - slope[i] - MARGIN
        if sine <= LOWEST:
            continue
        if math.isnan(horizon[f]):
            horizon[f] = _horizon(f, n, nodes, order, vertices, faces, stack, corner, axes)
        out[i] = sine > horizon[f]
    return out
