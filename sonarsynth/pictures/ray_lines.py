"""Rays to look at: the eigenrays of a frame, and the fan that a recipe asks for, each with what people ask of a ray."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, occluded
from sonarsynth.conventions import Floats, Ints, depth, finite_json
from sonarsynth.description import FieldError
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface
from sonarsynth.environment.boundary_numbers import bounces
from sonarsynth.equations.rays.ray_solutions import (
    CAUSTIC,
    COINCIDENT,
    GOOD,
    PASSED,
    Eigenrays,
    Water,
    eigenrays,
    water,
)
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.pictures.ray_figures.ray_styles import FAN
from sonarsynth.planning import Plan
from sonarsynth.products import FAMILIES
from sonarsynth.propagation.ray_request import EigenrayRequest
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals.filtered_pulse import snap_levels
from sonarsynth.tracing.ray_fan import EVENTS, RayFan, follow_eigenrays

WORDS = {GOOD: "good", COINCIDENT: "coincident ends", CAUSTIC: "near a caustic", PASSED: "past a caustic"}
"""Flags of eigenrays, `ray_solutions.REASONS`, in the words of a table."""
LETTERS = {"turning point": "T", "surface": "S", "bottom": "B", "facet": "X", "target": "X"}
"""Vertices of a ray, in the order in which it meets them."""
TARGET = "target"
"""What happens to an eigenray at the target by way of which it goes."""
HIDDEN = "hidden by a target"
AT_END = "reflected at its end"
"""Of a ray from or to a point on a boundary: the same way as the ray without that reflection."""


@dataclass(frozen=True, eq=False)
class RayLine:
    """A ray as points, and what is said of it. NaN: not known."""

    name: str  # what it joins
    family: str  # direct, surface, bottom, surface and bottom; fan
    position: Floats  # (point, xyz) m, world
    direction: Floats  # (point, xyz) unit vector of travel on leaving the point
    time: Floats  # (point,) s since the launch
    length: Floats  # (point,) m along the ray
    event: tuple[str, ...]  # (point,)
    caustics: int
    transmission_loss: float  # dB at the centre of the band; of an echo: both ways, off a target of 0 dB
    level: float  # dB re 1 uPa: peak source level less the transmission loss
    coefficient: float  # of a ray of the fan sent on from a target: that of the scattering law
    flags: tuple[str, ...]  # what there is to say against it

    @property
    def vertices(self) -> str:
        """Its vertices in order, such as S-B; S surface, B bottom, T turning point, X target; a dash without any."""
        return "-".join(LETTERS[e] for e in self.event if e in LETTERS) or "-"

    @property
    def elevation(self) -> Floats:
        """Angle (point,) of travel on leaving each point, rad, up positive."""
        return np.asarray(np.arcsin(np.clip(self.direction[:, 2], -1.0, 1.0)))

    def as_json(self) -> dict[str, Any]:
        """The ray for a program: SI units, angles in rad and up positive, null where a number is not known."""
        lists = {n: getattr(self, n).tolist() for n in ("position", "time", "length")}
        angles = finite_json(self.elevation)
        single = {n: finite_json(getattr(self, n)) for n in ("transmission_loss", "level", "coefficient")}
        counts = {kind: sum(e == kind for e in self.event) for kind in ("surface", "bottom", "turning point", "facet")}
        return {
            "name": self.name,
            "family": self.family,
            "vertices": self.vertices,
            "travel_time": float(self.time[-1]),
            "launch_elevation": angles[0],
            "arrival_elevation": angles[-1],
            "path_length": float(self.length[-1]),
            **single,
            "surface": counts["surface"],
            "bottom": counts["bottom"],
            "turning": counts["turning point"],
            "caustics": self.caustics,
            "flags": list(self.flags),
            **lists,
            "elevation": angles,
            "event": list(self.event),
        }


def fan_lines(rays: RayFan) -> list[RayLine]:
    """The rays of a fan."""
    lines = []
    for n in range(int(rays.ray.max()) + 1):
        own = rays.ray == n
        lines.append(
            RayLine(
                name=f"ray {n} of the fan",
                family=FAN,
                position=rays.position[own],
                direction=rays.direction[own],
                time=rays.time[own],
                length=rays.length[own],
                event=tuple(EVENTS[e] for e in rays.event[own]),
                caustics=0,
                transmission_loss=np.nan,
                level=np.nan,
                coefficient=float(rays.coefficient[n]),
                flags=(),
            )
        )
    return lines


@dataclass(frozen=True, eq=False)
class _End:
    """A point that eigenrays join."""

    position: Floats  # (xyz) m, world
    inside: PlacedTarget | None = None  # the body that it is the middle of: it hides nothing of a ray that ends there


def eigenray_lines(plan: Plan, frame: Frame, request: EigenrayRequest) -> list[RayLine]:
    """Every ray from each snap to the array centre, and by way of each target; earliest first for each way.

    The loss of an echo is that of both ways, as if the target had a strength of 0 dB. Raises FieldError without a snap.
    """
    levels = snap_levels(frame.moment.snaps)
    first = {s.position.tobytes(): n for n, s in reversed(list(enumerate(frame.moment.snaps)))}  # each place once
    snaps = {n: _End(frame.moment.snaps[n].position) for n in sorted(first.values())}
    if not snaps:
        raise FieldError(("scene", "world", "sources"), "is empty: there are no eigenrays; ask for a fan with 'rays:'")
    array = _End(frame.sonar_pose.position)
    targets = _aims(frame, request)
    pairs = [(s, array) for s in snaps.values()]
    pairs += [pair for _, aim in targets for pair in [(aim, array), *((s, aim) for s in snaps.values())]]
    eigenrays = dict(zip(pairs, _legs(plan, frame.moment.bodies, request.vertices, pairs), strict=True))
    lines = []
    for n, snap in snaps.items():
        ways = {f"snap {n} to array": eigenrays[snap, array]}
        for name, aim in targets:
            both = [(a, b) for a in eigenrays[snap, aim] for b in eigenrays[aim, array]]
            echoes = [_joined(a, b) for a, b in both if _bends(a) + _bends(b) <= request.vertices]
            ways[f"snap {n} to {name} to array"] = sorted(echoes, key=lambda e: float(e.time[-1]))
        for name, rays in ways.items():
            lines += [replace(ray, name=name, level=float(levels[n]) - ray.transmission_loss) for ray in rays]
    return lines


def _aims(frame: Frame, request: EigenrayRequest) -> list[tuple[str, _End]]:
    """Name of each target and the point of it that rays go to."""
    aims = []
    for body in frame.moment.bodies if request.targets != "none" else ():
        if request.targets == "centre":
            aims.append((body.name, _End(body.pose.to_world(body.mesh.box.mean(axis=0)), body)))
            continue
        points = body.pose.to_world(body.mesh.centroid)
        facet = int(np.linalg.norm(points - frame.sonar_pose.position, axis=1).argmin())
        clear = OFFSET * body.mesh.radius * body.pose.turn_to_world(body.mesh.normal[facet])
        aims.append((body.name, _End(points[facet] + clear)))
    return aims


def _legs(
    plan: Plan, bodies: tuple[PlacedTarget, ...], vertices: int, pairs: list[tuple[_End, _End]]
) -> list[list[RayLine]]:
    """The eigenrays of each pair, as lines that have no name yet."""
    environment = plan.scene.world.environment
    layers = water(plan.profile.depth, plan.profile.speed, environment.depth)
    start, end = (np.array([pair[index].position for pair in pairs]) for index in (0, 1))
    distance = np.hypot(*(end - start)[:, :2].T)
    rays = eigenrays(layers, depth(start), depth(end), distance, vertices, vertices)
    lines = follow_eigenrays(layers, start, end, rays, 1e-4 * environment.depth)
    loss = _transmission_loss(plan, layers, rays, depth(start), depth(end))
    row = np.searchsorted(lines.ray, np.arange(len(rays.pair) + 1))
    by_pair: list[list[RayLine]] = [[] for _ in pairs]
    for i, pair in enumerate(rays.pair):
        others = tuple(b for b in bodies if all(b is not e.inside for e in pairs[pair]))
        by_pair[pair].append(_leg(lines, slice(row[i], row[i + 1]), rays, i, float(loss[i]), others))
    return by_pair


def _transmission_loss(plan: Plan, layers: Water, rays: Eigenrays, start: Floats, end: Floats) -> Floats:
    """Transmission loss (ray,) in dB at the centre of the band: spreading, boundaries, absorption; depths (pair,)."""
    environment, frequency = plan.scene.world.environment, plan.scene.sonar.band.centre
    met: list[tuple[SeaSurface | SeaBottom, Ints, float]] = [
        (environment.surface, rays.surface, layers.speed[0]),
        (environment.bottom, rays.bottom, layers.speed[-1]),
    ]
    factor = rays.amplitude.copy()
    for boundary, count, c in met:
        effect = bounces(boundary, np.arccos(np.minimum(rays.slowness * c, 1.0)), count, c, frequency)
        factor *= effect.modulus * np.exp(-0.5 * (2.0 * np.pi * frequency * effect.delay_std) ** 2)
    climb, ends = np.nan_to_num(rays.start_sine), (start[rays.pair], end[rays.pair])
    lost = plan.medium.absorbed(rays.length, *ends, climb, rays.surface + rays.bottom)
    with np.errstate(divide="ignore"):
        return np.asarray(-20.0 * np.log10(factor) + lost)


def _leg(lines: RayFan, span: slice, rays: Eigenrays, i: int, loss: float, others: tuple[PlacedTarget, ...]) -> RayLine:
    """Eigenray i as a line; others: the bodies that may hide it."""
    position = lines.position[span]
    hidden = bool(occluded(others, position[:-1], position[1:]).any())
    length = lines.length[span]
    at_end = len(length) > 2 and (length[1] == 0.0 or length[-1] == length[-2])
    return RayLine(
        name="",
        family=_family(bool(rays.surface[i]), bool(rays.bottom[i])),
        position=position,
        direction=lines.direction[span],
        time=lines.time[span],
        length=length,
        event=tuple(EVENTS[e] for e in lines.event[span]),
        caustics=int(rays.caustics[i]),
        transmission_loss=loss,
        level=np.nan,
        coefficient=np.nan,
        flags=_flags(WORDS[int(rays.flag[i])], HIDDEN if hidden else "", AT_END if at_end else ""),
    )


def _joined(first: RayLine, second: RayLine) -> RayLine:
    """The ray to a target and on from it."""
    middle = np.s_[1:]
    return replace(
        first,
        family=_family("surface" in first.event + second.event, "bottom" in first.event + second.event),
        position=np.concatenate([first.position, second.position[middle]]),
        direction=np.concatenate([first.direction[:-1], second.direction]),
        time=np.concatenate([first.time, first.time[-1] + second.time[middle]]),
        length=np.concatenate([first.length, first.length[-1] + second.length[middle]]),
        event=(*first.event[:-1], TARGET, *second.event[1:]),
        caustics=first.caustics + second.caustics,
        transmission_loss=first.transmission_loss + second.transmission_loss,
        flags=_flags(*first.flags, *second.flags),
    )


def _bends(line: RayLine) -> int:
    """Reflections and turning points of a line."""
    return sum(event in LETTERS for event in line.event)


def _family(surface: bool, bottom: bool) -> str:
    return FAMILIES[surface + 2 * bottom]


def _flags(*words: str) -> tuple[str, ...]:
    """What there is to say against a ray, each thing once."""
    return tuple(dict.fromkeys(w for w in words if w and w != WORDS[GOOD]))
