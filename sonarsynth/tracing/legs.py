"""Legs from points in the water to the array: the half of every path that does not depend on the snap."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.acoustics.lobes import dot
from sonarsynth.acoustics.rays import COINCIDENT, water
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.geometry import Pose
from sonarsynth.products import Paths
from sonarsynth.sonar import Elements
from sonarsynth.tracing.wavefront import BRANCH, pick_branch, probes, sphere
from sonarsynth.world.casting import OFFSET, occluded
from sonarsynth.world.environment import Environment, Profile
from sonarsynth.world.moment import Body

if TYPE_CHECKING:
    from sonarsynth.tracing import Propagation

BOW = 1e-3
"""Largest distance (m) of a bent ray from the chords that stand for it when it is tested against bodies."""
PIECES = 16


@dataclass(frozen=True, eq=False)
class Legs:
    """Rays from points in the water to the array centre, with their wavefronts over the aperture."""

    point: Floats  # (leg, xyz) m, world: where it starts
    row: Ints  # (leg,) which of the points asked for
    departure: Floats  # (leg, xyz) world
    direction: Floats  # (leg, xyz) sonar frame, from the array centre to where it seems to come from
    radius: Floats  # (leg,) m: of the reference sphere: the straight distance
    travel_time: Floats  # (leg,) s
    length: Floats  # (leg,) m
    spreading: Floats  # (leg,) 1/m
    turning: Ints  # (leg,)
    delay_terms: Floats  # (leg, term) s; no columns in uniform water
    error: Floats  # (leg,) s: misfit of the wavefront at probes not used in the fit
    probe_departure: Floats  # (leg, probe, xyz) world: where each probe is seen from the point
    probe_gain: Floats  # (leg, probe): spreading to the probe over spreading * R/|R d - q|; 1 in uniform water

    def select(self, keep: Bools | Ints) -> Legs:
        """The legs picked by a mask or by indices."""
        return Legs(**{name: value[keep] for name, value in vars(self).items()})


@dataclass(frozen=True, eq=False)
class ArrayLegs:
    """Every facet that the array sees, with its leg to the array: serves any snap without tracing this side again."""

    legs: Legs  # (leg,)
    target: Ints  # (leg,) index of the body
    facet: Ints  # (leg,)
    normal: Floats  # (leg, xyz) world
    area: Floats  # (leg,) m2
    clear: Floats  # (leg, xyz) m, world: the point moved off its facet
    bodies: tuple[Body, ...]
    sonar_pose: Pose
    elements: Elements


def usable(paths: Paths) -> Bools:
    """Paths with a direction and a finite amplitude: not between coincident ends, nor exactly on a caustic."""
    return np.asarray((paths.flag != COINCIDENT) & np.isfinite(paths.spreading))


def rays_to_centre(
    environment: Environment, profile: Profile, point: Floats, sonar_pose: Pose, propagation: Propagation
) -> Legs:
    """All rays from points (point, xyz) in the world to the array centre, sorted by point, still without wavefronts."""
    centre = np.broadcast_to(sonar_pose.position, point.shape)
    paths = propagation.connect(profile, environment.depth, point, centre)
    keep = np.flatnonzero(usable(paths))
    start = point[paths.pair[keep]]
    true = sonar_pose.to_body(start)
    radius = np.sqrt(np.einsum("ij,ij->i", true, true))
    seen_at = true / radius[:, None] if profile.uniform else -sonar_pose.turn_to_body(paths.arrival[keep])
    none = np.empty((len(keep), 0))
    return Legs(
        point=start,
        row=paths.pair[keep],
        departure=paths.departure[keep],
        direction=seen_at,
        radius=radius,
        travel_time=paths.travel_time[keep],
        length=paths.length[keep],
        spreading=paths.spreading[keep],
        turning=paths.turning[keep],
        delay_terms=none,
        error=np.zeros(len(keep)),
        probe_departure=none,
        probe_gain=none,
    )


def with_wavefronts(
    legs: Legs,
    environment: Environment,
    profile: Profile,
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
) -> Legs:
    """The legs with their wavefronts: exact spheres in uniform water, else fitted to rays traced to probes."""
    probe = probes(elements)
    count, sensors = len(legs.row), len(probe.sensor)
    position = sonar_pose.to_world(probe.position)
    if profile.uniform:
        span = position - legs.point[:, None, :]
        to_probe = span / np.sqrt(dot(span, span))[..., None]
        return replace(legs, probe_departure=to_probe, probe_gain=np.ones((count, sensors)))
    start, end = np.repeat(legs.point, sensors, axis=0), np.tile(position, (count, 1))
    paths = propagation.connect(profile, environment.depth, start, end)
    c = float(profile.at(depth(sonar_pose.position)))
    farther = sphere(legs.direction, legs.radius, probe.position)
    predicted = legs.travel_time[:, None] + farther / c
    found = pick_branch(paths, predicted, BRANCH * probe.aperture / c)
    missing = found < 0
    left = np.where(missing, np.nan, paths.travel_time[found] - predicted)
    terms = probe.fit(left)
    expected = legs.spreading[:, None] * legs.radius[:, None] / (legs.radius[:, None] + farther)
    return replace(
        legs,
        delay_terms=terms,
        error=probe.misfit(left, terms),
        probe_departure=np.where(missing[..., None], legs.departure[:, None, :], paths.departure[found]),
        probe_gain=np.where(missing, np.nan, paths.spreading[found] / expected),
    )


def hidden(
    bodies: tuple[Body, ...],
    environment: Environment,
    profile: Profile,
    start: Floats,
    end: Floats,
    departure: Floats,
    length: Floats,
) -> Bools:
    """Whether a body stands in rays (ray, xyz) that leave start in direction departure and end after length (m) at end.

    Straight rays exactly; bent ones by up to 16 chords, which keep within 1 mm of rays that bow by 0.25 m or less, and
    within 1/256 of the bow of others.
    """
    steepest = 0.0
    if not profile.uniform:
        thickness = np.diff(profile.depth)
        with np.errstate(divide="ignore", invalid="ignore"):
            gradient = np.abs(np.diff(profile.speed)) / thickness
        steepest = float(np.nanmax(gradient, initial=0.0)) / float(profile.speed.min())
    bent = steepest * length**2 / 8.0 > BOW
    blocked = np.zeros(len(start), bool)
    blocked[~bent] = occluded(bodies, start[~bent], end[~bent])
    if bent.any() and bodies:
        nodes = _points_along(environment, profile, start[bent], departure[bent], length[bent])
        nodes[:, -1] = end[bent]
        some = np.zeros(int(bent.sum()), bool)
        for i in range(nodes.shape[1] - 1):
            some[~some] = occluded(bodies, nodes[~some, i], nodes[~some, i + 1])
        blocked[bent] = some
    return blocked


def _points_along(
    environment: Environment, profile: Profile, start: Floats, departure: Floats, length: Floats
) -> Floats:
    """Points (ray, point, xyz) on refracted rays at even lengths: the fewest, of 2 to 17, with chords within `BOW`."""
    from sonarsynth.acoustics import rays_march

    layers = water(profile.depth, profile.speed, environment.depth)
    z = np.clip(depth(start), 0.0, environment.depth)
    flat = np.hypot(departure[:, 0], departure[:, 1])
    p = flat / np.interp(z, layers.depth, layers.speed)
    x, deep = np.empty((len(start), PIECES + 1)), np.empty((len(start), PIECES + 1))
    rays_march.along(layers.depth, layers.speed, z, -np.arctan2(departure[:, 2], flat), p, length, x, deep)
    with np.errstate(invalid="ignore", divide="ignore"):
        ahead = np.where(flat[:, None] > 0, departure[:, :2] / flat[:, None], 0.0)
    points = np.concatenate([start[:, None, :2] + x[..., None] * ahead[:, None, :], -deep[..., None]], axis=-1)
    points[:, 0] = start
    part = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    bow = np.linalg.norm(points - points[:, :1] - part * (points[:, -1:] - points[:, :1]), axis=-1).max()
    pieces = next((n for n in (1, 2, 4, 8) if bow / n**2 <= BOW), PIECES)
    return np.asarray(points[:, :: PIECES // pieces])


def array_legs(
    environment: Environment,
    profile: Profile,
    bodies: tuple[Body, ...],
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
) -> ArrayLegs:
    """Facet to array, for every facet of every body that faces the array centre and that no body hides from it.

    Raises ValueError for a body or an array that reaches out of the water.
    """
    per_body = [_facing(body, environment, sonar_pose.position, profile.uniform) for body in bodies]
    target = np.repeat(np.arange(len(bodies)), [len(f) for f in per_body])
    facet = np.concatenate([np.empty(0, np.int64), *per_body])

    def gather(name: str, turn: bool, shift: bool) -> Floats:
        values = [getattr(b.mesh, name)[f] for b, f in zip(bodies, per_body, strict=True)]
        if turn:
            values = [b.pose.turn_to_world(v) for b, v in zip(bodies, values, strict=True)]
        if shift:
            values = [v + b.pose.position for b, v in zip(bodies, values, strict=True)]
        return np.concatenate([np.empty((0, 3) if turn else 0), *values])

    point, normal, area = gather("centroid", True, True), gather("normal", True, False), gather("area", False, False)
    legs = rays_to_centre(environment, profile, point, sonar_pose, propagation)
    clear = point + OFFSET * np.array([b.mesh.radius for b in bodies])[target][:, None] * normal
    row = legs.row
    seen = np.einsum("ij,ij->i", normal[row], legs.departure) > 0
    end = np.broadcast_to(sonar_pose.position, clear.shape)
    seen[seen] = ~hidden(
        bodies, environment, profile, clear[row[seen]], end[row[seen]], legs.departure[seen], legs.length[seen]
    )
    row = row[seen]
    legs = with_wavefronts(legs.select(seen), environment, profile, sonar_pose, elements, propagation)
    return ArrayLegs(legs, target[row], facet[row], normal[row], area[row], clear[row], bodies, sonar_pose, elements)


def _facing(body: Body, environment: Environment, towards: Floats, uniform: bool) -> Ints:
    """Facets that may face a point: in bent rays all of them (the rays decide)."""
    centroid = body.pose.to_world(body.mesh.centroid)
    deepest, highest = depth(centroid).max(initial=0.0), depth(centroid).min(initial=environment.depth)
    if highest < 0.0 or deepest > environment.depth:
        where = "above the surface" if highest < 0.0 else "below the bed"
        raise ValueError(
            f"target '{body.name}' reaches {where} ({highest:g} to {deepest:g} m in {environment.depth:g} m)"
        )
    if not uniform:
        return np.arange(len(centroid))
    normal = body.pose.turn_to_world(body.mesh.normal)
    return np.flatnonzero(np.einsum("ij,ij->i", normal, towards - centroid) > 0)
