"""The chain between the vertices of a ray: laid between its ends, and on beyond them as its vertices move out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import lay

FIRST, UPPER_END, LOWER_END, LAST, ON_SURFACE, ON_BED, DESCENDS, NODE_UP, NODE_DOWN = range(9)
"""Columns of Chain.at: nodes of the chain (its first, those at the upper and the lower end, its last); whether it ends
on surface and bottom; whether the start is the upper end; the next nodes of the profile above and below the chain."""
Z_UP, Z_TOP, Z_BOTTOM, Z_DOWN, GRADIENT_UP, GRADIENT_DOWN, FASTEST, SLOWEST, AFTER = range(9)
"""Columns of Chain.of: depths (m) of those nodes; inverse gradients (s) of the layers beyond the chain, 0 on a
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
    at: Ints  # (SLOTS,)
    of: Floats  # (SLOTS,)
    sums: Floats  # (5, 4): legs above, between and below the ends, turns above and below, as `leg` and `turn` give them
    stack: Floats
    roots: Floats  # (root, 2)


@njit(cache=True, error_model="numpy", nogil=True)
def new_chain(nodes: int) -> Chain:
    """Room for a chain in water of so many nodes."""
    work = np.empty((5, 2 * nodes + 16))
    at, of, sums = np.zeros(SLOTS, np.int64), np.zeros(SLOTS), np.zeros((5, 4))
    roots = np.empty((ROOTS, 2))
    return Chain(work[0], work[1], work[2], work[3], work[4], at, of, sums, np.empty(64), roots)


@njit(cache=True, error_model="numpy", nogil=True)
def begin(depth: Floats, speed: Floats, start: float, end: float, chain: Chain) -> None:
    """Lay the chain between the two ends."""
    at, of = chain.at, chain.of
    top, bottom = min(start, end), max(start, end)
    at[FIRST] = at[UPPER_END] = len(depth) + 4
    at[LOWER_END], at[NODE_DOWN] = lay(depth, speed, top, bottom, chain.c, chain.dz, at[UPPER_END])
    at[LAST] = at[LOWER_END]
    at[DESCENDS] = start <= end
    node = at[NODE_DOWN] - 1
    while node >= 0 and depth[node] > top:
        node -= 1
    at[NODE_UP] = node - 1 if node >= 0 and depth[node] == top else node
    of[Z_UP] = of[Z_TOP] = top
    of[Z_DOWN] = of[Z_BOTTOM] = bottom
    of[FASTEST] = of[SLOWEST] = chain.c[at[UPPER_END]]
    for i in range(at[UPPER_END] + 1, at[LOWER_END] + 1):
        of[FASTEST], of[SLOWEST] = max(of[FASTEST], chain.c[i]), min(of[SLOWEST], chain.c[i])


@njit(cache=True, error_model="numpy", nogil=True)
def extend_up(depth: Floats, speed: Floats, chain: Chain) -> int:
    """Lay the chain on upwards through all that is no faster than its fastest depth: how many layers."""
    at, of = chain.at, chain.of
    was, node = at[FIRST], at[NODE_UP]
    while node >= 0 and speed[node] <= of[FASTEST]:
        at[FIRST] -= 1
        chain.dz[at[FIRST]], chain.c[at[FIRST]] = of[Z_UP] - depth[node], speed[node]
        of[Z_UP], of[SLOWEST] = depth[node], min(of[SLOWEST], speed[node])
        node -= 1
    at[NODE_UP], at[ON_SURFACE] = node, node < 0
    of[GRADIENT_UP] = 0.0
    if node >= 0:
        of[AFTER] = min(of[AFTER], speed[node])
        of[GRADIENT_UP] = (of[Z_UP] - depth[node]) / (speed[node] - chain.c[at[FIRST]])
    return int(was - at[FIRST])


@njit(cache=True, error_model="numpy", nogil=True)
def extend_down(depth: Floats, speed: Floats, chain: Chain) -> int:
    """Lay the chain on downwards through all that is no faster than its fastest depth: how many layers."""
    at, of = chain.at, chain.of
    was, node = at[LAST], at[NODE_DOWN]
    while node < len(depth) and speed[node] <= of[FASTEST]:
        chain.dz[at[LAST]], chain.c[at[LAST] + 1] = depth[node] - of[Z_DOWN], speed[node]
        of[Z_DOWN], of[SLOWEST] = depth[node], min(of[SLOWEST], speed[node])
        at[LAST] += 1
        node += 1
    at[NODE_DOWN], at[ON_BED] = node, node == len(depth)
    of[GRADIENT_DOWN] = 0.0
    if node < len(depth):
        of[AFTER] = min(of[AFTER], speed[node])
        of[GRADIENT_DOWN] = (depth[node] - of[Z_DOWN]) / (speed[node] - chain.c[at[LAST]])
    return int(at[LAST] - was)
