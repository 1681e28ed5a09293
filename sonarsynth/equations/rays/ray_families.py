"""The families of rays between two points: every way to go up and down between an upper and a lower vertex.

A ray keeps p, so it goes up and down between two vertices above and below both ends, each a boundary or the depth where
c = 1/p. A family is a launch direction and a number of vertices: it says how often the ray passes above, between and
below the ends. As c = 1/p grows from the fastest speed between the ends to infinity, vertices move out, from layer to
layer and at last to surface and bottom. In each interval of c in which neither changes layer, the range of every family
is a sum of the same three legs (above, between, below), so the legs are summed once for all families.
"""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import GRAZING, leg, offsets, turn
from sonarsynth.equations.rays.ray_rows import BOTTOM, END_SINE, LOWER, START_SINE, SURFACE, UPPER, emit
from sonarsynth.equations.rays.ray_search import straight, turns
from sonarsynth.equations.rays.ray_vertices import (
    AFTER,
    DESCENDS,
    FASTEST,
    FIRST,
    GRADIENT_DOWN,
    GRADIENT_UP,
    LAST,
    LOWER_END,
    ON_BED,
    ON_SURFACE,
    SLOWEST,
    UPPER_END,
    Z_BOTTOM,
    Z_DOWN,
    Z_TOP,
    Z_UP,
    Chain,
    begin,
    extend_down,
    extend_up,
)

UP, DOWN, ABOVE, BETWEEN, BELOW, SHORT, ALIVE = range(7)
"""Columns of a family: launched up; arrives down; vertices above; passes between the ends; vertices below; whether its
range at the end of the last interval was shorter than asked for; whether it may still have rays."""
COLUMNS = 7


@compiled(borrows=True)
def family_of(up: int, vertices: int, descends: bool, family: Ints, row: int) -> None:
    """Fill a row of family (row, COLUMNS): launched up or down, with so many vertices, towards a deeper end or not."""
    towards = (up == 0) == descends  # launched towards the depth of the other end
    family[row, UP] = up
    family[row, DOWN] = (vertices + 1 + up) % 2
    family[row, BELOW] = (vertices + 1 - up) // 2
    family[row, ABOVE] = vertices - family[row, BELOW]
    family[row, BETWEEN] = 2 * (vertices // 2) + 1 if towards else 2 * ((vertices - 1) // 2) + 1
    family[row, SHORT], family[row, ALIVE] = 0, 1


@compiled(borrows=True)
def families_of_pair(
    depth: Floats, speed: Floats, start: float, end: float, distance: float, reflections: int, steepest: float,
    family: Ints, chain: Chain, out: Floats, row: int,
) -> int:  # fmt: skip
    """Rays of a pair with a vertex or more, into rows of out: their number, -1 when it is full.

    family (2 vertices, COLUMNS): room for their list; reflections: most from surface and bottom together; steepest:
    tangent, at the slowest depth of the water, of the steepest ray that turns anywhere.
    """
    reals = chain.reals
    begin(depth, speed, start, end, chain)
    for f in range(len(family)):  # launched down, then up, with 1, 2, ... vertices
        family_of(f % 2, 1 + f // 2, chain.ints[DESCENDS] == 1, family, f)
    fresh, count = True, 0
    while True:
        reals[AFTER] = math.inf
        joined_up, joined_down = extend_up(depth, speed, chain) <= 1, extend_down(depth, speed, chain) <= 1
        ray_count = 0
        if possible(distance, reflections, steepest, family, chain):
            ray_count = search(
                distance, joined_up and not fresh, joined_down and not fresh, fresh, family, chain, out, row + count
            )
        if ray_count < 0:
            return -1
        count += ray_count
        if reals[AFTER] == math.inf or family[:, ALIVE].sum() == 0:
            return count
        reals[FASTEST], fresh = reals[AFTER], False


@compiled(borrows=True)
def possible(distance: float, reflections: int, steepest: float, family: Ints, chain: Chain) -> bool:
    """Whether any family may have a ray with vertices where the chain now ends; others are marked."""
    ints, reals = chain.ints, chain.reals
    after, slowest = reals[AFTER], reals[SLOWEST]
    farthest = distance * math.sqrt((after - slowest) * (after + slowest)) / slowest if after < math.inf else math.inf
    any_possible = False
    for f in range(len(family)):
        if family[f, ALIVE] == 0:
            continue
        above, between, below = family[f, ABOVE], family[f, BETWEEN], family[f, BELOW]
        height = 2 * above * (reals[Z_TOP] - reals[Z_UP]) + 2 * below * (reals[Z_DOWN] - reals[Z_BOTTOM])
        height += between * (reals[Z_BOTTOM] - reals[Z_TOP])
        reflected = above * ints[ON_SURFACE] + below * ints[ON_BED]
        if reflected > reflections or (reflections == 0 and height > distance * steepest):
            family[f, ALIVE] = 0
        elif height > farthest:
            family[f, SHORT] = 0  # even the steepest ray comes farther
        else:
            any_possible = any_possible or height > 0.0 or after < math.inf
    return any_possible


@compiled(borrows=True)
def sum_legs(chain: Chain, extent: float) -> None:
    """Sum the legs of the chain for rays with v = c_m tan(grazing angle) up to `extent`."""
    ints, reals, d, sums = chain.ints, chain.reals, chain.d, chain.sums
    offsets(chain.c, ints[FIRST], ints[LAST], reals[FASTEST], d)
    sums[0] = leg(GRAZING, extent, chain.c, chain.dz, d, ints[FIRST], ints[UPPER_END])
    sums[1] = leg(GRAZING, extent, chain.c, chain.dz, d, ints[UPPER_END], ints[LOWER_END])
    sums[2] = leg(GRAZING, extent, chain.c, chain.dz, d, ints[LOWER_END], ints[LAST])
    sums[3] = turn(GRAZING, extent, d[ints[FIRST]], reals[GRADIENT_UP])
    sums[4] = turn(GRAZING, extent, d[ints[LAST]], reals[GRADIENT_DOWN])


@compiled(borrows=True)
def full(family: Ints, f: int, sums: Floats, column: int) -> float:
    """A sum over the full layers that a family crosses."""
    row = family[f]
    return float(2 * row[ABOVE] * sums[0, column] + row[BETWEEN] * sums[1, column] + 2 * row[BELOW] * sums[2, column])


@compiled(borrows=True)
def turned(family: Ints, f: int, sums: Floats, column: int) -> float:
    """A sum over the layers that a family turns in."""
    return float(family[f, ABOVE] * sums[3, column] + family[f, BELOW] * sums[4, column])


@compiled(borrows=True)
def search(
    distance: float, joined_up: bool, joined_down: bool, fresh: bool, family: Ints, chain: Chain, out: Floats, row: int
) -> int:
    """Rays of all families with vertices where the chain now ends, into rows of out: their number, -1 when it is full.

    joined_up, joined_down: the range goes on without a jump from that of the interval before.
    """
    reals, sums = chain.reals, chain.sums
    bounded = reals[AFTER] < math.inf
    extent = math.sqrt((reals[AFTER] - reals[FASTEST]) * (reals[AFTER] + reals[FASTEST])) if bounded else GRAZING
    sum_legs(chain, extent)
    count = 0
    for f in range(len(family)):
        if family[f, ALIVE] == 0:
            continue
        full1, full2 = full(family, f, sums, 0), full(family, f, sums, 1)
        turn1, turn2 = turned(family, f, sums, 0), turned(family, f, sums, 1)
        joined = (family[f, ABOVE] == 0 or joined_up) and (family[f, BELOW] == 0 or joined_down)
        short = family[f, SHORT] == 1 if joined and not fresh else full1 + turn1 < distance
        family[f, SHORT] = full2 + turn2 < distance
        if bounded and short == (family[f, SHORT] == 1):
            rises = turned(family, f, sums, 2) > full(family, f, sums, 3)
            falls = turned(family, f, sums, 3) < full(family, f, sums, 2)
            if rises or falls or full2 + turn1 > distance or full1 + turn2 < distance:
                continue
        if bounded or not short:
            root_count = roots_of(f, distance, short, extent, bounded, family, chain, out, row + count)
            if root_count < 0:
                return -1
            count += root_count
    return count


@compiled(borrows=True)
def weigh(above: int, between: int, below: int, first: int, last: int, chain: Chain) -> None:
    """How often a family crosses each layer from node first to last, and its weighted chain."""
    ints = chain.ints
    for i in range(first, last):
        times = 2 * above if i < ints[UPPER_END] else (between if i < ints[LOWER_END] else 2 * below)
        chain.crossings[i] = times
        chain.k[i] = times * chain.dz[i] * (chain.c[i] + chain.c[i + 1])


@compiled(borrows=True)
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
    ints, reals, roots, fastest = chain.ints, chain.reals, chain.roots, chain.reals[FASTEST]
    above, below = family[f, ABOVE], family[f, BELOW]
    first = ints[FIRST] if above else ints[UPPER_END]
    last = ints[LAST] if below else ints[LOWER_END]
    weigh(above, family[f, BETWEEN], below, first, last, chain)
    root_count = 1
    if bounded:
        turn_up, turn_down = above * reals[GRADIENT_UP], below * reals[GRADIENT_DOWN]
        root_count = turns(
            short, fastest, extent, distance, chain.d, chain.k, first, last, turn_up, turn_down, chain.stack, roots
        )
    elif first == last:
        return 0  # from a boundary to itself
    else:
        _, roots[0, 0], roots[0, 1] = straight(distance, fastest, chain.d, chain.k, first, last, True)
    if row + root_count > len(out):
        return -1
    for i in range(root_count):
        keep(family, f, chain, first, last, distance, roots[i, 0], roots[i, 1], out, row + i)
    return root_count


@compiled(borrows=True)
def beyond(s_m: float, p: float, c: float, d: float, inverse_gradient: float) -> float:
    """How far (m) beyond a node of speed c a ray turns: (1/p - c)/g, with 1/p - c = h^2/(1/p + c)."""
    if inverse_gradient == 0.0:
        return 0.0
    return float((s_m * s_m + p * p * d) / (p * (1.0 + p * c)) * inverse_gradient)


@compiled(borrows=True)
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
    ints, reals, c, d = chain.ints, chain.reals, chain.c, chain.d
    above, below = family[f, ABOVE], family[f, BELOW]
    turning = (0 if ints[ON_SURFACE] else above) + (0 if ints[ON_BED] else below)
    start, end = (ints[UPPER_END], ints[LOWER_END]) if ints[DESCENDS] else (ints[LOWER_END], ints[UPPER_END])
    emit(
        out, row, s_m, p, distance, c, d, chain.k, chain.dz, chain.crossings, first, last,
        above * reals[GRADIENT_UP], below * reals[GRADIENT_DOWN], start, end, turning,
    )  # fmt: skip
    out[row, SURFACE], out[row, BOTTOM] = above * ints[ON_SURFACE], below * ints[ON_BED]
    if above:
        out[row, UPPER] = reals[Z_UP] - beyond(s_m, p, c[first], d[first], reals[GRADIENT_UP])
    if below:
        out[row, LOWER] = reals[Z_DOWN] + beyond(s_m, p, c[last], d[last], reals[GRADIENT_DOWN])
    out[row, START_SINE] *= 1.0 if family[f, UP] else -1.0
    out[row, END_SINE] *= -1.0 if family[f, DOWN] else 1.0
