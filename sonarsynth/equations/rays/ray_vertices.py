"""The chain between the vertices of a ray: laid between its ends, and on beyond them as its vertices move out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import lay

FIRST, UPPER_END, LOWER_END, LAST, ON_SURFACE, ON_BED, DESCENDS, NODE_UP, NODE_DOWN = range(9)
"""Slots of Chain.ints: nodes of the chain (its first, those at the upper and the lower end, its last); whether it ends
on surface and bottom; whether the start is the upper end; the next nodes of the profile above and below the chain."""
Z_UP, Z_TOP, Z_BOTTOM, Z_DOWN, GRADIENT_UP, GRADIENT_DOWN, FASTEST, SLOWEST, AFTER = range(9)
"""Slots of Chain.reals: depths (m) of those nodes; inverse gradients (s) of the layers beyond the chain, 0 on a
boundary; fastest and slowest speed in the chain (m/s), and the speed at which its vertices next change layer."""
SLOTS = 9
ROOTS = 64
"""Room for rays of one family with vertices in the same layers."""


class Chain(NamedTuple):
    """The water between the vertices of a ray, and room to work in."""

    c: Floats  # (node,) m/s
    d: Floats  # (node,) m2/s2: (c_m - c)(c_m + c), c_m the fastest
    k: Floats  # (layer,) m2/s: crossings dz (c1 + c2) of one family
    dz: Floats  # (layer,) m
    crossings: Floats  # (layer,) of one family
    ints: Ints  # (SLOTS,)
    reals: Floats  # (SLOTS,)
    sums: Floats  # (5, 4): legs above, between and below the ends, turns above and below, as `leg` and `turn` give them
    stack: Floats
    roots: Floats  # (root, 2)


@compiled
def new_chain(nodes: int) -> Chain:
    """Room for a chain in water of so many nodes."""
    work = np.empty((5, 2 * nodes + 16))
    ints, reals, sums = np.zeros(SLOTS, np.int64), np.zeros(SLOTS), np.zeros((5, 4))
    roots = np.empty((ROOTS, 2))
    return Chain(work[0], work[1], work[2], work[3], work[4], ints, reals, sums, np.empty(64), roots)


@compiled(borrows=True)
def begin(depth: Floats, speed: Floats, start: float, end: float, chain: Chain) -> None:
    """Lay the chain between the two ends."""
    ints, reals = chain.ints, chain.reals
    top, bottom = min(start, end), max(start, end)
    ints[FIRST] = ints[UPPER_END] = len(depth) + 4
    ints[LOWER_END], ints[NODE_DOWN] = lay(depth, speed, top, bottom, chain.c, chain.dz, ints[UPPER_END])
    ints[LAST] = ints[LOWER_END]
    ints[DESCENDS] = start <= end
    node = ints[NODE_DOWN] - 1
    while node >= 0 and depth[node] > top:
        node -= 1
    ints[NODE_UP] = node - 1 if node >= 0 and depth[node] == top else node
    reals[Z_UP] = reals[Z_TOP] = top
    reals[Z_DOWN] = reals[Z_BOTTOM] = bottom
    reals[FASTEST] = reals[SLOWEST] = chain.c[ints[UPPER_END]]
    for i in range(ints[UPPER_END] + 1, ints[LOWER_END] + 1):
        reals[FASTEST], reals[SLOWEST] = max(reals[FASTEST], chain.c[i]), min(reals[SLOWEST], chain.c[i])


@compiled(borrows=True)
def extend_up(depth: Floats, speed: Floats, chain: Chain) -> int:
    """Lay the chain on upwards through all that is no faster than its fastest depth: how many layers."""
    ints, reals = chain.ints, chain.reals
    last_first, node = ints[FIRST], ints[NODE_UP]
    while node >= 0 and speed[node] <= reals[FASTEST]:
        ints[FIRST] -= 1
        chain.dz[ints[FIRST]], chain.c[ints[FIRST]] = reals[Z_UP] - depth[node], speed[node]
        reals[Z_UP], reals[SLOWEST] = depth[node], min(reals[SLOWEST], speed[node])
        node -= 1
    ints[NODE_UP], ints[ON_SURFACE] = node, node < 0
    reals[GRADIENT_UP] = 0.0
    if node >= 0:
        reals[AFTER] = min(reals[AFTER], speed[node])
        reals[GRADIENT_UP] = (reals[Z_UP] - depth[node]) / (speed[node] - chain.c[ints[FIRST]])
    return int(last_first - ints[FIRST])


@compiled(borrows=True)
def extend_down(depth: Floats, speed: Floats, chain: Chain) -> int:
    """Lay the chain on downwards through all that is no faster than its fastest depth: how many layers."""
    ints, reals = chain.ints, chain.reals
    last_last, node = ints[LAST], ints[NODE_DOWN]
    while node < len(depth) and speed[node] <= reals[FASTEST]:
        chain.dz[ints[LAST]], chain.c[ints[LAST] + 1] = depth[node] - reals[Z_DOWN], speed[node]
        reals[Z_DOWN], reals[SLOWEST] = depth[node], min(reals[SLOWEST], speed[node])
        ints[LAST] += 1
        node += 1
    ints[NODE_DOWN], ints[ON_BED] = node, node == len(depth)
    reals[GRADIENT_DOWN] = 0.0
    if node < len(depth):
        reals[AFTER] = min(reals[AFTER], speed[node])
        reals[GRADIENT_DOWN] = (depth[node] - reals[Z_DOWN]) / (speed[node] - chain.c[ints[LAST]])
    return int(ints[LAST] - last_last)
