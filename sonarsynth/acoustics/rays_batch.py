"""All eigenrays of the direct family for a batch of pairs of ends, compiled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from sonarsynth.acoustics.rays_chain import GRAZING, lay, node_above, offsets, speed_at, sweep
from sonarsynth.acoustics.rays_layers import atanhc
from sonarsynth.acoustics.rays_rows import FIELDS, TURN, emit, emit_level, face, sort_by_time
from sonarsynth.acoustics.rays_search import straight, turns
from sonarsynth.conventions import Floats, Ints

__all__ = ["FIELDS", "mean_slowness", "rays_of_pairs"]

ROOTS = 64  # room for rays that turn in one layer
SAME_DEPTH = 1e-140  # m: depths that differ by less are equal


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
    depth: Floats, speed: Floats, top: float, bottom: float, c: Floats, k: Floats, dz: Floats, crossings: Floats
) -> tuple[int, int, float, float, bool]:
    """Lay the chain from `top` to `bottom` for rays that go on down: (n, node, fastest, slowest speed, joined).

    node: at or above `bottom`; joined: the range of turning rays goes on from that of the straight ray without a jump.
    """
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
    steepest: float,
    c: Floats,
    d: Floats,
    k: Floats,
    dz: Floats,
    crossings: Floats,
    stack: Floats,
    roots: Floats,
    out: Floats,
    row: int,
) -> int:
    """Rays from `top` down through `bottom`, turned below it, and up to `bottom`, into rows of out; -1 when it is full.

    reached: whether the ray straight between the ends reaches the distance; steepest: tangent of a turning ray's.
    """
    n, j, fastest, slowest, joined = lay_to_turn(depth, speed, top, bottom, c, k, dz, crossings)
    end, z, count, below = n, bottom, 0, top == bottom or not reached
    while j < len(depth) - 1 and 2.0 * z - top - bottom <= distance * steepest:
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
                found, below = turns(below, fastest, extent, distance, d, k, n, inverse_gradient, stack, roots)
                if row + count + found > len(out):
                    return -1
                for i in range(found):
                    s_m, p = roots[i, 0], roots[i, 1]
                    rise = (s_m * s_m + p * p * d[n]) / (p * (1.0 + p * c[n]))  # h^2/(1/p + c) = 1/p - c
                    turn = z + rise * inverse_gradient
                    emit(out, row + count, s_m, p, distance, c, d, k, dz, crossings, n, end, inverse_gradient, turn)
                    count += 1
            fastest = after
        joined = turned
        dz[n], crossings[n] = depth[j + 1] - z, 2.0
        k[n] = 2.0 * dz[n] * (c[n] + after)
        c[n + 1] = after
        slowest = min(slowest, after)
        n, j, z = n + 1, j + 1, depth[j + 1]
    return count


@njit(cache=True, error_model="numpy", nogil=True)
def straight_of_pair(
    depth: Floats,
    speed: Floats,
    start: float,
    end: float,
    distance: float,
    c: Floats,
    d: Floats,
    k: Floats,
    dz: Floats,
    crossings: Floats,
    out: Floats,
    row: int,
) -> int:
    """The ray of a pair that does not turn, if there is one, into a row of out: their number."""
    top, bottom = min(start, end), max(start, end)
    if bottom - top < SAME_DEPTH:
        level = level_speed(depth, speed, bottom)
        if distance == 0.0:
            level = speed_at(depth, speed, node_above(depth, bottom), bottom)
        if math.isnan(level):
            return 0
        emit_level(out, row, distance, level)
        return 1
    n = lay(depth, speed, top, bottom, c, k, dz)
    fastest = c[0]
    for i in range(n):
        crossings[i] = 1.0
        fastest = max(fastest, c[i + 1])
    offsets(c, n, fastest, d)
    found, s_m, p = straight(distance, fastest, d, k, n)
    if not found:
        return 0
    emit(out, row, s_m, p, distance, c, d, k, dz, crossings, n, n, 0.0, math.nan)
    face(out, row, -1.0, -1.0, start > end)
    return 1


@njit(cache=True, error_model="numpy", nogil=True)
def turning_of_pair(
    depth: Floats,
    speed: Floats,
    start: float,
    end: float,
    distance: float,
    reached: bool,
    steepest: float,
    down: float,
    c: Floats,
    d: Floats,
    k: Floats,
    dz: Floats,
    crossings: Floats,
    stack: Floats,
    roots: Floats,
    out: Floats,
    row: int,
) -> int:
    """Rays of a pair turned below both ends (down = 1), or above both (down = -1, in mirrored water): number or -1."""
    top, bottom = min(down * start, down * end), max(down * start, down * end)
    if bottom - top < SAME_DEPTH:
        top = bottom
    found = turning(
        depth, speed, top, bottom, distance, reached, steepest, c, d, k, dz, crossings, stack, roots, out, row
    )
    for i in range(row, row + found):
        out[i, TURN] *= down
        face(out, i, -down, down, down * start > down * end)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def rays_of_pairs(
    depth: Floats,
    speed: Floats,
    mirrored_depth: Floats,
    mirrored_speed: Floats,
    start: Floats,
    end: Floats,
    distance: Floats,
    first: int,
    pair: Ints,
    out: Floats,
) -> tuple[int, int]:
    """All direct rays of the pairs from `first` on, into pair and out: how many, and the pair where the room ended."""
    room = 2 * len(depth) + 8
    c, d, k, dz, crossings = np.empty(room), np.empty(room), np.empty(room), np.empty(room), np.empty(room)
    stack, roots = np.empty(64), np.empty((ROOTS, 2))
    slowest, fastest = speed.min(), speed.max()
    steepest = math.sqrt((fastest - slowest) * (fastest + slowest)) / slowest  # tangent of any ray that turns
    count = 0
    for i in range(first, len(start)):
        if count == len(out):
            return count, i
        z1, z2, r = start[i], end[i], distance[i]
        found = straight_of_pair(depth, speed, z1, z2, r, c, d, k, dz, crossings, out, count)
        reached = found > 0
        if r > 0.0 and fastest > slowest and abs(z2 - z1) <= r * steepest:
            row = count + found
            below = turning_of_pair(
                depth,
                speed,
                z1,
                z2,
                r,
                reached,
                steepest,
                1.0,
                c,
                d,
                k,
                dz,
                crossings,
                stack,
                roots,
                out,
                row,
            )
            if below < 0:
                return count, i
            found += below
            row = count + found
            above = turning_of_pair(
                mirrored_depth,
                mirrored_speed,
                z1,
                z2,
                r,
                reached,
                steepest,
                -1.0,
                c,
                d,
                k,
                dz,
                crossings,
                stack,
                roots,
                out,
                row,
            )
            if above < 0:
                return count, i
            found += above
            sort_by_time(out, count, found)
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
