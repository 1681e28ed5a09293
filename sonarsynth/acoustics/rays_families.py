"""The families of rays between two points: every way to go up and down between an upper and a lower vertex.

A ray keeps p, so it goes up and down between two vertices above and below both ends, each a boundary or the depth where
c = 1/p. A family is a launch direction and a number of vertices: it says how often the ray passes above, between and
below the ends. As c = 1/p grows from the fastest speed between the ends to infinity, vertices move out, from layer to
layer and at last to surface and bed. In each interval of c in which neither changes layer, the range of every family is
a sum of the same three legs (above, between, below), so the legs are summed once for all families.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from sonarsynth.acoustics.rays_chain import GRAZING, lay, leg, offsets, turn
from sonarsynth.acoustics.rays_rows import BOTTOM, END_SINE, LOWER, START_SINE, SURFACE, UPPER, emit
from sonarsynth.acoustics.rays_search import straight, turns
from sonarsynth.conventions import Floats, Ints

UP, DOWN, ABOVE, BETWEEN, BELOW, SHORT, ALIVE = range(7)
"""Columns of a family: launched up; arrives down; vertices above; passes between the ends; vertices below; whether its
range at the end of the last interval was shorter than asked for; whether it may still have rays."""
COLUMNS = 7

FIRST, UPPER_END, LOWER_END, LAST, ON_SURFACE, ON_BED, DESCENDS, NODE_UP, NODE_DOWN = range(9)
"""Columns of Chain.at: nodes of the chain (its first, those at the upper and the lower end, its last); whether it ends
on surface and bed; whether the start is the upper end; the next nodes of the profile above and below the chain."""
Z_UP, Z_TOP, Z_BOTTOM, Z_DOWN, GRADIENT_UP, GRADIENT_DOWN, FASTEST, SLOWEST, AFTER = range(9)
"""Columns of Chain.of: depths (m) of those nodes; inverse gradients (s) of the layers beyond the chain, 0 on a boundary;
fastest and slowest speed in the chain (m/s), and the speed at which its vertices next change layer."""
SLOTS = 9


class Chain(NamedTuple):
    """The water between the vertices of a ray, and room to work in."""

    c: Floats  # (node,) m/s
    d: Floats  # (node,) m2/s2: (c_m - c)(c_m + c), c_m the fastest
    k: Floats  # (layer,) m2/s: crossings dz (c1 + c2) of one family
    dz: Floats  # (layer,) m
    crossings: Floats  # (layer,) of one family
    at: Ints  # (SLOTS,)
    of: Floats  # (SLOTS,)
    stack: Floats
    roots: Floats  # (root, 2)


@njit(cache=True, error_model="numpy", nogil=True)
def list_families(vertices: int, start_on_top: bool, family: Ints) -> None:
    """Fill family (2 vertices, COLUMNS): those launched down, then up, with 1, 2, ... vertices."""
    for n in range(1, vertices + 1):
        for up in range(2):
            row = 2 * (n - 1) + up
            towards = (up == 0) == start_on_top  # launched towards the depth of the other end
            family[row, UP] = up
            family[row, DOWN] = (n + 1 + up) % 2
            family[row, BELOW] = (n + 1 - up) // 2
            family[row, ABOVE] = n - family[row, BELOW]
            family[row, BETWEEN] = 2 * (n // 2) + 1 if towards else 2 * ((n - 1) // 2) + 1
            family[row, SHORT], family[row, ALIVE] = 0, 1


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


@njit(cache=True, error_model="numpy", nogil=True)
def families_of_pair(
    depth: Floats, speed: Floats, start: float, end: float, distance: float, reflections: int, steepest: float,
    family: Ints, chain: Chain, out: Floats, row: int,
) -> int:  # fmt: skip
    """Rays of a pair with a vertex or more, into rows of out: their number, -1 when it is full.

    family: as `list_families` fills it; reflections: most from surface and bed together; steepest: tangent, at the
    slowest depth of the water, of the steepest ray that turns anywhere.
    """
    of = chain.of
    begin(depth, speed, start, end, chain)
    list_families(len(family) // 2, chain.at[DESCENDS] == 1, family)
    fresh, count = True, 0
    while True:
        of[AFTER] = math.inf
        joined_up, joined_down = extend_up(depth, speed, chain) <= 1, extend_down(depth, speed, chain) <= 1
        some = 0
        if possible(distance, reflections, steepest, family, chain):
            some = search(
                distance, joined_up and not fresh, joined_down and not fresh, fresh, family, chain, out, row + count
            )
        if some < 0:
            return -1
        count += some
        if of[AFTER] == math.inf or family[:, ALIVE].sum() == 0:
            return count
        of[FASTEST], fresh = of[AFTER], False


@njit(cache=True, error_model="numpy", nogil=True)
def possible(distance: float, reflections: int, steepest: float, family: Ints, chain: Chain) -> bool:
    """Whether any family may have a ray with vertices where the chain now ends; others are marked."""
    at, of = chain.at, chain.of
    after, slowest = of[AFTER], of[SLOWEST]
    farthest = distance * math.sqrt((after - slowest) * (after + slowest)) / slowest if after < math.inf else math.inf
    found = False
    for f in range(len(family)):
        if family[f, ALIVE] == 0:
            continue
        above, between, below = family[f, ABOVE], family[f, BETWEEN], family[f, BELOW]
        height = 2 * above * (of[Z_TOP] - of[Z_UP]) + 2 * below * (of[Z_DOWN] - of[Z_BOTTOM])
        height += between * (of[Z_BOTTOM] - of[Z_TOP])
        reflected = above * at[ON_SURFACE] + below * at[ON_BED]
        if reflected > reflections or (reflections == 0 and height > distance * steepest):
            family[f, ALIVE] = 0
        elif height > farthest:
            family[f, SHORT] = 0  # even the steepest ray comes farther
        else:
            found = found or height > 0.0 or after < math.inf
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def search(
    distance: float, joined_up: bool, joined_down: bool, fresh: bool, family: Ints, chain: Chain, out: Floats, row: int
) -> int:
    """Rays of all families with vertices where the chain now ends, into rows of out: their number, -1 when it is full.

    joined_up, joined_down: the range goes on without a jump from that of the interval before.
    """
    at, of, d = chain.at, chain.of, chain.d
    offsets(chain.c, at[FIRST], at[LAST], of[FASTEST], d)
    bounded = of[AFTER] < math.inf
    extent = math.sqrt((of[AFTER] - of[FASTEST]) * (of[AFTER] + of[FASTEST])) if bounded else GRAZING
    upper = leg(GRAZING, extent, chain.c, chain.dz, d, at[FIRST], at[UPPER_END])
    middle = leg(GRAZING, extent, chain.c, chain.dz, d, at[UPPER_END], at[LOWER_END])
    lower = leg(GRAZING, extent, chain.c, chain.dz, d, at[LOWER_END], at[LAST])
    over = turn(GRAZING, extent, d[at[FIRST]], of[GRADIENT_UP])
    under = turn(GRAZING, extent, d[at[LAST]], of[GRADIENT_DOWN])
    count = 0
    for f in range(len(family)):
        if family[f, ALIVE] == 0:
            continue
        a, b, e = family[f, ABOVE], family[f, BETWEEN], family[f, BELOW]
        full1 = 2 * a * upper[0] + b * middle[0] + 2 * e * lower[0]
        full2 = 2 * a * upper[1] + b * middle[1] + 2 * e * lower[1]
        turn1, turn2 = a * over[0] + e * under[0], a * over[1] + e * under[1]
        joined = (a == 0 or joined_up) and (e == 0 or joined_down)
        short = family[f, SHORT] == 1 if joined and not fresh else full1 + turn1 < distance
        ends_short = full2 + turn2 < distance
        family[f, SHORT] = ends_short
        if bounded and short == ends_short:
            fall_least = 2 * a * upper[2] + b * middle[2] + 2 * e * lower[2]
            fall_largest = 2 * a * upper[3] + b * middle[3] + 2 * e * lower[3]
            rises = a * over[2] + e * under[2] > fall_largest
            falls = a * over[3] + e * under[3] < fall_least
            if rises or falls or full2 + turn1 > distance or full1 + turn2 < distance:
                continue
        if bounded or not short:
            some = roots_of(f, distance, short, extent, bounded, family, chain, out, row + count)
            if some < 0:
                return -1
            count += some
    return count


@njit(cache=True, error_model="numpy", nogil=True)
def roots_of(
    f: int,
    distance: float,
    short: bool,
    extent: float,
    bounded: bool,
    family: Ints,
    chain: Chain,
    out: Floats,
    row: int,
) -> int:
    """Rays of one family into rows of out: their number, -1 when it is full."""
    at, of, roots = chain.at, chain.of, chain.roots
    above, between, below = family[f, ABOVE], family[f, BETWEEN], family[f, BELOW]
    first = at[FIRST] if above else at[UPPER_END]
    last = at[LAST] if below else at[LOWER_END]
    for i in range(first, last):
        times = 2 * above if i < at[UPPER_END] else (between if i < at[LOWER_END] else 2 * below)
        chain.crossings[i] = times
        chain.k[i] = times * chain.dz[i] * (chain.c[i] + chain.c[i + 1])
    turn_up, turn_down = above * of[GRADIENT_UP], below * of[GRADIENT_DOWN]
    if bounded:
        found = turns(
            short, of[FASTEST], extent, distance, chain.d, chain.k, first, last, turn_up, turn_down, chain.stack, roots
        )
    else:
        if first == last:
            return 0  # from a boundary to itself
        _, roots[0, 0], roots[0, 1] = straight(distance, of[FASTEST], chain.d, chain.k, first, last, True)
        found = 1
    if row + found > len(out):
        return -1
    for i in range(found):
        keep(family, f, chain, first, last, distance, roots[i, 0], roots[i, 1], out, row + i)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def keep(
    family: Ints,
    f: int,
    chain: Chain,
    first: int,
    last: int,
    distance: float,
    s_m: float,
    p: float,
    out: Floats,
    row: int,
) -> None:
    """Write a ray of a family."""
    at, of, c, d = chain.at, chain.of, chain.c, chain.d
    above, below = family[f, ABOVE], family[f, BELOW]
    turning = (0 if at[ON_SURFACE] else above) + (0 if at[ON_BED] else below)
    start, end = (at[UPPER_END], at[LOWER_END]) if at[DESCENDS] else (at[LOWER_END], at[UPPER_END])
    emit(
        out, row, s_m, p, distance, c, d, chain.k, chain.dz, chain.crossings, first, last,
        above * of[GRADIENT_UP], below * of[GRADIENT_DOWN], start, end, turning,
    )  # fmt: skip
    out[row, SURFACE], out[row, BOTTOM] = above * at[ON_SURFACE], below * at[ON_BED]
    if above:  # 1/p - c = h^2/(1/p + c)
        rise = (s_m * s_m + p * p * d[first]) / (p * (1.0 + p * c[first]))
        out[row, UPPER] = of[Z_UP] - rise * of[GRADIENT_UP]
    if below:
        rise = (s_m * s_m + p * p * d[last]) / (p * (1.0 + p * c[last]))
        out[row, LOWER] = of[Z_DOWN] + rise * of[GRADIENT_DOWN]
    out[row, START_SINE] *= 1.0 if family[f, UP] else -1.0
    out[row, END_SINE] *= -1.0 if family[f, DOWN] else 1.0
