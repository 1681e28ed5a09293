"""A tree of boxes round the facets of a mesh, compiled: node 1 is the root, nodes 2 n and 2 n + 1 are in node n."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.casting.intersections import EDGE, distance_to_facet, to_sphere
from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Int32s, Ints

LEAF = 2
"""Facets in a leaf, at least: fewer than twice as many."""
LEVELS = 64
"""More than a tree has."""
SHADOWS = 4
"""Facets whose shadows are tried."""


def tree(vertices: Floats, faces: Int32s) -> tuple[Floats, Int32s]:
    """Nodes (2 leaves, 6), as `boxes`, and the order (facet,) of the facets in them; leaves: a power of two."""
    leaves = 1 << int(np.log2(max(len(faces) / LEAF, 1.0)))
    order = order_of(vertices, faces, leaves)
    return boxes(vertices, faces, order, leaves), order


@compiled
def _select(order: Int32s, key: Any, axis: int, low: int, high: int, middle: int) -> None:
    """Part order[low:high] at `middle`: nothing before it has a larger key than what is after (Hoare 1961)."""
    first, last = low, high - 1
    while first < last:
        pivot, i, j = key[order[(first + last) // 2], axis], first, last
        while i <= j:
            while key[order[i], axis] < pivot:
                i += 1
            while key[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            last = j
        elif middle >= i:
            first = i
        else:
            return


@compiled
def order_of(vertices: Floats, faces: Int32s, leaves: int) -> Int32s:
    """The facets, ordered by halving each range at its median along its longest side until there are `leaves`."""
    count, order, ranges = len(faces), np.arange(len(faces)).astype(np.int32), 1
    key = np.empty((count, 3), np.float32)
    for i in range(count):
        for x in range(3):
            key[i, x] = vertices[faces[i, 0], x] + vertices[faces[i, 1], x] + vertices[faces[i, 2], x]
    while ranges < leaves:
        for n in range(ranges):
            low, high, longest, axis = n * count // ranges, (n + 1) * count // ranges, -1.0, 0
            for x in range(3):
                lowest, highest = np.inf, -np.inf
                for i in range(low, high):
                    lowest, highest = min(lowest, key[order[i], x]), max(highest, key[order[i], x])
                if highest - lowest > longest:
                    longest, axis = highest - lowest, x
            _select(order, key, axis, low, high, (2 * n + 1) * count // (2 * ranges))
        ranges *= 2
    return order


@compiled
def boxes(vertices: Floats, faces: Int32s, order: Int32s, leaves: int) -> Floats:
    """Nodes (2 leaves, 6) of the tree: centres (xyz) of boxes and half of their sides, -inf where they are empty; leaf
    n has the facets order[n N/leaves : (n + 1) N/leaves]."""
    low, high = np.full((2 * leaves, 3), np.inf), np.full((2 * leaves, 3), -np.inf)
    count = len(order)
    for n in range(leaves):
        for i in range(n * count // leaves, (n + 1) * count // leaves):
            for corner in range(3):
                for axis in range(3):
                    x = vertices[faces[order[i], corner], axis]
                    low[leaves + n, axis] = min(low[leaves + n, axis], x)
                    high[leaves + n, axis] = max(high[leaves + n, axis], x)
    nodes = np.full((2 * leaves, 6), -np.inf)
    for n in range(2 * leaves - 1, 0, -1):
        for axis in range(3):
            if n < leaves:
                low[n, axis] = min(low[2 * n, axis], low[2 * n + 1, axis])
                high[n, axis] = max(high[2 * n, axis], high[2 * n + 1, axis])
            if low[n, axis] <= high[n, axis]:
                nodes[n, axis] = 0.5 * (low[n, axis] + high[n, axis])
                nodes[n, 3 + axis] = 0.5 * (high[n, axis] - low[n, axis]) + 1e-12
    return nodes


@compiled
def _any_facet(
    o: Floats, d: Floats, far: float, nodes: Floats, order: Int32s, vertices: Floats, faces: Int32s, stack: Ints
) -> int:
    """A facet that the ray o + t d meets within `far`; -1 for none."""
    leaves, depth, stack[0] = len(nodes) // 2, 1, 1
    ix, iy, iz = 1.0 / (d[0] + 1e-30), 1.0 / (d[1] + 1e-30), 1.0 / (d[2] + 1e-30)
    while depth > 0:
        depth -= 1
        n = stack[depth]
        x, y, z = (nodes[n, 0] - o[0]) * ix, (nodes[n, 1] - o[1]) * iy, (nodes[n, 2] - o[2]) * iz
        sx, sy, sz = nodes[n, 3] * abs(ix), nodes[n, 4] * abs(iy), nodes[n, 5] * abs(iz)
        if max(x - sx, y - sy, z - sz, 0.0) > min(x + sx, y + sy, z + sz, far) * (1.0 + 1e-9) + 1e-12:
            continue
        if n < leaves:
            stack[depth], stack[depth + 1] = 2 * n, 2 * n + 1
            depth += 2
            continue
        for k in range((n - leaves) * len(order) // leaves, (n - leaves + 1) * len(order) // leaves):
            if 0.0 <= distance_to_facet(o, d, vertices, faces, order[k], EDGE) <= far:
                return int(order[k])
    return -1


@compiled
def _shadow(o: Floats, facet: int, vertices: Floats, faces: Int32s, shadow: Floats) -> None:
    """Write what tells places behind a facet, seen from o: the planes through o and its edges (3, xyz), and how much
    the distances (p - o) from all three sum to where p is on the facet."""
    a, b, c = vertices[faces[facet, 0]] - o, vertices[faces[facet, 1]] - o, vertices[faces[facet, 2]] - o
    shadow[0:3], shadow[3:6], shadow[6:9] = np.cross(b, c), np.cross(c, a), np.cross(a, b)
    shadow[9] = np.dot(a, shadow[0:3])
    if shadow[9] < 0.0:
        shadow[:] = -shadow


@compiled
def _in_shadow(o: Floats, p: Floats, shadow: Floats) -> bool:
    """Whether a place is surely behind a facet."""
    x, y, z = p[0] - o[0], p[1] - o[1], p[2] - o[2]
    u = x * shadow[0] + y * shadow[1] + z * shadow[2]
    v = x * shadow[3] + y * shadow[4] + z * shadow[5]
    w = x * shadow[6] + y * shadow[7] + z * shadow[8]
    return bool(min(u, v, w) > 0.0 and u + v + w > shadow[9])


@compiled
def hide(
    start: Floats, points: Floats, nodes: Floats, order: Int32s, vertices: Floats, faces: Int32s, seen: Bools
) -> None:
    """Take from what is seen (row, point) the points (point, xyz) that a mesh hides from where rows start (row, xyz).

    Points that follow each other are mostly hidden by the same few facets: the shadows of the last ones are tried
    first.
    """
    stack, o, d = np.empty(LEVELS, np.int64), np.empty(3), np.empty(3)
    shadows = np.empty((SHADOWS, 10))
    for i in range(len(start)):
        shadows[:], last = np.inf, 0  # nothing is behind that
        for j in range(len(points)):
            if not seen[i, j]:
                continue
            for k in range(SHADOWS):
                if _in_shadow(start[i], points[j], shadows[(last + k) % SHADOWS]):
                    last, seen[i, j] = (last + k) % SHADOWS, False
                    break
            if not seen[i, j]:
                continue
            for x in range(3):
                o[x], d[x] = start[i, x], points[j, x] - start[i, x]
            far = to_sphere(o, d)
            facet = _any_facet(o, d, far, nodes, order, vertices, faces, stack) if far > 0.0 else -1
            if facet >= 0:
                last, seen[i, j] = (last - 1) % SHADOWS, False
                _shadow(start[i], facet, vertices, faces, shadows[last])
