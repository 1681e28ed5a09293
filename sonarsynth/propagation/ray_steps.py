"""One step of many rays: an arc within a layer, and what it meets."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, first_hit
from sonarsynth.columns import Columns
from sonarsynth.conventions import NO_TARGET, Floats, Ints, depth
from sonarsynth.equations.rays import ray_arcs
from sonarsynth.equations.rays.ray_solutions import Water
from sonarsynth.geometry import unit
from sonarsynth.geometry.placed_target import PlacedTarget

EVENTS = ("on the way", "turning point", "surface", "bottom", "end", "facet", "launch", "arrival")
ON, TURN, SURFACE, BOTTOM, END, FACET, LAUNCH, ARRIVAL = range(len(EVENTS))
"""What happens at a point of a ray; the first five are those of `equations.rays.ray_arcs`."""


@dataclass(frozen=True, eq=False)
class Rays(Columns):
    """Rays on their way: where they are now."""

    ray: Ints
    position: Floats
    direction: Floats
    layer: Ints
    phi: Floats  # rad, positive down
    p: Floats  # s/m
    time: Floats
    length: Floats
    bounces: Ints
    until: Floats  # s: when the ray ends
    clear: Floats  # position moved off the facet last met


def launch(
    layers: Water, ray: Ints, origin: Floats, direction: Floats, time: Floats, length: Floats, until: Floats
) -> Rays:
    """Rays about to leave their origins (ray, xyz); time, length: what they bring; until: when they end (s)."""
    z = np.clip(depth(origin), 0.0, layers.depth[-1])
    layer = np.clip(np.searchsorted(layers.depth, z, side="right") - 1, 0, len(layers.depth) - 2)
    phi, p = snell(layers, layer, z, direction)
    return Rays(ray, origin, direction, layer, phi, p, time, length, np.zeros(len(ray), int), until, origin)


def snell(layers: Water, layer: Ints, z: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Angle (positive down) and p = cos/c of directions (ray, xyz) at depths z in layers."""
    flat = np.hypot(direction[:, 0], direction[:, 1])
    thickness = layers.depth[layer + 1] - layers.depth[layer]
    fraction = np.divide(z - layers.depth[layer], thickness, out=np.zeros_like(z), where=thickness > 0)
    c = layers.speed[layer] + fraction * (layers.speed[layer + 1] - layers.speed[layer])
    return np.arctan2(-direction[:, 2], flat), flat / c


def move(layers: Water, state: Rays, limit: Floats, sagitta: float) -> tuple[Rays, Ints]:
    """Rays after one arc each of at most `limit` (ray,) m, and why it ended."""
    n = len(state.ray)
    layer, phi, z = state.layer.copy(), state.phi.copy(), np.clip(depth(state.position), 0.0, layers.depth[-1])
    why, dx, length, time = np.empty(n, np.int64), np.empty(n), np.empty(n), np.empty(n)
    ray_arcs.steps(
        layers.depth,
        layers.speed,
        layer,
        z,
        phi,
        state.p,
        limit,
        sagitta,
        state.until - state.time,
        why,
        dx,
        length,
        time,
    )
    flat = np.hypot(state.direction[:, 0], state.direction[:, 1])
    ahead = np.divide(state.direction[:, :2], flat[:, None], out=np.zeros((n, 2)), where=flat[:, None] > 0)
    position = np.concatenate([state.position[:, :2] + dx[:, None] * ahead, -z[:, None]], axis=1)
    direction = np.concatenate([np.cos(phi)[:, None] * ahead, -np.sin(phi)[:, None]], axis=1)
    after = Rays(
        ray=state.ray,
        position=position,
        direction=direction,
        layer=layer,
        phi=phi,
        p=state.p.copy(),
        time=state.time + time,
        length=state.length + length,
        bounces=state.bounces.copy(),
        until=state.until,
        clear=position,
    )
    return after, why


def step(
    layers: Water, bodies: tuple[PlacedTarget, ...], state: Rays, spacing: float, sagitta: float
) -> tuple[Rays, Ints, Ints, Ints]:
    """One arc of each ray, cut short at a facet: the rays after it, why it ended, and body and facet met (-1: none)."""
    limit = np.minimum(spacing, 2.0 * layers.speed.max() * (state.until - state.time) + 1e-9)
    after, why = move(layers, state, limit, sagitta)
    target, facet, length = meet(bodies, state.clear, after.position)
    hit = np.flatnonzero(target >= 0)
    if len(hit):
        start, chord, s = state.select(hit), (after.length - state.length)[hit], length[hit]
        corner, normal = planes(bodies, target[hit], facet[hit])
        for _ in range(4):  # Newton along the arc to the plane of the facet
            moved, _ = move(layers, start, s, np.inf)
            off = np.einsum("ij,ij->i", normal, moved.position - corner)
            with np.errstate(divide="ignore", invalid="ignore"):
                better = s - off / np.einsum("ij,ij->i", normal, moved.direction)
            s = np.where((better >= 0) & (better <= chord), better, s)
        moved, _ = move(layers, start, s, np.inf)
        why[hit] = FACET
        for f in fields(Rays):
            getattr(after, f.name)[hit] = getattr(moved, f.name)
    return after, why, target, facet


def meet(bodies: tuple[PlacedTarget, ...], start: Floats, end: Floats) -> tuple[Ints, Ints, Floats]:
    """Body and facet that each chord meets first, and the distance (m); -1 where none."""
    target, facet = np.full(len(start), NO_TARGET), np.full(len(start), NO_TARGET)
    span = end - start
    nearest = np.linalg.norm(span, axis=1)
    for index, body in enumerate(bodies):
        moving = np.flatnonzero(nearest > 0)
        o, d = body.pose.to_body(start[moving]), body.pose.turn_to_body(span[moving])
        hit, distance = first_hit(body.mesh, o, d)
        closer = (hit >= 0) & (distance <= nearest[moving])
        rows = moving[closer]
        target[rows], facet[rows], nearest[rows] = index, hit[closer], distance[closer]
    return target, facet, nearest


def planes(bodies: tuple[PlacedTarget, ...], target: Ints, facet: Ints) -> tuple[Floats, Floats]:
    """A point and the normal of facets, in the world."""
    point, normal = np.empty((len(target), 3)), np.empty((len(target), 3))
    for index, body in enumerate(bodies):
        own = target == index
        point[own] = body.pose.to_world(body.mesh.centroid[facet[own]])
        normal[own] = body.pose.turn_to_world(body.mesh.normal[facet[own]])
    return point, normal


def reflect(layers: Water, bodies: tuple[PlacedTarget, ...], rays: Rays, why: Ints, target: Ints, facet: Ints) -> Rays:
    """Rays turned at surface, bottom and facets by the mirror law, and counted."""
    flat = (why == SURFACE) | (why == BOTTOM)
    phi, p, direction = np.where(flat, -rays.phi, rays.phi), rays.p.copy(), rays.direction.copy()
    direction[flat, 2] *= -1.0
    clear = rays.position.copy()
    met = np.flatnonzero(why == FACET)
    if len(met):
        _, normal = planes(bodies, target[met], facet[met])
        along = np.einsum("ij,ij->i", normal, direction[met])
        direction[met] = unit(direction[met] - 2.0 * along[:, None] * normal)
        z = np.clip(depth(rays.position[met]), 0.0, layers.depth[-1])
        phi[met], p[met] = snell(layers, rays.layer[met], z, direction[met])
        size = np.array([b.mesh.radius for b in bodies])[target[met]]
        clear[met] -= (OFFSET * size * np.sign(along))[:, None] * normal
    bounces = rays.bounces + (flat | (why == FACET))
    return replace(rays, phi=phi, p=p, direction=direction, clear=clear, bounces=bounces)
