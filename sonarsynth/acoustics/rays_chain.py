"""Sums over the layers of a ray: the chain of speeds that it meets, with how often it crosses each layer.

A chain is what a ray goes through, laid out from one end: node speeds c[0..n] and, between them, thickness dz[i] times
the number of crossings. Every family of rays is such sums: a direct ray crosses each layer between the ends once, a
ray that turns once crosses those beyond the ends twice and two half layers up to its turning point; a bounce or a
cycle adds crossings of whole legs and nothing else. So further families need further multiplicities, not further
equations.
"""

from __future__ import annotations

import math

from numba import njit

from sonarsynth.acoustics.rays_layers import layer_length, layer_time, turn_length, turn_time
from sonarsynth.conventions import Floats

GRAZING = 1e-150
"""Least sine: keeps 0/0 out of the limit in which a ray becomes horizontal; nothing of size above 1e-140 notices."""


@njit(cache=True, error_model="numpy", nogil=True)
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


@njit(cache=True, error_model="numpy", nogil=True)
def speed_at(depth: Floats, speed: Floats, node: int, z: float) -> float:
    """Sound speed at z in the layer below a node (the node's own speed at the last one)."""
    if node >= len(depth) - 1 or z <= depth[node]:
        return float(speed[node])
    part = (z - depth[node]) / (depth[node + 1] - depth[node])
    return float(speed[node] + part * (speed[node + 1] - speed[node]))


@njit(cache=True, error_model="numpy", nogil=True)
def lay(depth: Floats, speed: Floats, top: float, bottom: float, c: Floats, k: Floats, dz: Floats) -> int:
    """Lay the chain straight down from top to bottom: c, dz and k = dz (c1 + c2). Returns its number of layers n.

    On a jump the chain begins at its lower side and ends at its upper side. top = bottom: one node on the lower side,
    n = 0.
    """
    j = node_above(depth, top)
    c[0] = speed_at(depth, speed, j, top)
    n = 0
    z = top
    while z < bottom:
        if depth[j + 1] < bottom:
            below, c_below = depth[j + 1], speed[j + 1]
        else:
            below = bottom
            c_below = speed[j + 1] if depth[j + 1] == bottom else speed_at(depth, speed, j, bottom)
        dz[n] = below - z
        k[n] = dz[n] * (c[n] + c_below)
        n += 1
        c[n] = c_below
        z = below
        j += 1
    return n


@njit(cache=True, error_model="numpy", nogil=True)
def offsets(c: Floats, n: int, fastest: float, d: Floats) -> None:
    """d = (c_m - c)(c_m + c) at every node of the chain, for c_m the fastest speed that the ray meets."""
    for i in range(n + 1):
        d[i] = (fastest - c[i]) * (fastest + c[i])


@njit(cache=True, error_model="numpy", nogil=True)
def sweep(s_m: float, p: float, d: Floats, k: Floats, n: int, inverse_gradient: float) -> tuple[float, float]:
    """X/p (m2/s) and dX/dp of the chain and two half layers beyond its last node, up to the turning point.

    X = p sum k/(s1+s2) + 2 s_n/(p g);  dX/dp = sum k/(s1 s2 (s1+s2)) - 2/(g p^2 s_n).  inverse_gradient = 0: no turn.
    """
    a, b = s_m * s_m, p * p
    s1 = math.sqrt(a + b * d[0])
    x = slope = 0.0
    for i in range(n):
        s2 = math.sqrt(a + b * d[i + 1])
        term = k[i] / (s1 + s2)
        x += term
        slope += term / (s1 * s2)
        s1 = s2
    turn = 2.0 * inverse_gradient / b if inverse_gradient > 0.0 else 0.0
    return x + turn * s1, slope - turn / s1


@njit(cache=True, error_model="numpy", nogil=True)
def bounds(
    v1: float, v2: float, d: Floats, k: Floats, n: int, inverse_gradient: float
) -> tuple[float, float, float, float, float, float]:
    """Rigorous bounds of the range X of rays with v = c_m tan(grazing angle) in [v1, v2].

    Returns X(v1), X(v2), the least and the largest X, the least and the largest slope.

    With h = s/p = sqrt(v^2 + d) each full layer k/(h1+h2) falls with v and the turning layer 2 h/g rises; the slope
    given is 2 v dX/d(v^2), whose terms are products of monotone factors (v/h rises, 1/h falls), so ends of the
    interval bound it.
    """
    y1, y2 = v1 * v1, v2 * v2
    a1, a2 = math.sqrt(y1 + d[0]), math.sqrt(y2 + d[0])
    full1 = full2 = fall_least = fall_largest = 0.0
    for i in range(n):
        b1, b2 = math.sqrt(y1 + d[i + 1]), math.sqrt(y2 + d[i + 1])
        full1 += k[i] / (a1 + b1)
        full2 += k[i] / (a2 + b2)
        fall_largest += k[i] * (v2 / min(a2, b2)) / (max(a1, b1) * (a1 + b1))
        fall_least += k[i] * (v1 / min(a1, b1)) / (max(a2, b2) * (a2 + b2))
        a1, a2 = b1, b2
    turn1, turn2 = 2.0 * inverse_gradient * a1, 2.0 * inverse_gradient * a2
    rise_least, rise_largest = 2.0 * inverse_gradient * v1 / a1, 2.0 * inverse_gradient * v2 / a2
    slopes = rise_least - fall_largest, rise_largest - fall_least
    return full1 + turn1, full2 + turn2, full2 + turn1, full1 + turn2, slopes[0], slopes[1]


@njit(cache=True, error_model="numpy", nogil=True)
def whole(
    s_m: float,
    p: float,
    c: Floats,
    d: Floats,
    k: Floats,
    dz: Floats,
    crossings: Floats,
    n: int,
    inverse_gradient: float,
) -> tuple[float, float, float, float]:
    """X/p and dX/dp as `sweep`, travel time (s) and arc length (m) of a ray along its chain and its two half layers."""
    a, b = s_m * s_m, p * p
    s1 = math.sqrt(a + b * d[0])
    x = slope = time = length = 0.0
    for i in range(n):
        s2 = math.sqrt(a + b * d[i + 1])
        term = k[i] / (s1 + s2)
        x += term
        slope += term / (s1 * s2)
        if dz[i] > 0.0:
            time += crossings[i] * layer_time(p, c[i], c[i + 1], s1, s2, dz[i])
            length += crossings[i] * layer_length(p, c[i], c[i + 1], s1, s2, dz[i])
        s1 = s2
    if inverse_gradient > 0.0:
        turn = 2.0 * inverse_gradient / b
        tangent = s1 / (p * c[n])
        x += turn * s1
        slope -= turn / s1
        time += 2.0 * turn_time(tangent, inverse_gradient)
        length += 2.0 * turn_length(p, tangent, inverse_gradient)
    return x, slope, time, length
