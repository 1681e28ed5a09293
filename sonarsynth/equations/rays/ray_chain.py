"""Sums over the layers of a ray: the chain of speeds that it meets, with how often it crosses each layer.

A chain is the water that a ray goes through, from its upper vertex down to its lower one: node speeds c[i], and between
nodes i and i + 1 the thickness dz[i]. A vertex is surface, bottom, or a turning point in the layer beyond the first or
the last node. Every family of rays is the same sums with other weights: how often it crosses each layer, and how often
it turns above and below. So a bounce or a cycle costs nothing.

The weighted chain: k = crossings dz (c1 + c2), turn_up = (number of turns above)/gradient, turn_down likewise; 0 where
the ray does not turn.
"""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats
from sonarsynth.equations.rays.ray_in_layer import layer_length, layer_time, turn_length, turn_time

GRAZING = 1e-150
"""Least sine: keeps 0/0 out of the limit in which a ray becomes horizontal; nothing of size above 1e-140 notices."""


@compiled(borrows=True)
def node_above(depth: Floats, z: float) -> int:
    """Last node at or above z: on a jump the lower side."""
    low, high = 0, len(depth) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if depth[middle] <= z:
            low = middle
        else:
            high = middle - 1
    return low


@compiled(borrows=True)
def speed_at(depth: Floats, speed: Floats, node: int, z: float) -> float:
    """Sound speed at z in the layer below a node (the node's own speed at the last one)."""
    if node >= len(depth) - 1 or z <= depth[node]:
        return float(speed[node])
    fraction = (z - depth[node]) / (depth[node + 1] - depth[node])
    return float(speed[node] + fraction * (speed[node + 1] - speed[node]))


@compiled(borrows=True)
def lay(depth: Floats, speed: Floats, top: float, bottom: float, c: Floats, dz: Floats, first: int) -> tuple[int, int]:
    """Lay the chain straight down from top to bottom, from c[first] on.

    Returns the index of its last node, and the first node of the profile beyond it. On a jump the chain begins at the
    lower side and ends at the upper side. top = bottom: one node, on the lower side.
    """
    j = node_above(depth, top)
    c[first] = speed_at(depth, speed, j, top)
    n, z = first, top
    if not z < bottom:
        return n, j + 1
    while z < bottom:
        if depth[j + 1] < bottom:
            below, c_below = depth[j + 1], speed[j + 1]
        else:
            below = bottom
            c_below = speed[j + 1] if depth[j + 1] == bottom else speed_at(depth, speed, j, bottom)
        dz[n] = below - z
        n += 1
        c[n] = c_below
        z = below
        j += 1
    return n, j + 1 if depth[j] == bottom else j


@compiled(borrows=True)
def offsets(c: Floats, first: int, last: int, fastest: float, d: Floats) -> None:
    """d = (c_m - c)(c_m + c) at the nodes of a chain, for c_m the fastest speed in it."""
    for i in range(first, last + 1):
        d[i] = (fastest - c[i]) * (fastest + c[i])


@compiled(borrows=True)
def sweep(
    s_m: float, p: float, d: Floats, k: Floats, first: int, last: int, turn_up: float, turn_down: float
) -> tuple[float, float]:
    """X/p (m2/s) and dX/dp of the nodes first to last of a weighted chain and of the half layers that it turns in.

    X = p sum k/(s1+s2) + 2 s/(p g);  dX/dp = sum k/(s1 s2 (s1+s2)) - 2/(g p^2 s).
    """
    a, b = s_m * s_m, p * p
    s1 = math.sqrt(a + b * d[first])
    x = slope = 0.0
    if turn_up > 0.0:
        x = 2.0 * turn_up / b * s1
        slope = -2.0 * turn_up / (b * s1)
    for i in range(first, last):
        s2 = math.sqrt(a + b * d[i + 1])
        term = k[i] / (s1 + s2)
        x += term
        slope += term / (s1 * s2)
        s1 = s2
    if turn_down > 0.0:
        x += 2.0 * turn_down / b * s1
        slope -= 2.0 * turn_down / (b * s1)
    return x, slope


@compiled(borrows=True)
def leg(
    v1: float, v2: float, c: Floats, dz: Floats, d: Floats, first: int, last: int
) -> tuple[float, float, float, float]:
    """Range once through the nodes first to last, for rays with v = c_m tan(grazing angle) from v1 to v2.

    Returns X(v1), X(v2), which bound it, and bounds of how fast it falls with v: least and largest of -2 v dX/d(v^2).
    With h = s/p = sqrt(v^2 + d) each layer k/(h1+h2) falls with v; the terms of its slope are products of monotone
    factors (v/h rises, 1/h falls), so the ends of the interval bound them.
    """
    y1, y2 = v1 * v1, v2 * v2
    a1, a2 = math.sqrt(y1 + d[first]), math.sqrt(y2 + d[first])
    x1 = x2 = least = largest = 0.0
    for i in range(first, last):
        b1, b2 = math.sqrt(y1 + d[i + 1]), math.sqrt(y2 + d[i + 1])
        k = dz[i] * (c[i] + c[i + 1])
        x1 += k / (a1 + b1)
        x2 += k / (a2 + b2)
        largest += k * (v2 / min(a2, b2)) / (max(a1, b1) * (a1 + b1))
        least += k * (v1 / min(a1, b1)) / (max(a2, b2) * (a2 + b2))
        a1, a2 = b1, b2
    return x1, x2, least, largest


@compiled(borrows=True)
def turn(v1: float, v2: float, d: float, inverse_gradient: float) -> tuple[float, float, float, float]:
    """Range 2 h/g of two half layers up to a turning point: X(v1), X(v2), which bound it, and bounds of its rise."""
    twice = 2.0 * inverse_gradient
    h1, h2 = math.sqrt(v1 * v1 + d), math.sqrt(v2 * v2 + d)
    return twice * h1, twice * h2, twice * v1 / h1, twice * v2 / h2


@compiled(borrows=True)
def bounds(
    v1: float, v2: float, d: Floats, k: Floats, first: int, last: int, turn_up: float, turn_down: float
) -> tuple[float, float, float, float, float, float]:
    """Rigorous bounds of the range X of a weighted chain for v = c_m tan(grazing angle) in [v1, v2].

    Returns X(v1), X(v2), the least and the largest X, the least and the largest slope (as in `leg` and `turn`).
    """
    y1, y2 = v1 * v1, v2 * v2
    a1, a2 = math.sqrt(y1 + d[first]), math.sqrt(y2 + d[first])
    turn1, turn2 = 2.0 * turn_up * a1, 2.0 * turn_up * a2
    rise_least, rise_largest = 2.0 * turn_up * v1 / a1, 2.0 * turn_up * v2 / a2
    full1 = full2 = fall_least = fall_largest = 0.0
    for i in range(first, last):
        b1, b2 = math.sqrt(y1 + d[i + 1]), math.sqrt(y2 + d[i + 1])
        full1 += k[i] / (a1 + b1)
        full2 += k[i] / (a2 + b2)
        fall_largest += k[i] * (v2 / min(a2, b2)) / (max(a1, b1) * (a1 + b1))
        fall_least += k[i] * (v1 / min(a1, b1)) / (max(a2, b2) * (a2 + b2))
        a1, a2 = b1, b2
    turn1, turn2 = turn1 + 2.0 * turn_down * a1, turn2 + 2.0 * turn_down * a2
    rise_least += 2.0 * turn_down * v1 / a1
    rise_largest += 2.0 * turn_down * v2 / a2
    slopes = rise_least - fall_largest, rise_largest - fall_least
    return full1 + turn1, full2 + turn2, full2 + turn1, full1 + turn2, slopes[0], slopes[1]


@compiled(borrows=True)
def time_and_length(
    s_m: float, p: float, c: Floats, d: Floats, dz: Floats, crossings: Floats, first: int, last: int,
    turn_up: float, turn_down: float,
) -> tuple[float, float]:  # fmt: skip
    """Travel time (s) and arc length (m) of a ray along its chain and the half layers that it turns in."""
    a, b = s_m * s_m, p * p
    s1 = math.sqrt(a + b * d[first])
    time = 2.0 * turn_time(s1 / (p * c[first]), turn_up) if turn_up > 0.0 else 0.0
    length = 2.0 * turn_length(p, s1 / (p * c[first]), turn_up) if turn_up > 0.0 else 0.0
    for i in range(first, last):
        s2 = math.sqrt(a + b * d[i + 1])
        if dz[i] > 0.0:
            time += crossings[i] * layer_time(p, c[i], c[i + 1], s1, s2, dz[i])
            length += crossings[i] * layer_length(p, c[i], c[i + 1], s1, s2, dz[i])
        s1 = s2
    if turn_down > 0.0:
        time += 2.0 * turn_time(s1 / (p * c[last]), turn_down)
        length += 2.0 * turn_length(p, s1 / (p * c[last]), turn_down)
    return time, length
