"""Meshes of bodies of revolution along x, refined on the true surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.geometry.surfaces import MeshError, Surface, longest_edge, require_possible

FEWEST = 8
"""Vertices of the smallest ring that is not a point: from FEWEST to twice that."""


@dataclass(frozen=True)
class Arc:
    """A smooth piece of a meridian: (x, r) at a parameter in [0, 1], exact, and parameters that sample it densely."""

    point: Callable[[Floats], tuple[Floats, Floats]]
    samples: Floats

    def along(self) -> tuple[Floats, Floats, Floats]:
        """x, r and arc length (m) at the samples."""
        x, r = self.point(self.samples)
        return x, r, np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(r)))])


def line(start: tuple[float, float], stop: tuple[float, float]) -> Arc:
    """A straight piece of a meridian between two points (x, r)."""
    (x0, r0), (x1, r1) = start, stop
    return Arc(lambda u: ((1 - u) * x0 + u * x1, (1 - u) * r0 + u * r1), np.linspace(0.0, 1.0, 1025))


def enclosed_volume(meridian: Sequence[Arc]) -> float:
    """Volume (m3) of the true body, by cones between the dense samples."""
    total = 0.0
    for arc in meridian:
        x, r, _ = arc.along()
        total += float(np.sum(-np.diff(x) * (r[1:] ** 2 + r[1:] * r[:-1] + r[:-1] ** 2))) * np.pi / 3.0
    return total


def revolve(meridian: Sequence[Arc], edge: float, sagitta: float) -> Surface:
    """A closed mesh of the body, with vertices on the true surface and no edge longer than `edge` (m).

    sagitta (m): the mean distance of facets from the true surface is about that at most, across each principal
    direction; facets are then long along the direction in which the body is flat.

    The meridian runs from the foremost point to the aftmost one, on the axis at both ends (r = 0). Rings of vertices
    are staggered by half a step, which makes nearly equilateral facets; a ring has half as many vertices as its
    neighbour where the girth has shrunk enough. Facets are numbered from the foremost to the aftmost.
    """
    greatest = max(float(arc.along()[1].max()) for arc in meridian)
    target = min(edge, greatest)
    area = sum(2 * np.pi * float(np.trapezoid(r, s)) for _, r, s in (arc.along() for arc in meridian))
    require_possible(area, target)
    for _ in range(40):
        surface = rings(*_stations(meridian, target, sagitta))
        longest = longest_edge(surface)
        if longest <= edge:
            return surface
        target *= max(0.7, 0.999 * edge / longest)
    raise MeshError(f"no mesh with edges of {edge:g} m was found; use a longer edge")


def _stations(meridian: Sequence[Arc], edge: float, sagitta: float) -> tuple[Floats, Floats, Ints]:
    """x, r and the number of vertices of each ring (1 on the axis)."""
    limits = [_limits(arc, edge, sagitta) for arc in meridian]
    for (_, before), (_, after) in pairwise(limits):
        before[-1] = after[0] = min(before[-1], after[0])  # they share a ring
    round_all = [_round_the_girth(a.along()[1], girth) for a, (_, girth) in zip(meridian, limits, strict=True)]
    needed = max(FEWEST, *round_all)
    halvings = int(np.log2(needed / FEWEST))
    smallest = -(-needed // 2**halvings)
    x_parts, r_parts, count_parts = [], [], []
    for i, (arc, (step, girth)) in enumerate(zip(meridian, limits, strict=True)):
        x, r, s = arc.along()
        count = _vertices(r, girth, smallest, halvings)
        chord = 2.0 * r * np.sin(0.5 * np.pi / count)  # to the neighbour ring, staggered by half a step
        pace = 1.0 / np.minimum(step, np.sqrt(np.maximum(edge**2 - chord**2, (0.5 * edge) ** 2)))
        steps = np.concatenate([[0.0], np.cumsum(np.diff(s) * 0.5 * (pace[1:] + pace[:-1]))])
        number = max(1, int(np.ceil(steps[-1] - 1e-9)))
        at = np.interp(np.linspace(0.0, steps[-1], number + 1), steps, arc.samples)[int(i > 0) :]
        points = arc.point(at)
        x_parts.append(points[0])
        r_parts.append(points[1])
        count_parts.append(_vertices(points[1], np.interp(at, arc.samples, girth), smallest, halvings))
    x, r, count = np.concatenate(x_parts), np.concatenate(r_parts), np.concatenate(count_parts)
    count[[0, -1]] = 1
    r[[0, -1]] = 0.0
    return x, r, count


def _limits(arc: Arc, edge: float, sagitta: float) -> tuple[Floats, Floats]:
    """Longest step along the meridian and longest chord round the girth (m) at the samples of an arc.

    The mean distance of a facet of height h on a chord w is h^2/(12 R) + w^2/(16 r') from a surface with the radii of
    curvature R along the meridian and r' = r/cos(slope) across it. The height takes half of what is allowed at most.
    """
    x, r, s = arc.along()
    unlimited = np.full(len(s), np.inf)
    if np.isinf(sagitta):
        return unlimited, np.full(len(s), edge)
    slope = np.unwrap(np.arctan2(np.diff(r), np.diff(x)))
    bent = np.abs(np.diff(slope)) / (0.5 * (s[2:] - s[:-2]))  # 1/m
    bent = np.concatenate([bent[:1], bent, bent[-1:]])
    lean = np.abs(np.cos(slope))
    lean = np.minimum(np.append(lean, lean[-1]), np.append(lean[:1], lean))
    with np.errstate(divide="ignore"):
        step = np.minimum(np.sqrt(6.0 * sagitta / bent), edge)
        allowed = sagitta - step**2 * bent / 12.0
        girth = np.minimum(4.0 * np.sqrt(allowed * r / lean), edge)
    return step, np.where(r > 0, girth, edge)


def _round_the_girth(radius: Floats, chord: Floats) -> int:
    """Fewest vertices of rings of which none has a longer chord than it may (m)."""
    share = float(np.max(radius / chord))
    return int(np.ceil(np.pi / np.arcsin(min(1.0, 0.5 / share)) - 1e-9)) if share > 0.5 else 2


def _vertices(radius: Floats, chord: Floats, smallest: int, halvings: int) -> Ints:
    """Vertices of rings: smallest times a power of two, the fewest whose chords are no longer than they may (m)."""
    choices = smallest * 2 ** np.arange(halvings + 1)
    reach = 0.5 / np.sin(np.pi / choices)  # the largest radius over chord that each choice serves
    reach[-1] = np.inf
    return np.asarray(choices[np.searchsorted(reach, radius / chord * (1 - 1e-12))])


def rings(x: Floats, radius: Floats, count: Ints) -> Surface:
    """Mesh between rings of `count` vertices at x with a radius, from the largest x down; a count of 1 is a point."""
    full = int(count.max())
    phase = 0  # in half steps of the finest ring: whole numbers, so that no angle drifts
    phases, vertices = [], []
    for i, n in enumerate(count):
        if i and n == count[i - 1]:
            phase += full // n  # staggered; rings of different count share the vertices of the smaller one
        phases.append(phase)
        angle = np.pi / full * ((phase + 2 * (full // n) * np.arange(n)) % (2 * full))
        vertices.append(np.stack([np.full(n, x[i]), radius[i] * np.cos(angle), radius[i] * np.sin(angle)], axis=1))
    starts = np.concatenate([[0], np.cumsum(count)])
    bands = [
        _band(full, (int(starts[i]), int(count[i]), phases[i]), (int(starts[i + 1]), int(count[i + 1]), phases[i + 1]))
        for i in range(len(count) - 1)
    ]
    return np.concatenate(vertices), np.concatenate(bands)


def _band(full: int, front: tuple[int, int, int], back: tuple[int, int, int]) -> Ints:
    """Facets between two rings (first vertex, vertices, phase): each edge of a ring with the other's nearest vertex."""
    a, n, at_a = front
    b, m, at_b = back
    fans = []
    if n > 1:
        apex = b + _nearest(full, n, at_a, m, at_b)
        i = np.arange(n)
        fans.append((_middles(full, n, at_a), np.stack([a + i, apex, a + (i + 1) % n], axis=1)))
    if m > 1:
        apex = a + _nearest(full, m, at_b, n, at_a)
        i = np.arange(m)
        fans.append((_middles(full, m, at_b), np.stack([b + i, b + (i + 1) % m, apex], axis=1)))
    angle = np.concatenate([p[0] % (2 * full) for p in fans])
    return np.concatenate([p[1] for p in fans])[np.argsort(angle, kind="stable")]


def _middles(full: int, n: int, phase: int) -> Ints:
    """Angles of the middles of a ring's edges, in half steps of the finest ring."""
    return np.asarray(phase + (full // n) * (2 * np.arange(n) + 1))


def _nearest(full: int, n: int, phase: int, m: int, phase_m: int) -> Ints:
    """The vertex of the other ring (m vertices) nearest to the middle of each edge of a ring of n."""
    if m == 1:
        return np.zeros(n, int)
    step = 2 * (full // m)
    return np.asarray(((_middles(full, n, phase) - phase_m + step // 2) // step) % m)
