"""Rays that are known, made exact: followed leg by leg in long doubles, and moved by Newton's method to where they end.

Through a layer of gradient g between speeds c1 and c2 that are dz apart, with the sines s1 and s2 of a ray there,
    X = p (c1 + c2) dz/(s1 + s2),  T = (2/g) arsinh(g S/(2 sqrt(c1 c2))),  S^2 = X^2 + dz^2,
and from c1 to where the ray turns X = s1/(p g), T = artanh(s1)/g (e.g. Jensen, Kuperman, Porter and Schmidt 2011,
Computational Ocean Acoustics, section 3.3). A ray is told by the way in which it leaves and by how many vertices it
has; which of them are reflections follows from p.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.rays.ray_matching import Rays
from sonarsynth.validation.references.rays.followed_rays import follow, nodes, sides

STEPS = 8
"""Newton steps at most; from 15 right digits two or three suffice."""
ROUNDING = 1e-18
"""Of p: a step that is no longer changes nothing."""


def sums_through(p: Any, dz: Any, c1: Any, c2: Any) -> Any:
    """Range (m), its slope over p, and travel time (s) through a layer; c2 None where the ray becomes level."""
    if dz == 0:
        return np.zeros(3, np.longdouble)
    s1 = np.sqrt((1 - p * c1) * (1 + p * c1))
    if c2 is None:
        g = (1 / p - c1) / dz
        return np.array([s1 / (p * g), -(c1**2 / s1 + s1 / p**2) / g, np.arctanh(s1) / g])
    s2 = np.sqrt((1 - p * c2) * (1 + p * c2))
    x = p * (c1 + c2) * dz / (s1 + s2)
    slope = x / p + x * p * (c1**2 / s1 + c2**2 / s2) / (s1 + s2)
    chord, middle = np.hypot(x, dz), np.sqrt(c1 * c2)
    bend = (c2 - c1) / dz * chord / (2 * middle)
    return np.array([x, slope, chord / middle * (np.arcsinh(bend) / bend if bend else 1)])


def exact_rays(
    water: ray_solutions.Water, computed: Rays, slowness: Floats, start: Floats, end: Floats, distance: Floats
) -> Rays:
    """The rays near those computed, to more digits than float64 has; NaN where there is none near by.

    Newton's iteration of X(p) = R from the slowness (ray,) s/m of each ray, its launch direction and its number of
    vertices; ends start, end (pair,) m at distances (pair,) m.
    """
    rows = []
    for i, pair in enumerate(computed.pair):
        up = -1 if computed.start_angle[i] < 0 else 1
        ends, way = (float(start[pair]), float(end[pair])), (up, int(computed.vertices[i]))
        a, b, far, p = map(np.longdouble, (*ends, distance[pair], slowness[i]))
        rows.append(_ray(nodes(water, ends), (a, b), p, far, way))
    columns = np.array(rows, float).reshape(-1, 7).T
    time, first, last, amplitude = columns[:4]
    surface, bottom, turning = (np.nan_to_num(columns[k], nan=-1.0).astype(int) for k in (4, 5, 6))
    return Rays(computed.pair, time, first, last, amplitude, surface, bottom, turning)


def _ray(layers: tuple[list[Any], list[Any]], ends: tuple[Any, Any], p: Any, far: Any, way: tuple[int, int]) -> Any:
    """(time, start angle, end angle, amplitude, surface, bottom, turning) of one ray; way: up or down, vertices."""
    up, vertices = way
    c = [layers[1][n] for n in sides(layers[0], *ends)]
    longest = np.inf
    for _ in range(STEPS):
        if not 0 < p * max(c) < 1:
            return [np.nan] * 7
        visits = follow(*layers, ends, p, up, vertices, vertices, sums_through)
        visit: Any = next((v for v in visits if v.surface + v.bottom + v.turning == vertices), None)
        if visit is None:
            return [np.nan] * 7
        x, slope, time = visit.range
        step = (x - far) / slope
        if abs(step) <= ROUNDING * p or abs(step) >= longest:
            break
        p, longest = p - step, abs(step)
    cosine = np.array(c) * p
    sine = np.sqrt((1 - cosine) * (1 + cosine))
    amplitude = np.sqrt(p * c[0] * c[1] / (far * abs(slope) * sine[0] * sine[1]))
    angles = np.arctan2(sine, cosine) * [up, up * (-1) ** vertices]
    return [time + p * (far - x), *angles, amplitude, visit.surface, visit.bottom, visit.turning]
