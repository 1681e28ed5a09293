"""Rays in water of one gradient of sound speed: circles about a point on the level where the speed would be zero.

With depth counted from that level as y = c/g every ray is a circle of radius 1/(p g) about a point on it. A ray that is
reflected n times at a boundary of slower water at y_s, each half chord there being h, covers
    R = 2 n h + e1 sqrt(h^2 - a) + e2 sqrt(h^2 - b),  a = y1^2 - y_s^2,  b = y2^2 - y_s^2,
with e = 1 for an end from which the ray first turns and -1 for one that goes straight to the boundary: a quartic in h
(a cubic for n = 1). No reflection: the one circle through both ends. Travel time of each arc from its chord S,
T = (2/g) arsinh(g S/(2 sqrt(c1 c2))). Plane geometry; roots to 40 digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.validation.rays.ray_matching import Rays

DIGITS = 40


@dataclass(frozen=True)
class Gradient:
    """Water in which the speed grows by `slope` (1/s; either sign) over the depth, down to the bottom (m)."""

    speed: float  # m/s at the surface
    slope: float
    bottom_depth: float


def gradient_rays(water: Gradient, start: Floats, end: Floats, distance: Floats, vertices: int) -> Rays:
    """Every ray with up to `vertices` vertices that does not touch the boundary that rays bend away from."""
    import mpmath as mp

    rows = []
    with mp.workdps(DIGITS):
        g = abs(mp.mpf(water.slope))
        c0, deep = mp.mpf(water.speed), mp.mpf(water.bottom_depth)
        slowest, fastest = sorted((c0 / g, (c0 + mp.mpf(water.slope) * deep) / g))
        for pair, (z1, z2, far) in enumerate(zip(start, end, distance, strict=True)):
            y1, y2 = ((c0 + mp.mpf(water.slope) * mp.mpf(float(z))) / g for z in (z1, z2))
            r = mp.mpf(float(far))
            rows += [(pair, 0, *ray) for ray in _unreflected(mp, g, y1, y2, r, fastest)]
            for count in range(1, (vertices + 1) // 2 + 1):
                reflected = _reflected(mp, g, y1, y2, r, slowest, fastest, count)
                rows += [(pair, count, *ray) for ray in reflected]
    columns = np.array(rows, float).reshape(-1, 8).T
    pair, bounces, turning = (columns[i].astype(int) for i in (0, 1, 2))
    up = 1.0 if water.slope > 0 else -1.0  # towards the boundary of slower water
    none = np.zeros(len(pair), int)
    surface, bottom = (bounces, none) if water.slope > 0 else (none, bounces)
    time, first, last, amplitude = columns[3:7]
    rays = Rays(pair, time, up * first, up * last, amplitude, surface, bottom, turning, np.full(len(pair), -1))
    return rays.select(rays.vertices <= vertices)


def _unreflected(mp: Any, g: Any, y1: Any, y2: Any, r: Any, fastest: Any) -> list[tuple[Any, ...]]:
    """The circle through both ends, as `_ray`, if it stays in the water."""
    centre = (r**2 + y2**2 - y1**2) / (2 * r)
    radius = mp.sqrt(centre**2 + y1**2)
    turning = int(0 < centre < r)
    if turning and radius > fastest:
        return []
    arcs = [(mp.hypot(r, y2 - y1), y1, y2)]
    arrival = r - centre
    spread = 1 / centre + 1 / arrival  # dX/dradius over the radius
    return [_ray(mp, g, radius, turning, arcs, (-centre, arrival), y=(y1, y2), r=r, spread=spread)]


def _reflected(
    mp: Any, g: Any, y1: Any, y2: Any, r: Any, slowest: Any, fastest: Any, count: int
) -> list[tuple[Any, ...]]:
    """Rays with `count` reflections at the boundary of slower water."""
    a, b, n = y1**2 - slowest**2, y2**2 - slowest**2, count
    quadratic = [4 * n**2 - 2, -4 * n * r, r**2 + a + b]  # (R - 2nh)^2 - (h^2 - a) - (h^2 - b)
    squared = [mp.mpf(0)] * 5
    for (i, u), (j, v) in product(enumerate(quadratic), repeat=2):
        squared[i + j] += u * v
    quartic = [squared[0] - 4, squared[1], squared[2] + 4 * (a + b), squared[3], squared[4] - 4 * a * b]
    if n == 1:
        quartic = quartic[1:]
    rays = []
    scale = r + y1 + y2
    for root in _roots(mp, quartic, scale):
        h = mp.re(root)
        if abs(mp.im(root)) > mp.mpf("1e-25") * scale or h <= 0 or h**2 < max(a, b):
            continue
        roots = mp.sqrt(h**2 - a), mp.sqrt(h**2 - b)
        for e1, e2 in product((-1, 1), repeat=2):
            if abs(2 * n * h + e1 * roots[0] + e2 * roots[1] - r) < mp.mpf("1e-20") * scale:
                x1, x2 = h + e1 * roots[0], h + e2 * roots[1]
                radius = mp.hypot(h, slowest)
                turning = n - 1 + (e1 > 0) + (e2 > 0)
                if turning and radius > fastest:
                    continue
                arcs = [(mp.hypot(x1, y1 - slowest), y1, slowest), (mp.hypot(x2, y2 - slowest), y2, slowest)]
                arcs += [(2 * h, slowest, slowest)] * (n - 1)
                spread = 2 * n / h + e1 / roots[0] + e2 / roots[1]
                offsets = (-e1 * roots[0], e2 * roots[1])
                rays.append(_ray(mp, g, radius, turning, arcs, offsets, y=(y1, y2), r=r, spread=spread))
    return rays


def _roots(mp: Any, coefficients: list[Any], scale: Any) -> list[Any]:
    """All complex roots of a polynomial, highest power first, by the iteration of Durand (1960) and Kerner (1966)."""
    degree = len(coefficients) - 1
    monic = [c * scale**-i / coefficients[0] for i, c in enumerate(coefficients)]
    roots = [mp.mpc("0.4", "0.9") ** k for k in range(degree)]
    for _ in range(1000):
        largest = mp.mpf(0)
        for k, root in enumerate(roots):
            value = mp.mpc(0)
            for c in monic:
                value = value * root + c
            step = value / mp.fprod(root - other for m, other in enumerate(roots) if m != k)
            roots[k] -= step
            largest = max(largest, abs(step) / (abs(root) + mp.mpf("1e-30")))
        if largest < mp.mpf(10) ** (5 - DIGITS):
            break
    return [root * scale for root in roots]


def _ray(
    mp: Any, g: Any, radius: Any, turning: int, arcs: list[Any], offsets: Any, *, y: Any, r: Any, spread: Any
) -> tuple[Any, ...]:
    """(turning, time, start angle, end angle, amplitude, radius); offsets: of the ends from their circle's centre.

    Angles of travel towards slower water. X depends on the radius as dX/dradius = radius * spread, p = 1/(g radius).
    """
    time = sum(2 / g * mp.asinh(s / (2 * mp.sqrt(ya * yb))) for s, ya, yb in arcs)
    first, last = mp.atan2(offsets[0], y[0]), mp.atan2(offsets[1], y[1])
    over_p = radius * abs(spread) * g * radius**2  # |dX/dp|
    sines = abs(offsets[0] * offsets[1]) / radius**2
    amplitude = mp.sqrt(g * y[0] * y[1] / (radius * r * over_p * sines))
    return turning, time, first, last, amplitude, radius
