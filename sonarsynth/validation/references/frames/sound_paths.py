"""Paths of a snap to a hydrophone when all is on the move: when the sound meets each facet, and when it is heard.

A ray takes T(x, y) from x to y. Sound that leaves the snap at t_s meets the facet where that is then, and the
hydrophone where it is then:

    t_1 = t_s + T(snap, x(t_1)),    t_2 = t_1 + T(x(t_1), y(t_2)),

solved by going round. With v, u the velocities of facet and hydrophone and unit vectors of travel a on the way to the
facet, d on the way from it and b at the hydrophone, a pulse lasts

    dt_2/dt_s = (1 - v.d/c)/((1 - v.a/c)(1 - u.b/c_y))

times as long. Bodies that may stand in the way are where they are when the ray passes them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.validation.references.frames.line_of_sight import Surface
from sonarsynth.validation.references.frames.moving_points import Mover
from sonarsynth.validation.references.rays.layered_rays import Family, Rays, rays
from sonarsynth.validation.references.rays.layers_crossed import Water

ROUNDS = 40
SETTLED = 1e-14
"""s: times are found to this."""
CHORDS = 16
"""Straight pieces that bent rays are tested against bodies by, shorter near their start."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A body that may stand in the way."""

    mover: Mover
    surface: Surface


def met(water: Water, snap: Floats, sent: float, mover: Mover, body: Floats, family: Family) -> tuple[Floats, Rays]:
    """When (point,) s sound that a snap at a place (xyz) sends at a time meets points of a body (point, xyz), its
    frame, and the rays from there back to the snap; family: as from the points."""
    source = np.broadcast_to(snap, body.shape)
    time = np.full(len(body), sent)
    for _ in range(ROUNDS):
        ray = rays(water, mover.points(body, time), source, family)
        before, time = time, sent + np.nan_to_num(ray.time)
        if not mover.velocity(body[:1], time[:1]).any() or not (np.abs(time - before) > SETTLED).any():
            break
    return time, ray


def arrival_times(
    water: Water, point: Floats, time: Floats, sonar: Mover, hydrophone: Floats, family: Family
) -> tuple[Floats, Rays]:
    """When (point,) s sound that leaves points of the world (point, xyz) at times (point,) is heard by a hydrophone at
    a place of the sonar (xyz), its frame, and the rays."""
    body, late = np.broadcast_to(hydrophone, point.shape), time.copy()
    for _ in range(ROUNDS):
        ray = rays(water, point, sonar.points(body, late), family)
        before, late = late, time + np.nan_to_num(ray.time)
        if not sonar.velocity(body[:1], late[:1]).any() or not (np.abs(late - before) > SETTLED).any():
            break
    return late, ray


def hidden(
    solids: list[Solid], water: Water, start: Floats, end: Floats, ray: Rays, leaves: Floats, arrives: Floats
) -> Bools:
    """Whether bodies stand in rays between start and end (ray, xyz), where sound is at two times (ray,), or there is
    no ray; `start` may be moved off a facet. Bodies go on at their velocity from the first of the times."""
    out = ~np.isfinite(ray.time)
    if out.any():
        there = np.flatnonzero(~out)
        if len(there):
            rest = start[there], end[there], ray.select(there), leaves[there], arrives[there]
            out[there] = hidden(solids, water, *rest)
        return out
    points = _unfolded(water, start, end, ray)
    later = (arrives - leaves)[:, None] * (np.arange(points.shape[1]) / (points.shape[1] - 1)) ** 2
    for k in range(points.shape[1] - 1):
        a, b = points[:, k], points[:, k + 1]
        low, high = (np.floor(f(a[:, 2], b[:, 2]) / water.bottom).astype(int) for f in (np.minimum, np.maximum))
        for copy in range(int(low.min(initial=0)), int(high.max(initial=0)) + 1):
            rows = np.flatnonzero((low <= copy) & (copy <= high) & ~out)
            if not len(rows):
                continue
            ends = [_folded(x[rows], copy, water.bottom) for x in (a, b)]
            for solid in solids:
                gone = solid.mover.velocity(np.zeros((len(rows), 3)), leaves[rows])
                own = [
                    solid.mover.own(x - gone * later[rows, n, None], leaves[rows])
                    for x, n in zip(ends, (k, k + 1), strict=True)
                ]
                out[rows] |= solid.surface.between(*own)
    return out


def _folded(point: Floats, copy: int, bottom: float) -> Floats:
    """Points (ray, xyz) in the world of points (ray, xyu) in a copy of the water."""
    z = point[:, 2] - copy * bottom if copy % 2 == 0 else (copy + 1) * bottom - point[:, 2]
    return np.column_stack([point[:, :2], -z])


def _unfolded(water: Water, start: Floats, end: Floats, ray: Rays) -> Floats:
    """Points (ray, point, xyu) along rays, in the unfolded water."""
    level = end[:, :2] - start[:, :2]
    first = np.column_stack([start[:, :2], -start[:, 2]])
    last = np.column_stack([end[:, :2], ray.level[:, 1]])
    if np.ptp(water.speed) == 0.0:
        return np.stack([first, last], axis=1)
    r = np.hypot(level[:, 0], level[:, 1])
    copies = range(int(np.floor(ray.level.min() / water.bottom)) - 1, int(np.floor(ray.level.max() / water.bottom)) + 2)
    at, speed = water.unfolded(copies)
    thick = np.diff(at)
    slope = np.where(thick > 0.0, np.diff(speed) / np.where(thick > 0.0, thick, 1.0), 0.0)
    points, u, sine = [first], ray.level[:, 0], ray.sine
    for k in range(CHORDS - 1):
        dx = r * ((k + 1) ** 2 - k**2) / CHORDS**2
        g = slope[np.clip(np.searchsorted(at, u, side="right") - 1, 0, len(slope) - 1)]
        after = np.clip(sine - ray.cosine * g * dx, -1.0, 1.0)
        cosines = [np.sqrt(np.maximum(1.0 - s**2, 1e-12)) for s in (sine, after)]
        u, sine = u + dx * (sine + after) / sum(cosines), after
        points.append(np.column_stack([start[:, :2] + level * ((k + 1) / CHORDS) ** 2, u]))
    return np.stack([*points, last], axis=1)


def depths(water: Water, ray: Rays) -> Floats:
    """Integrals (ray, 3) of 1, depth and depth squared along rays, in m, m2 and m3, as if they were straight in the
    unfolded water."""
    a, b = np.minimum(ray.level[:, 0], ray.level[:, 1]), np.maximum(ray.level[:, 0], ray.level[:, 1])
    h, total = water.bottom, np.zeros((len(a), 2))
    for copy in range(int(np.floor(a.min(initial=0.0) / h)), int(np.floor(b.max(initial=0.0) / h)) + 1):
        ends = [np.clip(u, copy * h, (copy + 1) * h) for u in (a, b)]
        x, y = (e - copy * h if copy % 2 == 0 else (copy + 1) * h - e for e in ends)
        share = (ends[1] - ends[0]) / np.where(b > a, b - a, 1.0)
        total += share[:, None] * np.column_stack([0.5 * (x + y), (x * x + x * y + y * y) / 3.0])
    level = np.mod(a, 2.0 * h)
    level = np.where(level > h, 2.0 * h - level, level)
    total = np.where((b > a)[:, None], total, np.column_stack([level, level**2]))
    return ray.length[:, None] * np.column_stack([np.ones(len(a)), total])
