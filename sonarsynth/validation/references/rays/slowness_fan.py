"""How many rays join two points: a dense fan of slownesses, and the sign changes of its miss in every family.

Between two slownesses at which a ray just reaches a faster node the course of a family is the same, and its range is a
smooth function of p: there the fan is dense, most of all at both ends, and where the range has an extremum close to the
distance wanted it is made denser. Float64 throughout; it shares no search, and no bracket, with what it checks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.validation.rays.ray_matching import Family

EDGE = np.geomspace(1e-15, 0.02, 400)
FAN = np.concatenate([EDGE, np.linspace(0.02, 0.98, 1000)[1:-1], 1.0 - EDGE[::-1]])
"""Shares of an interval of slowness, from its fast end, where slopes become infinite."""
ZOOM = 2000


def count_rays(
    depth: Floats, speed: Floats, start: Floats, end: Floats, distance: Floats, vertices: int, reflections: int
) -> Counter[Family]:
    """Rays of every family, for pairs of ends (pair,) m, in water of nodes (node,) m and m/s from surface to bottom.

    Ends must lie off the nodes and at different depths.
    """
    counts: Counter[Family] = Counter()
    for pair, (a, b, far) in enumerate(zip(start, end, distance, strict=True)):
        for family, roots in _pair(depth, speed, float(a), float(b), float(far), vertices, reflections):
            if roots:
                counts[(pair, *family)] += roots
    return counts


def _pair(
    depth: Floats, speed: Floats, a: float, b: float, far: float, vertices: int, reflections: int
) -> Iterator[tuple[tuple[int, int, int, int], int]]:
    top, bottom = min(a, b), max(a, b)
    i, j = np.searchsorted(depth, [top, bottom])
    c_top, c_bottom = np.interp([top, bottom], depth, speed)
    up = np.append(top, depth[:i][::-1]), np.append(c_top, speed[:i][::-1])
    down = np.append(bottom, depth[j:]), np.append(c_bottom, speed[j:])
    middle = np.concatenate([[top], depth[i:j], [bottom]]), np.concatenate([[c_top], speed[i:j], [c_bottom]])
    fastest = float(middle[1].max())
    edges = np.unique(np.concatenate([speed[:i], speed[j:], [fastest]]))
    edges = np.append(edges[edges >= fastest], np.inf)
    for slow, fast in pairwise(edges.tolist()):

        def legs(share: Floats, slow: float = slow, fast: float = fast) -> tuple[Floats, ...]:
            """Range (p,) of the three parts of a course at slownesses 1/slow - share (1/slow - 1/fast)."""
            off = share * (1.0 - slow / fast)  # p = (1 - off)/slow
            return tuple(_range(off, slow, fast, *layers) for layers in (up, middle, down))

        above, between, below = legs(FAN)
        turns = bool((up[1] >= fast).any()), bool((down[1] >= fast).any())
        for lower_first in (False, True):
            for count in range(vertices + 1):
                if count == 0 and lower_first != (b > a):
                    continue
                family = _family(count, lower_first, turns)
                if family[1] + family[2] > reflections:
                    continue
                places = [a > b] + [lower_first == (k % 2 == 0) for k in range(count)] + [b >= a]
                weight = (
                    2 * (count - sum(places[1:-1])),
                    sum(m != n for m, n in pairwise(places)),
                    2 * sum(places[1:-1]),
                )
                miss = _total(weight, (above, between, below)) - far
                roots = _changes(miss)
                for k in _dips(miss):
                    fine = np.linspace(FAN[k - 1], FAN[k + 1], ZOOM)
                    roots += _changes(_total(weight, legs(fine)) - far)
                yield family, roots


def _family(count: int, lower_first: bool, turns: tuple[bool, bool]) -> tuple[int, int, int, int]:
    """Launch sign, surface, bottom and turning points."""
    lower = (count + lower_first) // 2
    upper = count - lower
    surface, bottom = upper * (not turns[0]), lower * (not turns[1])
    return (-1 if lower_first else 1), surface, bottom, count - surface - bottom


def _range(off: Floats, slow: float, fast: float, depth: Floats, speed: Floats) -> Floats:
    """Range (p,) along nodes at p = (1 - off)/slow, to the end or to the turning point before a node of `fast`."""
    total = np.zeros(len(off))
    pace = (1.0 - off) / slow

    def sine(c: float) -> Floats:
        complement = (slow - c) / slow + off * (c / slow)  # 1 - p c
        return np.asarray(np.sqrt(np.maximum(complement * (1.0 + pace * c), 1e-300)))

    s1 = sine(float(speed[0]))
    for dz, c1, c2 in zip(np.abs(np.diff(depth)), speed[:-1], speed[1:], strict=True):
        if c2 >= fast:
            return np.asarray(total + s1 * dz / (pace * (c2 - c1)))
        s2 = sine(float(c2))
        total += pace * (c1 + c2) * dz / (s1 + s2)
        s1 = s2
    return total


def _total(weight: tuple[int, int, int], ranges: tuple[Floats, ...]) -> Floats:
    return np.asarray(sum(w * distance for w, distance in zip(weight, ranges, strict=True) if w))


def _changes(miss: Floats) -> int:
    return int(np.sum((miss[1:] > 0) != (miss[:-1] > 0)))


def _dips(miss: Floats) -> list[int]:
    """Samples at which the miss comes closest to zero without a change of sign near by, and may reach it in between."""
    m = miss[1:-1]
    size = np.abs(miss)
    least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    same = ((miss[:-2] > 0) == (m > 0)) & ((miss[2:] > 0) == (m > 0))
    spread = np.maximum(size[:-2], size[2:]) - size[1:-1]
    return [int(k) + 1 for k in np.flatnonzero(least & same & (size[1:-1] <= spread))]
