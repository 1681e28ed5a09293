"""Which rays a body stands in the way of: bent and reflected ones by the chords that keep to them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.casting import folded_rays
from sonarsynth.casting.cones import CLOSED, EMPTY, UNKNOWN, classify_cones
from sonarsynth.casting.ray_casting import enclosing, occluded
from sonarsynth.columns import picked
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays import ray_arcs
from sonarsynth.equations.rays.ray_solutions import water
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.state import Medium

SAGITTA_TOLERANCE = 1e-5
"""Largest distance (m) of a bent ray from the chords that stand for it when it is tested against bodies."""
NO_CONE = 3
"""Rays that are in no narrow cone for certain."""


def hidden(
    bodies: tuple[PlacedTarget, ...], medium: Medium, start: Floats, end: Floats, departure: Floats, length: Floats,
    *, bounces: Ints | None = None, turning: Ints | None = None,
    facets: tuple[Ints | None, Ints | None] = (None, None),
) -> Bools:  # fmt: skip
    """Whether a body stands in rays (ray, xyz) that leave start in direction departure and end after length (m) at end.

    bounces, turning (ray,): their reflections from surface and bottom, and turning points; facets: the body (ray,) and
    the facet of it (ray,) in whose middle rays start, where they do (`ray_casting.occluded`). Straight rays and
    reflections in uniform water are exact; bent rays are followed by chords within `SAGITTA_TOLERANCE`, but only where
    no narrow cone that holds them tells (`classify_rays`).
    """
    blocked = np.zeros(len(start), bool)
    if not bodies or not len(start):
        return blocked
    if medium.profile.uniform and (bounces is None or not bounces.any()):
        return occluded(bodies, start, end, *facets)
    times, turns = (np.zeros(len(start), np.int64) if of is None else of for of in (bounces, turning))
    ray = start, end, departure, length, np.zeros(len(start))
    verdict = classify_rays(bodies, medium, *ray, bounces=times, turning=turns, facets=facets)
    blocked[verdict == CLOSED] = True
    left = np.flatnonzero(verdict >= UNKNOWN)
    blocked[left] = _along_chords(bodies, medium, start[left], end[left], departure[left], length[left])
    return blocked


def classify_rays(
    bodies: tuple[PlacedTarget, ...], medium: Medium, start: Floats, end: Floats, departure: Floats, length: Floats,
    spread: Floats, *, bounces: Ints, turning: Ints, facets: tuple[Ints | None, Ints | None],
) -> Ints:  # fmt: skip
    """What is certain (ray,) of all rays to within `spread` (ray,) m of some ends, as of `classify_cones`: by cones
    that hold what `hidden` looks at of them, or by rays where they are straight so far. NO_CONE where there is none: of
    reflected rays that may meet a body again.

    Arguments as of `hidden`, for the rays to the middle; those beside them, unfolded, end within `spread` of them and
    leave as straight rays to there would.
    """
    limits = layer_curvatures(medium.profile), SAGITTA_TOLERANCE, medium.depth
    cones = folded_rays.ray_cones(start, end, departure, length, spread, bounces, turning, *limits, *spheres(bodies))
    verdict, sure = np.full(len(start), NO_CONE), picked(np.isfinite(cones[0]))
    slope, reach, far = (column[sure] for column in cones)
    owner, facet = (None if of is None else of[sure] for of in facets)
    apex, axis = start[sure], departure[sure]
    if medium.profile.uniform and not spread.any():
        verdict[sure] = np.where(occluded(bodies, apex, apex + reach[:, None] * axis, owner, facet), CLOSED, EMPTY)
    else:
        verdict[sure] = classify_cones(bodies, apex, axis, slope, reach, far, (owner, facet))
    return verdict


def spheres(bodies: tuple[PlacedTarget, ...]) -> tuple[Floats, Floats]:
    """Centres (body, xyz) in the world and radii (body,) m of spheres a little larger than bodies."""
    found = [enclosing(body) for body in bodies]
    return np.reshape([centre for centre, _ in found], (-1, 3)), np.array([radius for _, radius in found])


def overlapping(bodies: tuple[PlacedTarget, ...]) -> list[tuple[int, tuple[PlacedTarget, ...]]]:
    """Bodies that may lie in or on others that come before them: number, and those others.

    Of facets that coincide neither hides the other from a ray that starts off both; one that starts under them does.
    """
    if len(bodies) < 2:
        return []
    centres, radii = spheres(bodies)
    apart = np.linalg.norm(centres[:, None] - centres, axis=-1)
    near = np.tril(apart < radii[:, None] + radii, -1)
    return [
        (number, tuple(bodies[n] for n in np.flatnonzero(near[number])))
        for number in np.flatnonzero(near.any(axis=1)).tolist()
    ]


@lru_cache(maxsize=64)
def layer_curvatures(profile: Profile) -> tuple[Floats, Floats]:
    """Depths of the nodes (node,) m of a profile, and the largest curvature of rays in each layer (node - 1,) 1/m."""
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = np.abs(np.diff(profile.speed)) / np.diff(profile.depth)
    return profile.depth, np.nan_to_num(gradient, nan=0.0, posinf=np.inf) / profile.speed.min()


def _along_chords(
    bodies: tuple[PlacedTarget, ...], medium: Medium, start: Floats, end: Floats, departure: Floats, length: Floats
) -> Bools:
    """Whether a body stands in a chord of each ray."""
    blocked = np.zeros(len(start), bool)
    if not len(start):
        return blocked
    ray, points = chords(medium, start, departure, length)
    points[np.flatnonzero(np.diff(ray, append=-1))] = end
    points[np.flatnonzero(np.diff(ray, prepend=-1))] = start
    pieces = np.flatnonzero(ray[1:] == ray[:-1])
    hits = occluded(bodies, points[pieces], points[pieces + 1])
    blocked[ray[pieces[hits]]] = True
    return blocked


def chords(
    medium: Medium, start: Floats, departure: Floats, length: Floats, sagitta: float = SAGITTA_TOLERANCE
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
