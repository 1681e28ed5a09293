"""Rays followed leg by leg through layered water by Snell's law: launch, refract, turn, reflect, and note every visit.

A dense fan of them has every ray that joins two points. Nothing is shared with the search for eigenrays: no sums with
multiplicities, no bounds, no chains. Works on one ray or on many that see the same layers, in NumPy's long doubles.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.rays import ray_matching

Family = tuple[int, int, int, int, int]
"""(launch sign, surface, bottom, turning, arrival sign), up positive: no two rays of one such path cross."""


@dataclass(frozen=True)
class Visit:
    """A ray where it passes the depth of the receiver: counts so far, sense of travel (1 up), range so far."""

    surface: int
    bottom: int
    turning: int
    up: int
    range: Any  # m, of one ray or of many; or what else was summed up


def nodes(water: ray_solutions.Water, ends: tuple[float, float]) -> tuple[list[Any], list[Any]]:
    """Depths and speeds of the profile as long doubles, with nodes at the two ends."""
    number = np.longdouble
    z, c = [number(float(v)) for v in water.depth], [number(float(v)) for v in water.speed]
    for end in map(number, ends):
        if end not in z:
            i = next(i for i, depth in enumerate(z) if depth > end)
            c.insert(i, c[i - 1] + (c[i] - c[i - 1]) * (end - z[i - 1]) / (z[i] - z[i - 1]))
            z.insert(i, end)
    return z, c


def middle(p: Any) -> Any:
    """One of the slownesses, which stands for all."""
    return p[len(p) // 2] if isinstance(p, np.ndarray) else p


def sides(z: list[Any], start: Any, end: Any) -> tuple[int, int]:
    """Nodes of the two ends; on a jump the side that faces the other end."""
    first, last = (
        [z.index(depth) for depth in (start, end)],
        [len(z) - 1 - z[::-1].index(depth) for depth in (start, end)],
    )
    return (first if start > end else last)[0], (first if end > start else last)[1]


def range_through(p: Any, dz: Any, c1: Any, c2: Any) -> Any:
    """Range (m) through a layer of thickness dz; c2 None where the ray becomes level."""
    s1 = np.sqrt((1 - p * c1) * (1 + p * c1))
    if c2 is None:
        return (p * c1 + 1) * dz / s1
    return p * (c1 + c2) * dz / (s1 + np.sqrt((1 - p * c2) * (1 + p * c2)))


def follow(
    z: list[Any],
    c: list[Any],
    ends: tuple[Any, Any],
    p: Any,
    up: int,
    vertices: int,
    reflections: int,
    through: Callable[[Any, Any, Any, Any], Any] = range_through,
) -> Iterator[Visit]:
    """Visits of a ray of slowness p to the second depth, up to a number of vertices; it leaves the first up or down.

    An end on a jump is on the side that faces the other end, on the lower side where both are there. through: what is
    summed up over layers, in place of ranges.
    """
    last, typical = len(z) - 1, middle(p)
    i, receiver = sides(z, *ends)
    surface = bottom = turning = 0
    total, layers = 0, {}  # what each layer adds, by its upper node
    while True:
        j = i - up  # the next node
        if 0 <= j <= last and typical * c[j] < 1:
            if (upper := min(i, j)) not in layers:
                layers[upper] = through(p, abs(z[j] - z[i]), c[i], c[j])
            total, i = total + layers[upper], j
        else:
            if j < 0 or j > last:
                surface, bottom = surface + (up > 0), bottom + (up < 0)
            else:
                part = (1 / p - c[i]) / (c[j] - c[i])
                if z[j] != z[i]:
                    total = total + 2 * through(p, abs(z[j] - z[i]) * part, c[i], None)
                turning += 1
            up = -up
            if surface + bottom + turning > vertices or surface + bottom > reflections:
                return
        if i == receiver:
            yield Visit(surface, bottom, turning, up, total)


def fan(critical: list[Any], count: int = 600) -> Iterator[Floats]:
    """Slownesses between neighbours of the list, crowded at both ends of each interval as far as numbers are dense."""
    for low, high in pairwise(critical):
        crowd = min(32.0, float(np.log((high - low) / (1e-16 * high))))
        if crowd > 0:
            yield low + (high - low) / (1 + np.exp(-np.linspace(-crowd, crowd, count, dtype=np.longdouble)))


def families(
    water: ray_solutions.Water, start: float, end: float, distances: Floats, vertices: int, reflections: int
) -> list[list[tuple[Family, float, float]]]:
    """For each distance, every ray that a dense fan finds: its family and two slownesses that bracket it.

    Neighbours of one history whose ranges straddle the distance hold a ray; where they only come near it (a fold), the
    fan is refined.
    """
    number = np.longdouble
    z, c = nodes(water, (start, end))
    a, b = number(start), number(end)
    found: list[list[tuple[Family, float, float]]] = [[] for _ in distances]
    for up in (1, -1):
        critical = sorted({number(0), *(1 / v for v in c if v >= c[sides(z, a, b)[0]])})
        for p in fan(critical):

            def ranges(q: Any, up: int = up) -> list[tuple[Family, Any]]:
                visits = follow(z, c, (a, b), q, up, vertices, reflections)
                return [((up, v.surface, v.bottom, v.turning, v.up), v.range) for v in visits]

            for which, (family, x) in enumerate(ranges(p)):
                if np.ndim(x) == 0:
                    continue  # no way at all between the ends
                for k, distance in enumerate(distances):
                    found[k] += [
                        (family, *pair)
                        for pair in straddling(p, x - distance, lambda q, w=which, d=distance: ranges(q)[w][1] - d)
                    ]
    level = start == end and any(
        z[i] <= a <= z[i + 1] and c[i] == c[i + 1] and z[i] < z[i + 1] for i in range(len(z) - 1)
    )
    if level:
        flat = float(1 / c[z.index(a)])
        for rows in found:
            rows.append(((0, 0, 0, 0, 0), flat, flat))
    return found


def straddling(p: Any, miss: Any, at: Any, depth: int = 3) -> list[tuple[float, float]]:
    """Pairs of neighbouring slownesses between which the miss changes its sign, folds between samples included."""
    positive = miss > 0
    changes = np.flatnonzero(positive[1:] != positive[:-1])
    pairs = [(float(p[i]), float(p[i + 1])) for i in changes]
    size = np.abs(miss)
    inner = (size[1:-1] < size[:-2]) & (size[1:-1] <= size[2:])
    inner &= (positive[1:-1] == positive[:-2]) & (positive[1:-1] == positive[2:])
    for i in np.flatnonzero(inner) + 1:
        if depth and size[i] < 4 * max(size[i - 1] - size[i], size[i + 1] - size[i]):
            q = np.linspace(p[i - 1], p[i + 1], 101, dtype=np.longdouble)
            pairs += straddling(q, at(q), at, depth - 1)
    return pairs


def count_rays(
    water: ray_solutions.Water, start: Floats, end: Floats, distance: Floats, vertices: int, reflections: int
) -> Counter[ray_matching.Family]:
    """Rays of every family, for pairs of ends at depths (pair,) m, in distances (pair,) m."""
    return Counter(
        (pair, *family[:4])
        for pair, (a, b, far) in enumerate(zip(start, end, distance, strict=True))
        for family, *_ in families(water, float(a), float(b), np.array([far]), vertices, reflections)[0]
    )
