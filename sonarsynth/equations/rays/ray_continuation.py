"""Rays near one that is known: the same family, from the same start to many ends near the end of the known ray.

What an array needs: the ray to its centre is searched for, those to its elements are reached from it by Newton's
method, each from the last; those without a vertex, of which there is one at most, from anywhere. An end at which the
vertices of the family lie in other layers is given up, not guessed: the complete search decides there.
"""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import GRAZING, offsets, sweep, time_and_length
from sonarsynth.equations.rays.ray_families import ABOVE, BELOW, BETWEEN, COLUMNS, family_of, weigh
from sonarsynth.equations.rays.ray_search import settled, straight
from sonarsynth.equations.rays.ray_vertices import (
    AFTER,
    DESCENDS,
    FASTEST,
    FIRST,
    GRADIENT_DOWN,
    GRADIENT_UP,
    LAST,
    LOWER_END,
    UPPER_END,
    Chain,
    begin,
    extend_down,
    extend_up,
    new_chain,
)


@compiled(borrows=True)
def lay_for(depth: Floats, speed: Floats, start: float, end: float, p: float, up: int, vertices: int, chain: Chain,
            family: Ints) -> tuple[int, int, float, float]:  # fmt: skip
    """Lay the weighted chain of a family for rays of about this p: first and last node, and its turns."""
    ints, reals = chain.ints, chain.reals
    begin(depth, speed, start, end, chain)
    above, between, below = 0, 1, 0
    if vertices > 0:
        family_of(up, vertices, ints[DESCENDS] == 1, family, 0)
        above, between, below = family[0, ABOVE], family[0, BETWEEN], family[0, BELOW]
        while True:
            reals[AFTER] = math.inf
            extend_up(depth, speed, chain)
            extend_down(depth, speed, chain)
            if not reals[AFTER] * p < 1.0:
                break
            reals[FASTEST] = reals[AFTER]
    else:
        reals[AFTER] = math.inf
    first = ints[FIRST] if above > 0 else ints[UPPER_END]
    last = ints[LAST] if below > 0 else ints[LOWER_END]
    weigh(above, between, below, first, last, chain)
    offsets(chain.c, first, last, reals[FASTEST], chain.d)
    return first, last, above * reals[GRADIENT_UP], below * reals[GRADIENT_DOWN]


@compiled(borrows=True)
def approach(
    p: float, distance: float, chain: Chain, first: int, last: int, turn_up: float, turn_down: float
) -> tuple[float, float, float, float]:
    """Newton in v = c_m tan(grazing angle) from a p nearby, to within a last step that travel times do not notice.

    Returns (s_m, p, X/p, dX/dp); NaN where it leaves the interval.
    """
    fastest, after = chain.reals[FASTEST], chain.reals[AFTER]
    extent = math.sqrt((after - fastest) * (after + fastest)) if after < math.inf else math.inf
    v = math.sqrt(max(1.0 - (p * fastest) ** 2, 0.0)) / max(p, 1e-9 / fastest)
    for _ in range(12):
        p = 1.0 / math.sqrt(v * v + fastest * fastest)
        s_m = max(v * p, GRAZING)
        over_p, slope = sweep(s_m, p, chain.d, chain.k, first, last, turn_up, turn_down)
        misfit = p * over_p - distance
        if settled(misfit, distance, p * abs(slope)):
            return s_m, p, over_p, slope
        v += misfit / (slope * s_m * p * p)
        if not 0.0 < v <= extent:
            break
    return math.nan, math.nan, math.nan, math.nan


@compiled(borrows=True)
def root_nearby(
    p: float, distance: float, vertices: int, chain: Chain, first: int, last: int, turn_up: float, turn_down: float
) -> tuple[float, float, float, float]:
    """The ray of a family to a distance, from a p nearby, as `approach`."""
    if first == last and turn_up + turn_down == 0.0:
        return math.nan, math.nan, math.nan, math.nan
    if vertices > 0:
        return approach(p, distance, chain, first, last, turn_up, turn_down)
    exists, s_m, p = straight(distance, chain.reals[FASTEST], chain.d, chain.k, first, last, False)
    if not exists:
        return math.nan, math.nan, math.nan, math.nan
    over_p, slope = sweep(s_m, p, chain.d, chain.k, first, last, 0.0, 0.0)
    return s_m, p, over_p, slope


@compiled(borrows=True)
def rays_beside(
    depth: Floats, speed: Floats, start: float, near: float, up: int, vertices: int, depth_of_end: Ints, end: Floats,
    distance: Floats, chain: Chain, family: Ints, time: Floats, sine: Floats, amplitude: Floats,
) -> None:  # fmt: skip
    """As `rays_nearby`, beside one known ray with p = near."""
    laid_depth, first, last, turn_up, turn_down = -1, 0, 0, 0.0, 0.0
    c, d = chain.c, chain.d
    for j in range(len(depth_of_end)):
        if depth_of_end[j] != laid_depth:
            laid_depth = depth_of_end[j]
            first, last, turn_up, turn_down = lay_for(
                depth, speed, start, end[laid_depth], near, up, vertices, chain, family
            )
        time[j] = sine[j] = amplitude[j] = math.nan
        s_m, p, over_p, slope = root_nearby(near, distance[j], vertices, chain, first, last, turn_up, turn_down)
        if math.isnan(p):
            continue
        misfit, descends = distance[j] - p * over_p, chain.ints[DESCENDS] == 1
        start_node, end_node = chain.ints[UPPER_END], chain.ints[LOWER_END]
        if not descends:
            start_node, end_node = end_node, start_node
        leaves, arrives = math.sqrt(s_m * s_m + p * p * d[start_node]), math.sqrt(s_m * s_m + p * p * d[end_node])
        along, _ = time_and_length(s_m, p, c, d, chain.dz, chain.crossings, first, last, turn_up, turn_down)
        time[j] = along + p * misfit
        amplitude[j] = math.sqrt(c[start_node] * c[end_node] / (over_p * abs(slope) * leaves * arrives))
        upward = up == 1 if vertices > 0 else not descends
        near = p + misfit / slope  # ds/dp = -p c^2/s
        leaves -= p * c[start_node] * c[start_node] / leaves * misfit / slope
        sine[j] = leaves if upward else -leaves
        if j + 1 < len(depth_of_end):
            near += (distance[j + 1] - distance[j]) / slope


@compiled
def rays_nearby(
    depth: Floats, speed: Floats,
    start: Floats, slowness: Floats, up: Ints, vertices: Ints, depth_of_end: Ints, end: Floats, distance: Floats,
    time: Floats, sine: Floats, amplitude: Floats,
) -> None:  # fmt: skip
    """Times, sines at the start (up positive) and amplitudes (ray, end) of rays of known families; NaN given up.

    start, slowness, up, vertices (ray,): of the known rays; end (depth,): depths of the ends, depth_of_end
    (end,): which of them each end has, equal ones next to each other; distance (ray, end).
    """
    chain, family = new_chain(len(depth)), np.zeros((1, COLUMNS), np.int64)
    for i in range(len(start)):
        rays_beside(
            depth, speed, start[i], slowness[i], up[i], vertices[i], depth_of_end, end, distance[i], chain, family,
            time[i], sine[i], amplitude[i],
        )  # fmt: skip
