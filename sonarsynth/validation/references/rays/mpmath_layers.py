"""Rays through layers of constant gradient by the textbook's forms, which cancel, in arithmetic of 50 digits.

With s = sqrt(1 - (p c)^2), through a layer of gradient g from speed c1 to c2 (e.g. Jensen, Kuperman, Porter and Schmidt
2011, Computational Ocean Acoustics, section 3.3):
    X = (s1 - s2)/(p g),  T = ln(c2 (1 + s1)/(c1 (1 + s2)))/g,  dX/dp = (c2^2/s2 - c1^2/s1)/g - (s1 - s2)/(p^2 g),
the terms with s2 being absent where the ray turns, c2 = 1/p. A ray is told by the way in which it leaves and by how
many vertices it has; which of them are reflections follows from p.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.validation.rays.ray_matching import Rays

DIGITS = 50
STEPS = 8
"""Newton steps at most; from 15 right digits two or three suffice."""


@dataclass(frozen=True, eq=False)
class Layers:
    """Sound speed (m/s) at nodes (m) from the surface to the bottom, linear between; two equal depths are a jump."""

    depth: Floats  # (node,)
    speed: Floats  # (node,)

    @cached_property
    def nodes(self) -> list[tuple[Any, Any]]:
        """Depths and speeds to many digits."""
        import mpmath as mp

        return [(mp.mpf(float(z)), mp.mpf(float(c))) for z, c in zip(self.depth, self.speed, strict=True)]

    def down(self, top: Any, bottom: Any) -> list[tuple[Any, Any, Any]]:
        """(thickness, speed above, speed below) of what lies between two depths, jumps inside as layers of none."""
        layers = []
        for i in range(len(self.nodes) - 1):
            (za, ca), (zb, cb) = self.nodes[i], self.nodes[i + 1]
            if za == zb:
                if top < za < bottom:
                    layers.append((za - za, ca, cb))
                continue
            low, high = max(za, top), min(zb, bottom)
            if low < high:
                gradient = (cb - ca) / (zb - za)
                layers.append((high - low, ca + gradient * (low - za), ca + gradient * (high - za)))
        return layers


@dataclass(frozen=True)
class Sums:
    """Range (m), its slope over p, and travel time (s)."""

    range: Any = 0
    slope: Any = 0
    time: Any = 0

    def __add__(self, other: Sums) -> Sums:
        return Sums(self.range + other.range, self.slope + other.slope, self.time + other.time)

    def __rmul__(self, count: int) -> Sums:
        return Sums(count * self.range, count * self.slope, count * self.time)


def through(p: Any, thickness: Any, c1: Any, c2: Any) -> Sums:
    """Sums through a layer that the ray crosses, or up to where it turns if it turns in it."""
    import mpmath as mp

    if thickness == 0:
        return Sums()
    s1 = mp.sqrt(1 - (p * c1) ** 2)
    if c1 == c2:
        return Sums(thickness * p * c1 / s1, thickness * c1 / s1**3, thickness / (c1 * s1))
    g = (c2 - c1) / thickness
    if p * c2 >= 1:
        return Sums(s1 / (p * g), -(c1**2 / s1 + s1 / p**2) / g, mp.log((1 + s1) / (p * c1)) / g)
    s2 = mp.sqrt(1 - (p * c2) ** 2)
    slope = (c2**2 / s2 - c1**2 / s1 - (s1 - s2) / p**2) / g
    return Sums((s1 - s2) / (p * g), slope, mp.log(c2 * (1 + s1) / (c1 * (1 + s2))) / g)


def beyond(p: Any, layers: list[tuple[Any, Any, Any]]) -> tuple[Sums, bool]:
    """Sums of a ray that goes on through layers to its vertex, and whether it turns there, or meets the boundary."""
    total = Sums()
    for thickness, c1, c2 in layers:
        total += through(p, thickness, c1, c2)
        if p * c2 >= 1:
            return total, True
    return total, False


@dataclass(frozen=True, eq=False)
class Course:
    """The layers that the rays between two depths go through, and the way that one of them takes."""

    above: list[tuple[Any, Any, Any]]  # from the upper end up
    between: list[tuple[Any, Any, Any]]  # from the upper end down to the lower one
    below: list[tuple[Any, Any, Any]]  # from the lower end down

    def sums(self, p: Any, start_low: bool, end_low: bool, down: bool, vertices: int) -> tuple[Sums, int, int, int]:
        """Sums, surface, bottom and turning points of the ray of slowness p."""
        places = [start_low] + [down == (i % 2 == 0) for i in range(vertices)] + [end_low]
        crossed = sum(a != b for a, b in pairwise(places))
        lower = sum(places[1:-1])
        upper = vertices - lower
        total, blocked = beyond(p, self.between)
        if blocked:
            return Sums(float("nan"), 1, 0), 0, 0, 0
        up, turns_above = beyond(p, self.above) if upper else (Sums(), False)
        under, turns_below = beyond(p, self.below) if lower else (Sums(), False)
        turning = turns_above * upper + turns_below * lower
        total = crossed * total + 2 * upper * up + 2 * lower * under
        return total, upper * (not turns_above), lower * (not turns_below), turning


def exact_rays(water: Layers, computed: Rays, slowness: Floats, start: Floats, end: Floats, distance: Floats) -> Rays:
    """The rays near those computed, to more digits than float64 has; NaN where there is none near by.

    Newton's iteration of X(p) = R from the slowness (ray,) s/m of each ray, its launch direction and its number of
    vertices; ends start, end (pair,) m at distances (pair,) m.
    """
    import mpmath as mp

    rows = []
    with mp.workdps(DIGITS):
        for i, pair in enumerate(computed.pair):
            a, b, far = (mp.mpf(float(v[pair])) for v in (start, end, distance))
            top, bottom, bottom_depth = min(a, b), max(a, b), water.nodes[-1][0]
            above = [(dz, below, over) for dz, over, below in reversed(water.down(mp.mpf(0), top))]
            course = Course(above, water.down(top, bottom), water.down(bottom, bottom_depth))
            ways = (a > b, a <= b, bool(computed.start_angle[i] < 0), int(computed.vertices[i]))
            c = [_speed(course, low, water) for low in ways[:2]]
            rows.append(_ray(course, mp.mpf(float(slowness[i])), far, ways, c))
    columns = np.array(rows, float).reshape(-1, 7).T
    surface, bottom, turning = (np.nan_to_num(columns[k], nan=-1.0).astype(int) for k in (4, 5, 6))
    time, first, last, amplitude = columns[:4]
    return Rays(computed.pair, time, first, last, amplitude, surface, bottom, turning)


def _speed(course: Course, low: bool, water: Layers) -> Any:
    """Sound speed at the upper or the lower end."""
    if low:
        return course.below[0][1] if course.below else water.nodes[-1][1]
    return course.above[0][1] if course.above else water.nodes[0][1]


def _ray(course: Course, p: Any, far: Any, ways: tuple[bool, bool, bool, int], c: list[Any]) -> list[float]:
    """(time, start angle, end angle, amplitude, surface, bottom, turning) of one ray."""
    import mpmath as mp

    for _ in range(STEPS):
        total, surface, bottom, turning = course.sums(p, *ways)
        step = (total.range - far) / total.slope
        p -= step
        if not (0 < p * max(c) < 1):
            return [float("nan")] * 7
        if abs(step) < mp.mpf(10) ** (20 - DIGITS) * p:
            break
    else:
        return [float("nan")] * 7
    cosines = [p * speed for speed in c]
    sines = [mp.sqrt(1 - cosine**2) for cosine in cosines]
    amplitude = mp.sqrt(p * c[0] * c[1] / (far * abs(total.slope) * sines[0] * sines[1]))
    first = -1 if ways[2] else 1
    last = first * (-1) ** ways[3]
    angles = [sign * mp.atan2(sine, cosine) for sign, sine, cosine in zip((first, last), sines, cosines, strict=True)]
    return [float(v) for v in (total.time, *angles, amplitude, surface, bottom, turning)]
