"""How bodies of a population lie and move. Adding one: a description with `motion`, and its name in `DrawnTrack`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le
from pydantic import field_validator

from sonarsynth.conventions import Floats, MetresPerSecond, NonNegativeMetres, PositiveSeconds, Radians
from sonarsynth.description import BY_KIND, description
from sonarsynth.geometry.hovering import Hover
from sonarsynth.geometry.motion import ConstantVelocity, Motion, Still, Waypoint, Waypoints, velocity

DRAWS = 8
"""Random numbers that a track may take; way-points take more, made of the last."""


@dataclass(frozen=True)
class Attitude:
    """How a body lies (rad)."""

    heading: float
    pitch: float
    roll: float


@dataclass(frozen=True)
class SequenceTimes:
    """The times (s) of a sequence."""

    first: float
    last: float

    @property
    def middle(self) -> float:
        """When a body is at the place that was drawn for it."""
        return 0.5 * (self.first + self.last)


def between(bounds: tuple[float, float], fraction: float) -> float:
    """The value at this fraction (0 to 1) of the way from the first to the second."""
    return float(bounds[0] + (bounds[1] - bounds[0]) * fraction)


def _ascending(bounds: tuple[float, float]) -> tuple[float, float]:
    if bounds[0] > bounds[1]:
        raise ValueError(f"must be the least and the largest: {bounds[0]:g} to {bounds[1]:g}")
    return bounds


class _Ranges:
    """Pairs of numbers are the least and the largest that are drawn, evenly."""

    @field_validator("*")
    @classmethod
    def _check_pairs(cls, value: object) -> object:
        return _ascending(value) if isinstance(value, tuple) and len(value) == 2 else value


@description
class Upright(_Ranges):
    """Headings, pitch and roll between bounds, each evenly."""

    kind: Literal["upright"] = "upright"
    heading: tuple[Radians, Radians] = (0.0, 2 * np.pi)
    """Bounds of the heading, clockwise from north."""
    pitch: tuple[Radians, Radians] = (0.0, 0.0)
    """Bounds of the pitch; the nose up is positive."""
    roll: tuple[Radians, Radians] = (0.0, 0.0)
    """Bounds of the roll; the starboard side down is positive."""

    def attitude(self, draws: Floats) -> Attitude:
        """By three draws (0 to 1)."""
        return Attitude(*(between(b, u) for b, u in zip((self.heading, self.pitch, self.roll), draws, strict=True)))


@description
class AnyOrientation:
    """All orientations alike: evenly over rotations in space."""

    kind: Literal["any"] = "any"

    def attitude(self, draws: Floats) -> Attitude:
        """By three draws (0 to 1): heading and roll evenly, and the sine of the pitch (Haar measure)."""
        return Attitude(
            2 * np.pi * float(draws[0]), float(np.arcsin(2.0 * draws[1] - 1.0)), 2 * np.pi * float(draws[2])
        )


Orientation = Annotated[Upright | AnyOrientation, BY_KIND]


@description
class AtRest:
    """They stay where they are."""

    kind: Literal["at_rest"] = "at_rest"

    def motion(self, point: Floats, attitude: Attitude, span: SequenceTimes, draws: Floats) -> Motion:
        """Through a point (xyz) m, in the middle of the sequence; draws: (`DRAWS`,) 0 to 1."""
        return Still(position=_position(point), **vars(attitude))


@description
class StraightAhead(_Ranges):
    """Straight ahead at constant speed."""

    kind: Literal["straight"] = "straight"
    speed: tuple[MetresPerSecond, MetresPerSecond]
    """Bounds of the speed along the heading."""
    climb: tuple[MetresPerSecond, MetresPerSecond] = (0.0, 0.0)
    """Bounds of the speed upwards; the bodies stay level."""

    def motion(self, point: Floats, attitude: Attitude, span: SequenceTimes, draws: Floats) -> Motion:
        """As `AtRest.motion`."""
        speed, climb = between(self.speed, draws[0]), between(self.climb, draws[1])
        course = ConstantVelocity(start=(0.0, 0.0, 0.0), speed=speed, climb=climb, **vars(attitude))
        return replace(course, start=_position(point - velocity(course, 0.0) * span.middle))


@description
class Hovering(_Ranges):
    """They swing about their place."""

    kind: Literal["hovering"] = "hovering"
    surge: tuple[NonNegativeMetres, NonNegativeMetres] = (0.0, 0.0)
    """Bounds of the amplitude forward and back."""
    sway: tuple[NonNegativeMetres, NonNegativeMetres] = (0.0, 0.0)
    """Bounds of the amplitude to port and starboard."""
    heave: tuple[NonNegativeMetres, NonNegativeMetres] = (0.0, 0.0)
    """Bounds of the amplitude up and down."""
    yaw: tuple[Radians, Radians] = (0.0, 0.0)
    """Bounds of the amplitude of the heading."""
    period: tuple[PositiveSeconds, PositiveSeconds] = (5.0, 10.0)
    """Bounds of the period, which is the same for all swings of a body."""

    def motion(self, point: Floats, attitude: Attitude, span: SequenceTimes, draws: Floats) -> Motion:
        """As `AtRest.motion`, about the point."""
        return Hover(
            position=_position(point),
            heading=attitude.heading,
            pitch=attitude.pitch,
            roll=attitude.roll,
            surge=between(self.surge, draws[0]),
            sway=between(self.sway, draws[1]),
            heave=between(self.heave, draws[2]),
            yaw=between(self.yaw, draws[3]),
            period=between(self.period, draws[4]),
            phase=2 * np.pi * float(draws[5]),
        )


@description
class Wandering(_Ranges):
    """Leg after leg at constant speed: on the first with the heading that was drawn, on each other with another."""

    kind: Literal["wandering"] = "wandering"
    speed: tuple[MetresPerSecond, MetresPerSecond]
    """Bounds of the speed along a leg."""
    leg: PositiveSeconds
    """How long a leg takes."""
    turn: Annotated[Radians, Ge(0), Le(np.pi)]
    """By how much headings change from leg to leg, at most, to either side."""

    def motion(self, point: Floats, attitude: Attitude, span: SequenceTimes, draws: Floats) -> Motion:
        """As `AtRest.motion`."""
        speed = between(self.speed, draws[0])
        count = int(min(max(np.ceil((span.last - span.first) / self.leg), 1), 1000))
        turns = np.random.default_rng(int(draws[1] * 2**53)).uniform(-self.turn, self.turn, count)
        headings = attitude.heading + np.concatenate([[0.0], np.cumsum(turns)[:-1]])
        steps = speed * self.leg * np.stack([np.sin(headings), np.cos(headings), np.zeros(count)], axis=1)
        points = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
        times = span.first + self.leg * np.arange(count + 1)
        middle = [np.interp(span.middle, times, column) for column in points.T]
        path = tuple(
            Waypoint(time=float(t), position=_position(p)) for t, p in zip(times, point + points - middle, strict=True)
        )
        return Waypoints(points=path, pitch=attitude.pitch, roll=attitude.roll)


DrawnTrack = Annotated[AtRest | StraightAhead | Hovering | Wandering, BY_KIND]


def _position(xyz: Floats) -> tuple[float, float, float]:
    x, y, z = xyz.tolist()
    return x, y, z
