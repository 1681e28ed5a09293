"""Which rays a body stands in the way of: bent and reflected ones by the chords that keep to them."""

from __future__ import annotations

import numpy as np

from sonarsynth.acoustics.rays import water
from sonarsynth.conventions import Bools, Floats, depth
from sonarsynth.world.casting import occluded
from sonarsynth.world.environment import Environment, Profile
from sonarsynth.world.moment import Body

BOW = 1e-3
"""Largest distance (m) of a bent ray from the chords that stand for it when it is tested against bodies."""


def hidden(
    bodies: tuple[Body, ...],
    environment: Environment,
    profile: Profile,
    start: Floats,
    end: Floats,
    departure: Floats,
    length: Floats,
    reflected: Bools | None = None,
) -> Bools:
    """Whether a body stands in rays (ray, xyz) that leave start in direction departure and end after length (m) at end.

    reflected (ray,): which of them meet surface or bed on the way. Straight rays and reflections in uniform water are
    exact; bent rays are followed by chords within `BOW`.
    """
    if not bodies or not len(start):
        return np.zeros(len(start), bool)
    steepest = 0.0
    if not profile.uniform:
        thickness = np.diff(profile.depth)
        with np.errstate(divide="ignore", invalid="ignore"):
            gradient = np.abs(np.diff(profile.speed)) / thickness
        steepest = float(np.nanmax(gradient, initial=0.0)) / float(profile.speed.min())
    broken = steepest * length**2 / 8.0 > BOW
    if reflected is not None:
        broken = broken | reflected
    blocked = np.zeros(len(start), bool)
    blocked[~broken] = occluded(bodies, start[~broken], end[~broken])
    if broken.any():
        blocked[broken] = _along_chords(
            bodies, environment, profile, start[broken], end[broken], departure[broken], length[broken]
        )
    return blocked


def _along_chords(
    bodies: tuple[Body, ...],
    environment: Environment,
    profile: Profile,
    start: Floats,
    end: Floats,
    departure: Floats,
    length: Floats,
) -> Bools:
    """Whether a body stands in a chord of each ray."""
    ray, points = chords(environment, profile, start, departure, length)
    points[np.flatnonzero(np.diff(ray, append=-1))] = end
    points[np.flatnonzero(np.diff(ray, prepend=-1))] = start
    pieces = np.flatnonzero(ray[1:] == ray[:-1])
    found = occluded(bodies, points[pieces], points[pieces + 1])
    blocked = np.zeros(len(start), bool)
    blocked[ray[pieces[found]]] = True
    return blocked


def chords(
    environment: Environment, profile: Profile, start: Floats, departure: Floats, length: Floats, sagitta: float = BOW
) -> tuple[np.ndarray, Floats]:
    """Polylines that keep within `sagitta` (m) of rays from start (ray, xyz): ray of each node, node (node, xyz)."""
    from sonarsynth.acoustics import rays_march

    layers = water(profile.depth, profile.speed, environment.depth)
    z = np.clip(depth(start), 0.0, environment.depth)
    flat = np.hypot(departure[:, 0], departure[:, 1])
    p = flat / np.interp(z, layers.depth, layers.speed)
    angle = -np.arctan2(departure[:, 2], flat)
    room = 8 * len(start) + 64
    count = -1
    while count < 0:
        nodes = np.empty((room, 3))
        count = rays_march.chords(layers.depth, layers.speed, z, angle, p, length, sagitta, nodes)
        room *= 2
    ray = nodes[:count, 0].astype(np.int64)
    ahead = np.divide(departure[:, :2], flat[:, None], out=np.zeros((len(start), 2)), where=flat[:, None] > 0)
    points = np.empty((count, 3))
    points[:, :2] = start[ray, :2] + nodes[:count, 1:2] * ahead[ray]
    points[:, 2] = -nodes[:count, 2]
    return ray, points
