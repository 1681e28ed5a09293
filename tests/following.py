"""Rays followed leg by leg through layered water by Snell's law: launch, refract, turn, reflect, and note every visit.

Nothing is shared with the search for eigenrays: no sums with multiplicities, no bounds, no chains. Works on one ray or
on many that see the same layers, in NumPy's long doubles.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions

Family = tuple[int, int, int, int, int]
"""(launch sign, surface, bottom, turning, arrival sign), up positive: no two rays of one such path cross."""


@dataclass(frozen=True)
class Visit:
    """A ray where it passes the depth of the receiver: counts so far, sense of travel (1 up), range so far."""

    surface: int
    bottom: int
    turning: int
    up: int
    range: Any  # m, of one ray or of many


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
    return p[len(p) // 2] if isinstance(p, np.ndarray) else p


def sides(z: list[Any], start: Any, end: Any) -> tuple[int, int]:
    """Nodes of the two ends; on a jump the side that faces the other end."""
    upper, lower = z.index, lambda depth: len(z) - 1 - z[::-1].index(depth)
    return (upper if start > end else lower)(start), (upper if end > start else lower)(end)


def follow(
    z: list[Any], c: list[Any], ends: tuple[Any, Any], p: Any, up: int, vertices: int, reflections: int
) -> Iterator[Visit]:
    """Visits of a ray of slowness p to the second depth, up to a number of vertices; it leaves the first up or down.

    An end on a jump is on the side that faces the other end, on the lower side where both are there.
    """
    last, typical = len(z) - 1, middle(p)
    i, receiver = sides(z, *ends)
    surface = bottom = turning = 0
    total = 0
    while True:
        j = i - up  # the next node
        if 0 <= j <= last and typical * c[j] < 1:
            total = total + through(p, abs(z[j] - z[i]), c[i], c[j])
            i = j
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


def through(p: Any, dz: Any, c1: Any, c2: Any) -> Any:
    """Range (m) through a layer of thickness dz; c2 None where the ray becomes level."""
    s1 = np.sqrt((1 - p * c1) * (1 + p * c1))
    if c2 is None:
        return (p * c1 + 1) * dz / s1
    return p * (c1 + c2) * dz / (s1 + np.sqrt((1 - p * c2) * (1 + p * c2)))


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
        p = float(1 / c[z.index(a)])
        for rows in found:
            rows.append(((0, 0, 0, 0, 0), p, p))
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


def family(found: ray_solutions.Eigenrays, i: int) -> Family:
    """The family of a found ray."""
    counts = int(found.surface[i]), int(found.bottom[i]), int(found.turning[i])
    return int(np.sign(found.start_sine[i])), *counts, int(np.sign(found.end_sine[i]))


def images(bottom_depth: float, start: float, end: float, reflections: int) -> list[tuple[int, int, int, int, float]]:
    """Paths in uniform water, shortest first: launch sign, surface, bottom, arrival sign, height gone (m)."""
    direct = int(np.sign(start - end))
    rows = [(direct, 0, 0, direct, abs(start - end))]
    for hits in range(1, reflections + 1):
        for up in (1, -1):
            last_up = up if hits % 2 else -up  # sense of travel before the last hit
            height = (
                (start if up > 0 else bottom_depth - start)
                + (hits - 1) * bottom_depth
                + (end if last_up > 0 else bottom_depth - end)
            )
            first, second = (hits + 1) // 2, hits // 2
            rows.append((up, first if up > 0 else second, second if up > 0 else first, -last_up, height))
    return sorted(rows, key=lambda row: row[4])


def random_water(rng: np.random.Generator, layers: int, spread: float) -> ray_solutions.Water:
    """A random profile over a bottom at 100 m; some layers of one speed, some jumps."""
    depth = np.sort(rng.uniform(0.0, 100.0, layers))
    speed = 1500.0 + spread * rng.normal(size=layers)
    if layers > 3 and rng.random() < 0.5:
        speed[2] = speed[1]
    if layers > 4 and rng.random() < 0.5:
        depth[4] = depth[3]
    return ray_solutions.water(depth, speed, 100.0)
