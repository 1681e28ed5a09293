"""Eigenrays for a batch of pairs of ends, compiled."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import lay, node_above, offsets, speed_at
from sonarsynth.equations.rays.ray_families import COLUMNS, families_of_pair
from sonarsynth.equations.rays.ray_in_layer import atanhc
from sonarsynth.equations.rays.ray_rows import (
    BOTTOM,
    END_SINE,
    FIELDS,
    LOWER,
    START_SINE,
    START_SPEED,
    SURFACE,
    TURNING,
    UPPER,
    emit,
    emit_level,
    in_columns,
    sort_by_time,
)
from sonarsynth.equations.rays.ray_search import straight
from sonarsynth.equations.rays.ray_vertices import Chain, new_chain

__all__ = ["FIELDS", "in_columns", "mean_slowness", "rays_of_pairs"]

SAME_DEPTH = 1e-140  # m: depths that differ by less are equal
MANY = 64  # layers


@compiled(borrows=True)
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


@compiled(borrows=True)
def straight_of_pair(
    depth: Floats, speed: Floats, start: float, end: float, distance: float, chain: Chain, out: Floats, row: int
) -> int:
    """The ray of a pair without a vertex, if there is one, into a row of out: their number."""
    top, bottom = min(start, end), max(start, end)
    if bottom == top:
        level = level_speed(depth, speed, bottom)
        if distance == 0.0:
            level = speed_at(depth, speed, node_above(depth, bottom), bottom)
        if math.isnan(level):
            return 0
        emit_level(out, row, distance, level)
        return 1
    c, dz = chain.c, chain.dz
    n, _ = lay(depth, speed, top, bottom, c, dz, 0)
    fastest = c[0]
    for i in range(n):
        chain.crossings[i] = 1.0
        chain.k[i] = dz[i] * (c[i] + c[i + 1])
        fastest = max(fastest, c[i + 1])
    offsets(c, 0, n, fastest, chain.d)
    exists, s_m, p = straight(distance, fastest, chain.d, chain.k, 0, n, False)
    if not exists:
        return 0
    first, last = (0, n) if start < end else (n, 0)
    emit(out, row, s_m, p, distance, c, chain.d, chain.k, dz, chain.crossings, 0, n, 0.0, 0.0, first, last, 0)
    sign = -1.0 if start < end else 1.0
    out[row, START_SINE] *= sign
    out[row, END_SINE] *= sign
    return 1


@compiled(borrows=True)
def level_of_pair(
    depth: Floats, speed: Floats, z: float, distance: float, reflections: int, known: int, out: Floats, row: int
) -> int:
    """Rays between two points of one depth that leave it by less than rounding, into rows of out: their number.

    Those along a boundary that are reflected all the way, where there is a level one; those that turn so near that the
    speed there is, rounded, that of the next node: an arc over R rises by R^2 |g|/(8 c).
    """
    if known and (z == 0.0 or z == depth[-1]) and reflections > 0:
        emit_level(out, row, distance, out[row - 1, START_SPEED])
        extreme = UPPER if z == 0.0 else LOWER
        out[row, extreme], out[row, SURFACE if z == 0.0 else BOTTOM] = z, 1.0
        return 1
    count, j = 0, node_above(depth, z)
    c = speed_at(depth, speed, j, z)
    for sense in (-1, 1):
        near = j + 1 if sense > 0 else (j if depth[j] < z else j - 1)  # the next node that way
        back = near - sense
        if known or not 0 <= near < len(depth) or not 0 <= back < len(depth) or depth[near] == depth[back]:
            continue
        gradient = (speed[near] - speed[back]) / abs(depth[near] - depth[back])
        rise = distance * distance * gradient / (8.0 * c)
        if gradient > 0.0 and c == speed[near] and rise <= abs(depth[near] - z):
            emit_level(out, row + count, distance, c)
            out[row + count, LOWER if sense > 0 else UPPER] = z + sense * rise
            out[row + count, TURNING] = 1.0
            count += 1
    return count


@compiled
def rays_of_pairs(
    depth: Floats,
    speed: Floats,
    start: Floats,
    end: Floats,
    distance: Floats,
    vertices: int,
    reflections: int,
    first: int,
    pair: Ints,
    out: Floats,
) -> tuple[int, int]:
    """All rays of the pairs from `first` on, into pair and out: how many, and the pair where the room ended."""
    chain = new_chain(len(depth))
    family = np.zeros((2 * vertices, COLUMNS), np.int64)
    slowest, fastest = speed.min(), speed.max()
    steepest = math.sqrt((fastest - slowest) * (fastest + slowest)) / slowest  # tangent of any ray that turns
    count = 0
    for i in range(first, len(start)):
        if count == len(out):
            return count, i
        z1, z2, r = start[i], end[i], distance[i]
        if abs(z2 - z1) < SAME_DEPTH:
            z2 = z1
        ray_count = straight_of_pair(depth, speed, z1, z2, r, chain, out, count)
        if count + ray_count + 2 > len(out):
            return count, i
        if z1 == z2 and r > 0.0 and vertices > 0:
            ray_count += level_of_pair(depth, speed, z1, r, reflections, ray_count, out, count + ray_count)
        if vertices > 0 and (reflections > 0 or (r > 0.0 and fastest > slowest and abs(z2 - z1) <= r * steepest)):
            more = families_of_pair(
                depth, speed, z1, z2, r, reflections, steepest, family, chain, out, count + ray_count
            )  # fmt: skip
            if more < 0:
                return count, i
            ray_count += more
            sort_by_time(out, count, ray_count)
        pair[count : count + ray_count] = i
        count += ray_count
    return count, len(start)


@compiled(borrows=True)
def _down(c1: float, c2: float, dz: float) -> float:
    """Time (s) straight down a layer: dz over its logarithmic mean speed."""
    return 2.0 * dz / (c1 + c2) * float(atanhc((c2 - c1) / (c2 + c1)))


@compiled
def mean_slowness(depth: Floats, speed: Floats, start: Floats, end: Floats, out: Floats) -> None:
    """Mean of 1/c (s/m) over the depths between the ends of each pair: what a straight line takes a metre."""
    work, down = np.empty((2, len(depth) + 8)), np.zeros(len(depth))
    c, dz = work[0], work[1]
    for j in range(1, len(depth)):
        down[j] = down[j - 1] + _down(speed[j - 1], speed[j], depth[j] - depth[j - 1])
    for i in range(len(start)):
        top, bottom = min(start[i], end[i]), max(start[i], end[i])
        first, last = node_above(depth, top), node_above(depth, bottom)
        if last - first > MANY:  # whole layers between by what they take from the surface on
            total = _down(speed_at(depth, speed, first, top), speed[first + 1], depth[first + 1] - top)
            total += down[last] - down[first + 1]
            total += _down(speed[last], speed_at(depth, speed, last, bottom), bottom - depth[last])
            out[i] = total / (bottom - top)
            continue
        n, _ = lay(depth, speed, top, bottom, c, dz, 0)
        out[i] = 1.0 / c[0]
        if n > 0:
            total = 0.0
            for j in range(n):
                total += _down(c[j], c[j + 1], dz[j])
            out[i] = total / (bottom - top)
