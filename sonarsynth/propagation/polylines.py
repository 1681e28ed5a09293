"""Eigenrays as polylines: points on their arcs, with every reflection and turning point among them.

A ray is a chain of legs from vertex to vertex, a leg a chain of arcs, one a layer. Everything is written in
h = sine/p = sqrt(v^2 + (c_m - c)(c_m + c)), where v is its value at the fastest depth c_m that the ray meets at an end
or a node: sums of positive terms, as in `equations.rays.ray_chain`. Nothing divides by a gradient.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.equations.rays.ray_solutions import Eigenrays, Water
from sonarsynth.propagation.ray_steps import ARRIVAL, BOTTOM, LAUNCH, ON, SURFACE, TURN

__all__ = ["Polylines", "polylines"]

TINY = 1e-300
"""Least h^2 (m2/s2): keeps 0/0 out of the limit of a horizontal ray."""
LEAST = 1e-9
"""Tangent at the fastest depth from which Newton starts where the sines of the ends leave nothing of it."""


@dataclass(frozen=True, eq=False)
class Polylines:
    """Rays as points, sorted by ray and time; columns as in `ray_fan.RayFan`."""

    ray: Ints  # (point,) row of the eigenray
    position: Floats  # (point, xyz) m, world
    direction: Floats  # (point, xyz) unit vector of travel on leaving the point; NaN for coincident ends
    time: Floats  # (point,) s since the launch
    length: Floats  # (point,) m along the ray
    event: Ints  # (point,) index into `ray_steps.EVENTS`
    miss: Floats  # (ray,) m: distance of the last point from the end; rounding


def polylines(layers: Water, start: Floats, end: Floats, rays: Eigenrays, *, sagitta: float = 1e-3) -> Polylines:
    """The polylines of eigenrays from start (pair, xyz) to end (pair, xyz), in the world, in m.

    sagitta: largest distance (m) of an arc from its chord.
    The points are on the arcs to rounding; vertices, ends and crossings of nodes are always among them.
    """
    p1, p2 = np.asarray(start, float)[rays.pair], np.asarray(end, float)[rays.pair]
    z1, z2 = (np.clip(depth(p), 0.0, layers.depth[-1]) for p in (p1, p2))
    span = p2[:, :2] - p1[:, :2]
    distance = np.hypot(span[:, 0], span[:, 1])
    ahead = np.divide(span, distance[:, None], out=np.zeros_like(span), where=distance[:, None] > 0)
    none = np.empty(0)
    points = [_points(layers, rays, i, z1[i], z2[i], distance[i], sagitta) for i in range(len(p1))]
    ray = np.repeat(np.arange(len(p1)), [len(m.x) for m in points])
    points.append(_Points(none, none, none, none, none, np.empty(0, int)))
    x, z, phi, time, length, event = (np.concatenate([getattr(m, f.name) for m in points]) for f in fields(_Points))
    position = np.column_stack([p1[ray, :2] + x[:, None] * ahead[ray], -z])
    direction = np.column_stack([np.cos(phi)[:, None] * ahead[ray], -np.sin(phi)])
    last = np.searchsorted(ray, np.arange(len(p1)), side="right") - 1
    miss = np.linalg.norm(position[last] - np.column_stack([p2[:, :2], -z2]), axis=1)
    return Polylines(ray, position, direction, time, length, event, miss)


@dataclass(frozen=True, eq=False)
class _Points:
    """The points of one ray in its vertical plane."""

    x: Floats  # (point,) m, horizontally from the start
    z: Floats  # (point,) m, depth
    phi: Floats  # (point,) rad, positive down
    time: Floats  # (point,) s
    length: Floats  # (point,) m
    event: Ints  # (point,)


@dataclass(frozen=True, eq=False)
class _Arcs:
    """The arcs of one ray in order, each within a layer."""

    z: Floats  # (arc, 2) m: depth where it begins and where it ends
    c: Floats  # (arc, 2) m/s there
    rise: Floats  # (arc,) s: thickness of its layer over speed difference, without sign; 0 where it is uniform
    gradient: Floats  # (arc,) 1/s, in the sense of travel
    sense: Floats  # (arc,) 1 down, -1 up
    turns: Bools  # (arc, 2) whether it begins, or ends, level at a turning point
    event: Ints  # (arc,) what happens at its end


def _points(layers: Water, rays: Eigenrays, i: int, z1: float, z2: float, distance: float, sagitta: float) -> _Points:
    """The points of eigenray i, whose ends are at depths z1 and z2."""
    stops, events, sense = _stops(rays, i, z1, z2, float(layers.depth[-1]))
    if min(stops) == max(stops):  # level, also along a boundary, or coincident ends
        x = np.linspace(0.0, distance, len(stops))
        level = np.full(len(x), rays.start_sine[i])
        event = np.array([LAUNCH, *events[:-1], ARRIVAL])
        return _Points(x, np.full(len(x), z1), level, x / rays.start_speed[i], x, event)
    arcs = _arcs(layers, stops, events, sense, float(rays.start_speed[i]), float(rays.end_speed[i]))
    p, sine, dx = _closed(arcs, rays, i, distance)
    points = _along(arcs, p, sine, dx, sagitta)
    for end, sine_there, c in ((0, rays.start_sine[i], rays.start_speed[i]), (-1, rays.end_sine[i], rays.end_speed[i])):
        points.phi[end] = -np.arctan2(sine_there, p * c)  # on a jump: on the side of the jump that the eigenray says
    return points


def _stops(rays: Eigenrays, i: int, z1: float, z2: float, bottom_depth: float) -> tuple[list[float], list[int], float]:
    """Depths of the ends and of the vertices between them, what happens there, and the sense of the first leg."""
    count = int(rays.surface[i] + rays.bottom[i] + rays.turning[i])
    if count == 0:
        return [z1, z2], [ARRIVAL], 1.0 if z2 > z1 else -1.0
    sine = rays.start_sine[i] if rays.start_sine[i] != 0.0 else rays.end_sine[i] * (-1) ** count
    upper = (0.0, SURFACE) if rays.surface[i] else (rays.upper[i], TURN)
    lower = (bottom_depth, BOTTOM) if rays.bottom[i] else (rays.lower[i], TURN)
    up = bool(sine > 0.0) if sine != 0.0 else not np.isfinite(lower[0])
    depths, events = zip(*[(upper, lower)[(n + (not up)) % 2] for n in range(count)], strict=True)
    return [z1, *depths, z2], [*events, ARRIVAL], -1.0 if up else 1.0


def _arcs(layers: Water, stops: list[float], events: list[int], sense: float, c_start: float, c_end: float) -> _Arcs:
    """The arcs of a ray that goes from stop to stop, up and down by turns; c_start, c_end: speeds at its ends (m/s)."""
    rows: list[tuple[float, ...]] = []
    level = False
    for a, b, event in zip(stops[:-1], stops[1:], events, strict=True):
        if a == b and _at_jump(layers, a):  # turned back at once
            c = c_end if event == ARRIVAL else c_start
            rows.append((a, a, c, c, 0.0, 0.0, sense, False, False, event))
            sense = -sense
            continue
        crossed = _layers_between(layers, a, b, sense)
        for n, j in enumerate(crossed):
            starts_level = level and n == 0
            last = n == len(crossed) - 1
            level = last and event == TURN and not _at_jump(layers, b)
            rows.append((*_span(layers, j, a, b, sense), sense, starts_level, level, event if last else ON))
        sense = -sense
    z1, z2, c1, c2, rise, gradient, senses, starts, ends, kind = np.array(rows, float).T
    turns = np.column_stack([starts > 0, ends > 0])
    return _Arcs(np.column_stack([z1, z2]), np.column_stack([c1, c2]), rise, gradient, senses, turns, kind.astype(int))


def _layers_between(layers: Water, a: float, b: float, sense: float) -> list[int]:
    """Layers from depth a to depth b in order; where there is nothing between, the one that the ray is about to enter.

    Jumps are left out: speeds are those of the layers on either side.
    """
    inside = np.flatnonzero((layers.depth[:-1] < max(a, b)) & (layers.depth[1:] > min(a, b)))
    if len(inside):
        return [int(j) for j in inside[:: int(sense)]]
    after = np.searchsorted(layers.depth, a, side="right" if sense > 0 else "left")
    return [int(np.clip(after - 1, 0, len(layers.depth) - 2))]


def _at_jump(layers: Water, z: float) -> bool:
    """Whether there is a jump at depth z: a ray that turns in it does so at an angle."""
    first = int(np.searchsorted(layers.depth, z, side="left"))
    return first + 1 < len(layers.depth) and bool(layers.depth[first] == layers.depth[first + 1] == z)


def _span(layers: Water, j: int, a: float, b: float, sense: float) -> tuple[float, ...]:
    """Depths and speeds where a leg from a to b enters and leaves layer j, and the layer's `rise` and `gradient`."""
    top, bottom = layers.depth[j], layers.depth[j + 1]
    thickness, difference = bottom - top, layers.speed[j + 1] - layers.speed[j]
    z = np.clip(np.array([a, b]), top, bottom)
    fraction = (z - top) / thickness if thickness > 0 else np.zeros(2)
    c = np.where(fraction == 1.0, layers.speed[j + 1], layers.speed[j] + fraction * difference)
    rise = abs(thickness / difference) if difference != 0 else 0.0
    return z[0], z[1], c[0], c[1], rise, sense * difference / thickness if thickness > 0 else 0.0


def _closed(arcs: _Arcs, rays: Eigenrays, i: int, distance: float) -> tuple[float, Floats, Floats]:
    """Slowness p of eigenray i, sines (arc, 2), horizontal extents (arc,): Newton makes these add up to the distance.

    For the sine at the fastest depth, where it is much smaller than at the ends, has lost digits in theirs.
    """
    p = float(rays.slowness[i])
    if p == 0.0 or distance == 0.0:
        return 0.0, np.ones_like(arcs.c), np.zeros(len(arcs.c))
    c, sine = max((rays.start_speed[i], rays.start_sine[i]), (rays.end_speed[i], rays.end_sine[i]))
    fastest = float(max(c, arcs.c[~arcs.turns].max(initial=0.0)))
    offset = (fastest - arcs.c) * (fastest + arcs.c)
    square = (sine / p) ** 2 - (fastest - c) * (fastest + c)
    v = float(np.sqrt(max(square, (LEAST * fastest) ** 2)))
    h, dx, slope = _extents(arcs, offset, v)
    for _ in range(4):
        misfit = dx.sum() - distance
        trial = max(v - misfit / slope, 0.0) if slope != 0.0 else v
        better = _extents(arcs, offset, trial)
        if not abs(better[1].sum() - distance) < abs(misfit):
            break
        v, (h, dx, slope) = trial, better
    p = float(1.0 / np.hypot(v, fastest))
    return p, p * h, dx


def _extents(arcs: _Arcs, offset: Floats, v: float) -> tuple[Floats, Floats, float]:
    """h (arc, 2) m/s, horizontal extents (arc,) m: dz (c1 + c2)/(h1 + h2), h/g up to a turning point; and d(sum)/dv."""
    h = np.sqrt(np.where(arcs.turns, 0.0, np.maximum(v * v + offset, TINY)))
    level = arcs.turns.any(axis=1)
    k = np.abs(arcs.z[:, 1] - arcs.z[:, 0]) * arcs.c.sum(axis=1)
    dx = np.where(level, h.sum(axis=1) * arcs.rise, k / h.sum(axis=1))
    square = np.where(level, h.sum(axis=1) ** 2, -h.prod(axis=1))
    return h, dx, float(v * np.sum(dx / square))


def _along(arcs: _Arcs, p: float, sine: Floats, dx: Floats, sagitta: float) -> _Points:
    """Points on the arcs of a ray: one of length L that turns by a is a chord L sin(a/2)/(a/2) at its mean angle."""
    angle = np.where(arcs.turns, 0.0, np.arctan2(sine, p * arcs.c))
    turn = angle[:, 0] - angle[:, 1]
    length = _lengths(arcs, p, sine)
    pieces = np.maximum(np.ceil(np.sqrt(length * np.abs(turn) / (8.0 * sagitta))), 1.0).astype(int)
    arc = np.repeat(np.arange(len(pieces)), pieces)
    nth = np.arange(1, len(arc) + 1) - (np.cumsum(pieces) - pieces)[arc]
    fraction, last = nth / pieces[arc], nth == pieces[arc]
    half = 0.5 * fraction * turn[arc]
    mean = angle[arc, 0] - half
    chord = fraction * length[arc] * np.sinc(half / np.pi)
    speed = np.maximum(arcs.c[arc, 0] + arcs.gradient[arc] * chord * np.sin(mean), 1e-3 * arcs.c[arc, 0])
    time = _chord_time(chord, arcs.c[arc, 0], np.where(last, arcs.c[arc, 1], speed), arcs.gradient[arc])
    before = [np.cumsum(extent) - extent for extent in (dx, time[last], length)]
    leaving = arcs.sense[arc] * (mean - half)
    leaving[last] = np.append((arcs.sense * angle[:, 0])[1:], arcs.sense[-1] * angle[-1, 1])
    depths = np.where(last, arcs.z[arc, 1], arcs.z[arc, 0] + arcs.sense[arc] * chord * np.sin(mean))
    return _Points(
        x=np.append(0.0, before[0][arc] + np.where(last, dx[arc], chord * np.cos(mean))),
        z=np.append(arcs.z[0, 0], depths),
        phi=np.append(arcs.sense[0] * angle[0, 0], leaving),
        time=np.append(0.0, before[1][arc] + time),
        length=np.append(0.0, before[2][arc] + fraction * length[arc]),
        event=np.append(LAUNCH, np.where(last, arcs.event[arc], ON)),
    )


def _lengths(arcs: _Arcs, p: float, sine: Floats) -> Floats:
    """Arc length (arc,) in m; as `ray_in_layer.layer_length` and `turn_length`."""
    total, thickness = np.maximum(sine.sum(axis=1), TINY), np.abs(arcs.z[:, 1] - arcs.z[:, 0])
    tangent = p * (arcs.c[:, 1] - arcs.c[:, 0]) / total
    across = 2.0 * thickness / total * _over(np.arctan(tangent), tangent)
    if p == 0.0:
        return np.asarray(across)
    level = arcs.turns.any(axis=1)
    outside = np.where(arcs.turns[:, 0], arcs.c[:, 1], arcs.c[:, 0])
    return np.asarray(np.where(level, np.arctan2(total, p * outside) * arcs.rise / p, across))


def _chord_time(chord: Floats, c1: Floats, c2: Floats, gradient: Floats) -> Floats:
    """Travel time (s) along arcs over chords (m); as `ray_in_layer.chord_time`."""
    mean = np.sqrt(c1 * c2)
    x = 0.5 * gradient * chord / mean
    return np.asarray(chord / mean * _over(np.arcsinh(x), x))


def _over(value: Floats, x: Floats) -> Floats:
    """value/x, 1 where x is 0."""
    return np.divide(value, x, out=np.ones_like(x), where=x != 0.0)
