"""Which rays a body stands in the way of: bent and reflected ones by the chords that keep to them."""

from __future__ import annotations

import numpy as np

from sonarsynth.casting import intersections
from sonarsynth.casting.ray_casting import enclosing, occluded
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays import ray_arcs
from sonarsynth.equations.rays.ray_solutions import water
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.state import Medium

SAGITTA_TOLERANCE = 1e-5
"""Largest distance (m) of a bent ray from the chords that stand for it when it is tested against bodies."""


def hidden(
    bodies: tuple[PlacedTarget, ...],
    medium: Medium,
    start: Floats,
    end: Floats,
    departure: Floats,
    length: Floats,
    *,
    bounces: Ints | None = None,
    turning: Ints | None = None,
    facets: tuple[Ints | None, Ints | None] = (None, None),
) -> Bools:
    """Whether a body stands in rays (ray, xyz) that leave start in direction departure and end after length (m) at end.

    bounces, turning (ray,): their reflections from surface and bottom, and turning points; facets: the body (ray,) and
    the facet of it (ray,) in whose middle rays start, where they do (`ray_casting.occluded`). Straight rays and
    reflections in uniform water are exact; bent rays are followed by chords within `SAGITTA_TOLERANCE`, but only where
    they may pass a body: no ray is farther from the straight line between its ends, unfolded at its reflections, than
    its largest curvature allows.
    """
    blocked = np.zeros(len(start), bool)
    if not bodies or not len(start):
        return blocked
    if medium.profile.uniform and (bounces is None or not bounces.any()):
        return occluded(bodies, start, end, *facets)
    times = np.zeros(len(start), np.int64) if bounces is None else bounces
    bow = _curvature(medium.profile) * length**2 / 8.0
    broken = (bow > SAGITTA_TOLERANCE) | (times > 0)
    straight = np.flatnonzero(~broken)
    blocked[straight] = occluded(bodies, start[straight], end[straight])
    bent = np.flatnonzero(broken)
    ray = start[bent], end[bent], departure[bent, 2] > 0, times[bent], bow[bent]
    full, first = may_meet(bodies, medium.depth, *ray)
    if turning is not None:
        full |= (times[bent] > 0) & (turning[bent] > 0)  # which boundary comes first, a turn may have changed
    for rays, followed in ((bent[full], length[bent[full]]), (bent[~full], np.minimum(first, length[bent])[~full])):
        leaves = np.flatnonzero(followed > 0.0)
        rows = rays[leaves]
        blocked[rows] = _along_chords(
            bodies, medium, start[rows], end[rows], departure[rows], followed[leaves], length[rows]
        )
    return blocked


def ray_cones(
    bodies: tuple[PlacedTarget, ...],
    medium: Medium,
    start: Floats,
    end: Floats,
    departure: Floats,
    length: Floats,
    spread: Floats,
    *,
    bounces: Ints,
    turning: Ints,
) -> tuple[Floats, Floats, Floats]:
    """Cones that hold what `hidden` looks at of all rays to within `spread` (ray,) m of some: slope, and how far (m)
    along the departure bodies may be met, and surely would be if they close the cone, (ray,) each.

    Arguments as of `hidden`, for the rays to the middle; those beside them, unfolded, end within `spread` of them and
    leave as straight rays to there would. The slope is NaN where no cone is certain: of reflected rays that may meet a
    body again.
    """
    longest, shortest = length + spread, length - spread
    bow = _curvature(medium.profile) * longest**2 / 8.0
    straight = (bounces == 0) & (_curvature(medium.profile) * shortest**2 <= 8.0 * SAGITTA_TOLERANCE)  # some of them
    again, first = may_meet(bodies, medium.depth, start, end, departure[:, 2] > 0, bounces, bow + spread)
    full = straight | again | ((bounces > 0) & (turning > 0))
    reach = np.where(full, longest, np.minimum(first, longest))
    with np.errstate(invalid="ignore", over="ignore"):  # where the speed jumps, rays bend by any angle
        far = 0.98 * np.where(full, shortest, np.minimum(first - 2.0 * (bow + spread), shortest))
        angle = _subtended(spread, length) + 0.5 * _curvature(medium.profile) * reach
    ahead = end - start
    distance = np.linalg.norm(ahead, axis=1)
    off = np.linalg.norm(np.cross(departure, ahead), axis=1) / np.maximum(distance, 1e-300)
    angle = np.where(full, np.maximum(angle, np.arcsin(np.minimum(off, 1.0)) + _subtended(spread, distance)), angle)
    slope = 1.02 * np.tan(np.minimum(angle, 0.5)) + 2e-5  # more than what casting may err by
    room = np.where(departure[:, 2] > 0.0, -start[:, 2], medium.depth + start[:, 2])
    bounced = (bounces > 0) & (full | (reach * (np.abs(departure[:, 2]) + slope) >= room))
    return (
        np.where(bounced | (angle > 0.4) | (bounces > 0) & (np.abs(departure[:, 2]) <= slope), np.nan, slope),
        reach,
        far,
    )


def _subtended(radius: Floats, distance: Floats) -> Floats:
    """Half of the angle (rad) that a ball is seen under; a right angle from within."""
    return np.asarray(np.arcsin(np.minimum(radius / np.maximum(distance, 1e-300), 1.0)))


def overlapping(bodies: tuple[PlacedTarget, ...]) -> list[tuple[int, tuple[PlacedTarget, ...]]]:
    """Bodies that may lie in or on others that come before them: number, and those others.

    Of facets that coincide neither hides the other from a ray that starts off both; one that starts under them does.
    """
    if len(bodies) < 2:
        return []
    centres, radii = (np.array(column) for column in zip(*map(enclosing, bodies), strict=True))
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1)
    near = np.tril(apart < radii[:, None] + radii, -1)
    return [
        (number, tuple(bodies[n] for n in np.flatnonzero(near[number])))
        for number in np.flatnonzero(near.any(axis=1)).tolist()
    ]


def _curvature(profile: Profile) -> float:
    """Largest curvature (1/m) of any ray."""
    if profile.uniform:
        return 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = np.abs(np.diff(profile.speed)) / np.diff(profile.depth)
    return float(np.nanmax(gradient, initial=0.0)) / float(profile.speed.min())


def may_meet(
    bodies: tuple[PlacedTarget, ...],
    bottom: float,
    start: Floats,
    end: Floats,
    up: Bools,
    bounces: Ints,
    bow: Floats,
) -> tuple[Bools, Floats]:
    """Which rays (ray,) may pass a body far from their start, and how far from it (m) others may still be in one.

    bodies; bottom: depth (m); start, end (ray, xyz); up, bounces (ray,): how they leave, and their reflections; bow
    (ray,) m: how far they may be beside the straight line between their ends, unfolded.
    """
    far, first = np.zeros(len(start), bool), np.zeros(len(start))
    for body in bodies:
        centre, radius = enclosing(body)
        inside = np.linalg.norm(start - centre, axis=1) <= radius
        leave = np.where(inside, 2.0 * (radius + bow), 0.0)
        near = np.empty(len(start), bool)
        intersections.folded_pass_near(start, end, up, bounces, bottom, leave, bow, centre, radius, near)
        far |= near
        first = np.maximum(first, leave)
    return far, first


def _along_chords(
    bodies: tuple[PlacedTarget, ...],
    medium: Medium,
    start: Floats,
    end: Floats,
    departure: Floats,
    followed: Floats,
    length: Floats,
) -> Bools:
    """Whether a body stands in a chord of the first `followed` (ray,) m of each ray."""
    blocked = np.zeros(len(start), bool)
    if not len(start):
        return blocked
    ray, points = chords(medium, start, departure, followed)
    last = np.flatnonzero(np.diff(ray, append=-1))
    points[last] = np.where((followed < length)[:, None], points[last], end)
    points[np.flatnonzero(np.diff(ray, prepend=-1))] = start
    pieces = np.flatnonzero(ray[1:] == ray[:-1])
    hits = occluded(bodies, points[pieces], points[pieces + 1])
    blocked[ray[pieces[hits]]] = True
    return blocked


def chords(
    medium: Medium,
    start: Floats,
    departure: Floats,
    length: Floats,
    sagitta: float = SAGITTA_TOLERANCE,
) -> tuple[np.ndarray, Floats]:
    """Polylines that keep within `sagitta` (m) of rays from start (ray, xyz): ray of each node, node (node, xyz)."""
    layers = water(medium.profile.depth, medium.profile.speed, medium.depth)
    z = np.clip(depth(start), 0.0, medium.depth)
    flat = np.hypot(departure[:, 0], departure[:, 1])
    p = flat / np.interp(z, layers.depth, layers.speed)
    angle = -np.arctan2(departure[:, 2], flat)
    room = 8 * len(start) + 64
    count = -1
    while count < 0:
        nodes = np.empty((room, 3))
        count = ray_arcs.chords(layers.depth, layers.speed, z, angle, p, length, sagitta, nodes)
        room *= 2
    ray = nodes[:count, 0].astype(np.int64)
    ahead = np.divide(departure[:, :2], flat[:, None], out=np.zeros((len(start), 2)), where=flat[:, None] > 0)
    points = np.empty((count, 3))
    points[:, :2] = start[ray, :2] + nodes[:count, 1:2] * ahead[ray]
    points[:, 2] = -nodes[:count, 2]
    return ray, points
