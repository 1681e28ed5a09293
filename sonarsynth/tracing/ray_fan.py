"""Rays followed wherever they go: arcs between reflections at surface, bottom and facets (thesis, figures 14, 15)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, Floats, Ints, depth
from sonarsynth.equations.rays.ray_solutions import Water, water, within
from sonarsynth.geometry import unit
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation.ray_steps import ARRIVAL, END, EVENTS, FACET, LAUNCH, Rays, launch, reflect, step
from sonarsynth.scattering import FacetLaw
from sonarsynth.scattering.components import size_at
from sonarsynth.scattering.facet_geometry import patches
from sonarsynth.state import Medium
from sonarsynth.tracing.occlusion.ray_cones import hidden

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

__all__ = ["EVENTS", "RayFan", "fan"]


@dataclass(frozen=True, eq=False)
class RayFan:
    """Rays as polylines, sorted by ray and time: points at every event, and between, so that chords keep to arcs."""

    ray: Ints  # (point,) index of the ray
    position: Floats  # (point, xyz) m, world
    direction: Floats  # (point, xyz) unit vector of travel on leaving the point
    time: Floats  # (point,) s since the launch
    length: Floats  # (point,) m along the ray
    event: Ints  # (point,) index into EVENTS
    target: Ints  # (point,) index of the body whose facet reflects; -1 elsewhere
    facet: Ints  # (point,) -1 elsewhere
    coefficient: Floats  # (ray,) of the lobe, 1 in the mirror direction, where a ray was sent on; 0 blocked; else NaN


def fan(
    medium: Medium,
    bodies: tuple[PlacedTarget, ...],
    origin: Floats,
    directions: Floats,
    duration: float,
    bounces: int = 1000,
    *,
    spacing: float = np.inf,
    sagitta: float = 1e-4,
    towards: Floats | None = None,
    laws: tuple[FacetLaw, ...] = (),
    propagation: Propagation | None = None,
    centre: float | None = None,
) -> RayFan:
    """Rays from origin (xyz) in directions (ray, xyz), for duration (s) or until reflection number bounces + 1.

    spacing: largest distance (m) between points of a polyline; sagitta: largest distance (m) of an arc from its chord:
    a facet that a ray grazes by less may be missed. Angles of reflection are those of incidence. With towards
    (xyz), laws (of each body), propagation and the centre of a band (Hz), a ray is sent on from the first facet that it
    meets straight to that point (the thesis's second form), by its earliest path, with the coefficient of the law.
    Raises ValueError for an origin outside the water, or without a finite duration.
    """
    if not (np.isfinite(duration) and duration >= 0):
        raise ValueError("a fan of rays needs a finite duration")
    layers = water(medium.profile.depth, medium.profile.speed, medium.depth)
    within(layers, np.atleast_1d(depth(origin)), "origin")
    start, heading = np.tile(np.asarray(origin, float), (len(directions), 1)), unit(directions)
    zero = np.zeros(len(start))
    rays = launch(layers, np.arange(len(start)), start, heading, zero, zero, zero + duration)
    points = [_points(rays, LAUNCH)]
    landed: list[_FirstHits] = []
    points += _follow(layers, bodies, rays, bounces, spacing, sagitta, None if towards is None else landed)
    coefficient = np.full(len(start), np.nan)
    if towards is not None:
        if len(laws) != len(bodies) or propagation is None or centre is None:
            raise ValueError("sending rays on towards a point needs scattering laws, a propagation model, a frequency")
        for group in landed:
            onward = _send_on(
                medium,
                layers,
                bodies,
                group,
                towards,
                laws=laws,
                propagation=propagation,
                centre=centre,
                coefficient=coefficient,
            )
            points += _follow(layers, (), onward, 0, spacing, sagitta, None, ARRIVAL)
    columns = {f.name: np.concatenate(c) for f, c in zip(fields(RayFan), zip(*points, strict=True), strict=False)}
    order = np.argsort(columns["ray"], kind="stable")
    return RayFan(**{name: column[order] for name, column in columns.items()}, coefficient=coefficient)


@dataclass(frozen=True, eq=False)
class _FirstHits:
    """Rays where they met their first facet."""

    rays: Rays  # reflected
    incident: Floats  # (ray, xyz)
    target: Ints
    facet: Ints


def _points(
    rays: Rays, why: Ints | int, target: Ints | int = NO_TARGET, facet: Ints | int = NO_TARGET
) -> list[np.ndarray]:
    """Columns of a RayFan for rays where they are."""
    ids = [np.array(np.broadcast_to(v, rays.ray.shape)) for v in (why, target, facet)]
    return [rays.ray, rays.position, rays.direction, rays.time, rays.length, *ids]


def _follow(
    layers: Water,
    bodies: tuple[PlacedTarget, ...],
    rays: Rays,
    bounces: int,
    spacing: float,
    sagitta: float,
    landed: list[_FirstHits] | None,
    last: int = END,
) -> list[list[np.ndarray]]:
    """Points of rays until they end, which is called `last`; with landed given, they land on their first facet."""
    points = []
    while len(rays.ray):
        arrived, why, target, facet = step(layers, bodies, rays, spacing, sagitta)
        rays = reflect(layers, bodies, arrived, why, target, facet)
        over = (why == END) | (rays.bounces > bounces)
        points.append(_points(rays, why if last == END else np.where(over, last, why), target, facet))
        met = why == FACET
        if landed is not None and met.any():
            landed.append(_FirstHits(rays.select(met), arrived.direction[met], target[met], facet[met]))
            over = over | met
        rays = rays.select(~over)
    return points


def _send_on(
    medium: Medium,
    layers: Water,
    bodies: tuple[PlacedTarget, ...],
    landed: _FirstHits,
    towards: Floats,
    *,
    laws: tuple[FacetLaw, ...],
    propagation: Propagation,
    centre: float,
    coefficient: Floats,
) -> Rays:
    """Rays about to leave the facets where they landed for a point; writes their coefficients (ray,)."""
    rays = landed.rays
    end = np.broadcast_to(np.asarray(towards, float), rays.position.shape)
    paths = propagation.joined(medium.profile, medium.depth, rays.clear, end)
    row, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
    going, time = paths.departure[first], paths.travel_time[first]
    strength = np.zeros(len(row))
    for number, (body, law) in enumerate(zip(bodies, laws, strict=True)):
        owned = np.flatnonzero(landed.target[row] == number)
        on = row[owned]
        patch = patches(body.mesh).select(landed.facet[on])
        c = medium.profile.at(depth(rays.position[on]))
        incident, mirrored, away = (
            body.pose.turn_to_body(v) for v in (landed.incident[on], rays.direction[on], going[owned])
        )
        lobe, mirror = (size_at(law.parts, incident, v, patch, centre, c) for v in (away, mirrored))
        strength[owned] = np.divide(lobe, mirror, out=np.zeros_like(lobe), where=mirror > 0)
    strength[hidden(bodies, medium, rays.clear[row], end[row], going, paths.length[first])] = 0.0
    coefficient[rays.ray] = 0.0
    coefficient[rays.ray[row]] = strength
    on = row[strength > 0]
    start = rays.select(on)
    until = start.time + time[strength > 0]
    return launch(layers, start.ray, start.clear, going[strength > 0], start.time, start.length, until)
