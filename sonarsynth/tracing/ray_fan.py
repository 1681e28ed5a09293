"""Rays followed wherever they go: arcs between reflections at surface, bottom and facets (thesis, figures 14, 15)."""

from __future__ import annotations

import sys
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, Floats, Ints, depth
from sonarsynth.equations.rays.ray_solutions import Eigenrays, Water, water, within
from sonarsynth.geometry import unit
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation.ray_steps import (
    ARRIVAL,
    BOTTOM,
    END,
    EVENTS,
    FACET,
    LAUNCH,
    SURFACE,
    TURN,
    Rays,
    launch,
    reflect,
    step,
)
from sonarsynth.scattering import FacetLaw
from sonarsynth.scattering.components import size_at
from sonarsynth.scattering.facet_geometry import patches
from sonarsynth.state import Medium
from sonarsynth.tracing.occlusion.ray_cones import hidden

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

__all__ = ["EVENTS", "RayFan", "fan", "follow_eigenrays"]

LEFT = 1e-9
"""Of the travel time of an eigenray is left when it ends: a boundary at its very end is not met by rounding."""


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
    return _sorted(points, coefficient)


def follow_eigenrays(layers: Water, start: Floats, end: Floats, rays: Eigenrays, sagitta: float) -> RayFan:
    """Eigenrays from start (pair, xyz) to end (pair, xyz), in the world, in m, followed until they arrive.

    sagitta: largest distance (m) of an arc from its chord. Rounding of the launch, which a ray that bends little
    carries to its end within 1e-9 of its length, is taken out there. Vertices at the very end are put there.
    """
    count, span = len(rays.pair), (end - start)[rays.pair]
    distance = np.hypot(span[:, 0], span[:, 1])
    ahead = np.divide(span[:, :2], distance[:, None], out=np.zeros((count, 2)), where=distance[:, None] > 0.0)
    p, sine, zero = np.where(distance > 0.0, rays.slowness, 0.0), np.nan_to_num(rays.start_sine), np.zeros(count)
    cosine = p * rays.start_speed
    aim = np.column_stack([cosine[:, None] * ahead, sine])
    until = (1.0 - LEFT) * rays.travel_time
    leaving = launch(layers, np.arange(count), start[rays.pair], aim, zero, zero, until)
    above = np.maximum(leaving.layer - 1, 0)  # of a jump, whose upper side the ray may leave
    upper = (layers.depth[above] == depth(leaving.position)) & (layers.speed[above] == rays.start_speed)
    leaving = leaving.but(phi=np.arctan2(-sine, cosine), p=p, layer=np.where(upper, above, leaving.layer))
    level = (sine == 0.0) & (np.nan_to_num(rays.end_sine) == 0.0)  # all the way, or coincident
    bending = leaving.select(~level)
    points = [_points(leaving, LAUNCH), _points(leaving.select(level), ARRIVAL)]
    points += _follow(layers, (), bending, sys.maxsize, np.inf, sagitta, None, ARRIVAL)
    followed = _sorted(points, np.full(count, np.nan))
    last = np.searchsorted(followed.ray, np.arange(count), side="right") - 1
    followed.position[last], followed.length[last], followed.time[last] = end[rays.pair], rays.length, rays.travel_time
    followed.direction[last] = np.column_stack([(p * rays.end_speed)[:, None] * ahead, rays.end_sine])
    followed.direction[np.isnan(rays.start_sine)[followed.ray]] = np.nan
    rows, events = [np.arange(len(followed.ray))], [followed.event]
    for event, vertices in ((SURFACE, rays.surface), (BOTTOM, rays.bottom), (TURN, rays.turning)):
        met = np.bincount(followed.ray[followed.event == event], minlength=count)
        rows.append(np.repeat(last, np.maximum(vertices - met, 0)))
        events.append(np.full(len(rows[-1]), event))
    row, met_there = np.concatenate(rows), np.concatenate(events)
    order = np.lexsort((met_there == ARRIVAL, row))
    columns = {f.name: getattr(followed, f.name)[row[order]] for f in fields(RayFan) if f.name != "coefficient"}
    return RayFan(**columns | {"event": met_there[order]}, coefficient=followed.coefficient)


def _sorted(points: list[list[np.ndarray]], coefficient: Floats) -> RayFan:
    """Points of rays as a fan."""
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
    paths = propagation.checked_paths(medium.profile, medium.depth, rays.clear, end)
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
