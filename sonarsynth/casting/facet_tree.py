"""A tree of boxes round the facets of a mesh, compiled: node 1 is the root, nodes 2 n and 2 n + 1 are in node n."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats

Int32s = npt.NDArray[np.int32]
LEAF = 4
"""Facets in a leaf, at least: fewer than twice as many."""


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
