"""All eigenrays of the direct family for a batch of pairs of ends, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sonarsynth.acoustics.rays_chain import GRAZING, lay, node_above, offsets, speed_at, sweep, whole
from sonarsynth.acoustics.rays_layers import atanhc
from sonarsynth.acoustics.rays_search import straight, turns
from sonarsynth.conventions import Floats, Ints

FIELDS = 11
TIME, LENGTH, SLOWNESS, START_SINE, END_SINE, START_SPEED, END_SPEED, AMPLITUDE, TURN, CAUSTICS, FLAG = range(FIELDS)
"""Columns of a found ray: s, m, s/m, sines (up positive), m/s, 1/m, depth (m; NaN without a turn), caustics, flag."""

COINCIDENT, CAUSTIC, PASSED = 1.0, 2.0, 3.0
FOCUSED = 10.0  # times spherical spreading (20 dB): from here on the amplitude of ray theory is not to be trusted
ROOTS = 64  # room for rays that turn in one layer
Water = tuple[Floats, Floats, Floats, Floats, float, float]
"""Depth and speed at nodes; both again upside down (depth negative); slowest and fastest speed."""
Chain = tuple[Floats, Floats, Floats, Floats, Floats]
"""Room for a chain (`rays_chain`): speeds c, offsets d, k, thickness dz and crossings of its layers."""
Scratch = tuple[Floats, Floats]
"""Room for the search: intervals left, and roots found in one layer."""
SAME_DEPTH = 1e-140  # m: depths that differ by less are equal


@njit(cache=True, error_model="numpy", nogil=True)
def emit(
    row: Floats,
    s_m: float,
    p: float,
    distance: float,
    chain: Chain,
    n: int,
    end: int,
    inverse_gradient: float,
    turn: float,
) -> None:
    """Write a found ray: its ends are the chain's nodes 0 and `end`, its sines without sign; turn: depth, or NaN.

    T = tau + p R with tau = T(p) - p X(p) is right to second order. The amplitude in water of one density is that of
    the ray tube, A^2 = c_s c_r / ((X/p) |dX/dp| s_s s_r): the pressure at the end over that at 1 m from the start; it
    is the same both ways, and 1/r in isovelocity water.
    """
    c, d, k, dz, crossings = chain
    over_p, slope, time, length = whole(s_m, p, c, d, k, dz, crossings, n, inverse_gradient)
    first, last = math.sqrt(s_m * s_m + p * p * d[0]), math.sqrt(s_m * s_m + p * p * d[end])
    row[TIME] = time + p * (distance - p * over_p)
    row[LENGTH] = length
    row[SLOWNESS] = p
    row[START_SINE], row[END_SINE] = first, last
    row[START_SPEED], row[END_SPEED] = c[0], c[end]
    row[AMPLITUDE] = math.sqrt(c[0] * c[end] / (over_p * abs(slope) * first * last))
    row[TURN] = turn
    row[CAUSTICS] = 1.0 if slope > 0.0 and not math.isnan(turn) else 0.0
    row[FLAG] = CAUSTIC if row[AMPLITUDE] * length > FOCUSED else PASSED * row[CAUSTICS]


@njit(cache=True, error_model="numpy", nogil=True)
def emit_level(row: Floats, distance: float, c: float) -> None:
    """A horizontal ray in a layer of one speed, or coincident ends."""
    row[TIME], row[LENGTH], row[SLOWNESS] = distance / c, distance, 1.0 / c
    row[START_SINE] = row[END_SINE] = 0.0 if distance > 0.0 else math.nan
    row[START_SPEED] = row[END_SPEED] = c
    row[AMPLITUDE] = 1.0 / distance
    row[TURN] = math.nan
    row[CAUSTICS] = 0.0
    row[FLAG] = 0.0 if distance > 0.0 else COINCIDENT


@njit(cache=True, error_model="numpy", nogil=True)
def level_speed(depth: Floats, speed: Floats, z: float) -> float:
    """Speed of the layer of one speed at z (below first, then above); NaN where there is none."""
    j = node_above(depth, z)
    if j < len(depth) - 1 and speed[j] == speed[j + 1]:
        return float(speed[j])
    while j > 0 and depth[j] >= z:
        j -= 1
    if depth[j] < z <= depth[j + 1] and speed[j] == speed[j + 1]:
        return float(speed[j])
    return math.nan


@njit(cache=True, error_model="numpy", nogil=True)
def lay_to_turn(
    depth: Floats, speed: Floats, top: float, bottom: float, chain: Chain
) -> tuple[int, int, float, float, bool]:
    """Lay the chain from `top` to `bottom` for rays that go on down: (n, node, fastest, slowest speed, joined).

    node: at or above `bottom`; joined: the range of turning rays goes on from that of the straight ray without a jump.
    """
    c, _, k, dz, crossings = chain
    n = lay(depth, speed, top, bottom, c, k, dz)
    node = node_above(depth, bottom)
    at_end = speed_at(depth, speed, node, bottom)
    fastest = slowest = c[0]
    for i in range(n):
        crossings[i] = 1.0
        fastest, slowest = max(fastest, c[i + 1]), min(slowest, c[i + 1])
    joined = fastest == c[n]
    if c[n] != at_end:  # a jump at the end: the ray goes down from its lower side
        c[n + 1], k[n], dz[n], crossings[n] = at_end, 0.0, 0.0, 1.0
        n += 1
        fastest, slowest, joined = max(fastest, at_end), min(slowest, at_end), False
    return n, node, fastest, slowest, joined


@njit(cache=True, error_model="numpy", nogil=True)
def turning(
    depth: Floats,
    speed: Floats,
    top: float,
    bottom: float,
    distance: float,
    reached: bool,
    chain: Chain,
    scratch: Scratch,
    out: Floats,
) -> int:
    """Rays from `top` down through `bottom`, turned below it, and up to `bottom`: rows of out; -1 when it is full.

    reached: whether the ray straight between the ends reaches the distance.
    """
    c, d, k, dz, crossings = chain
    n, j, fastest, slowest, joined = lay_to_turn(depth, speed, top, bottom, chain)
    end, z, count, below = n, bottom, 0, top == bottom or not reached
    while j < len(depth) - 1:
        after = speed[j + 1]
        turned = after > fastest
        if turned:
            inverse_gradient = (depth[j + 1] - z) / (after - c[n])
            if (2.0 * z - top - bottom) * slowest > distance * math.sqrt((after - slowest) * (after + slowest)):
                below = False  # even the flattest ray is too steep to come this far
            else:
                offsets(c, n, fastest, d)
                if not joined:
                    below = sweep(GRAZING, 1.0 / fastest, d, k, n, inverse_gradient)[0] / fastest < distance
                extent = math.sqrt((after - fastest) * (after + fastest))
                found, below = turns(
                    below, fastest, extent, distance, d, k, n, inverse_gradient, scratch[0], scratch[1]
                )
                if count + found > len(out):
                    return -1
                for i in range(found):
                    emit_turned(out[count + i], scratch[1][i], distance, chain, n, end, inverse_gradient, z)
                count += found
            fastest = after
        joined = turned
        dz[n], crossings[n] = depth[j + 1] - z, 2.0
        k[n] = 2.0 * dz[n] * (c[n] + after)
        c[n + 1] = after
        slowest = min(slowest, after)
        n += 1
        j += 1
        z = depth[j]
    return count


@njit(cache=True, error_model="numpy", nogil=True)
def emit_turned(
    row: Floats, root: Floats, distance: float, chain: Chain, n: int, end: int, inverse_gradient: float, z: float
) -> None:
    """Write a ray found by `turns` in the layer that begins at depth z."""
    s_m, p = root[0], root[1]
    rise = (s_m * s_m + p * p * chain[1][n]) / (p * (1.0 + p * chain[0][n]))  # h^2/(1/p + c) = 1/p - c
    emit(row, s_m, p, distance, chain, n, end, inverse_gradient, z + rise * inverse_gradient)


@njit(cache=True, error_model="numpy", nogil=True)
def swap_ends(row: Floats) -> None:
    """The same ray from its other end."""
    row[START_SINE], row[END_SINE] = row[END_SINE], row[START_SINE]
    row[START_SPEED], row[END_SPEED] = row[END_SPEED], row[START_SPEED]


@njit(cache=True, error_model="numpy", nogil=True)
def straight_of_pair(
    depth: Floats, speed: Floats, start: float, end: float, distance: float, chain: Chain, out: Floats
) -> int:
    """The ray of a pair that does not turn, if there is one: their number."""
    top, bottom = min(start, end), max(start, end)
    if bottom - top < SAME_DEPTH:
        level = level_speed(depth, speed, bottom)
        if distance == 0.0:
            level = speed_at(depth, speed, node_above(depth, bottom), bottom)
        if math.isnan(level):
            return 0
        emit_level(out[0], distance, level)
        return 1
    c, d, k, dz, crossings = chain
    n = lay(depth, speed, top, bottom, c, k, dz)
    fastest = c[0]
    for i in range(n):
        crossings[i] = 1.0
        fastest = max(fastest, c[i + 1])
    offsets(c, n, fastest, d)
    found, s_m, p = straight(distance, fastest, d, k, n)
    if not found:
        return 0
    emit(out[0], s_m, p, distance, chain, n, n, 0.0, math.nan)
    if start > end:
        swap_ends(out[0])
    sign = -1.0 if start < end else 1.0
    out[0, START_SINE] *= sign
    out[0, END_SINE] *= sign
    return 1


@njit(cache=True, error_model="numpy", nogil=True)
def turning_of_pair(
    depth: Floats,
    speed: Floats,
    start: float,
    end: float,
    distance: float,
    reached: bool,
    down: float,
    chain: Chain,
    scratch: Scratch,
    out: Floats,
) -> int:
    """Rays of a pair turned below both ends (down = 1), or above both (down = -1, in mirrored water): number or -1."""
    top, bottom = min(down * start, down * end), max(down * start, down * end)
    if bottom - top < SAME_DEPTH:
        top = bottom
    found = turning(depth, speed, top, bottom, distance, reached, chain, scratch, out)
    for i in range(found):
        row = out[i]
        row[TURN] *= down
        if down * start > down * end:
            swap_ends(row)
        row[START_SINE] *= -down
        row[END_SINE] *= down
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def rays_of_pair(
    water: Water, start: float, end: float, distance: float, chain: Chain, scratch: Scratch, out: Floats
) -> int:
    """All direct rays of one pair into the rows of out, by travel time; their number, -1 when there is no room."""
    depth, speed, mirrored_depth, mirrored_speed, slowest, fastest = water
    if len(out) == 0:
        return -1
    count = straight_of_pair(depth, speed, start, end, distance, chain, out)
    reached = count > 0
    steep = abs(end - start) * slowest > distance * math.sqrt((fastest - slowest) * (fastest + slowest))
    if steep or fastest == slowest or distance == 0.0:
        return count  # no ray of this water turns so soon
    found = turning_of_pair(depth, speed, start, end, distance, reached, 1.0, chain, scratch, out[count:])
    if found < 0:
        return -1
    count += found
    found = turning_of_pair(
        mirrored_depth, mirrored_speed, start, end, distance, reached, -1.0, chain, scratch, out[count:]
    )
    if found < 0:
        return -1
    count += found
    for i in range(1, count):  # insertion by travel time: a handful of rays
        j = i
        while j > 0 and out[j, TIME] < out[j - 1, TIME]:
            for f in range(FIELDS):
                out[j, f], out[j - 1, f] = out[j - 1, f], out[j, f]
            j -= 1
    return count


@njit(cache=True, error_model="numpy", nogil=True)
def rays_of_pairs(
    water: Water, start: Floats, end: Floats, distance: Floats, first: int, pair: Ints, out: Floats
) -> tuple[int, int]:
    """All direct rays of the pairs from `first` on, into pair and out: how many, and the pair where the room ended."""
    room = 2 * len(water[0]) + 8
    chain = np.empty(room), np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    scratch = np.empty(64), np.empty((ROOTS, 2))
    count = 0
    for i in range(first, len(start)):
        found = rays_of_pair(water, start[i], end[i], distance[i], chain, scratch, out[count:])
        if found < 0:
            return count, i
        pair[count : count + found] = i
        count += found
    return count, len(start)


@njit(cache=True, error_model="numpy", nogil=True)
def mean_slowness(depth: Floats, speed: Floats, start: Floats, end: Floats, out: Floats) -> None:
    """Mean of 1/c (s/m) over the depths between the ends of each pair: what a straight line takes a metre."""
    work = np.empty((3, len(depth) + 8))
    c, k, dz = work[0], work[1], work[2]
    for i in range(len(start)):
        top, bottom = min(start[i], end[i]), max(start[i], end[i])
        n = lay(depth, speed, top, bottom, c, k, dz)
        out[i] = 1.0 / c[0]
        if n > 0:
            total = 0.0
            for j in range(n):
                total += 2.0 * dz[j] / (c[j] + c[j + 1]) * atanhc((c[j + 1] - c[j]) / (c[j + 1] + c[j]))
            out[i] = total / (bottom - top)
