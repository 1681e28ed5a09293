"""How bodies move: pose and velocity at any time. Headings are compass headings (clockwise from north)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, assert_never

import numpy as np
from annotated_types import MinLen
from pydantic import field_validator

from sonarsynth.conventions import Floats, MetresPerSecond, Position, PositiveMetres, PositiveSeconds, Radians, Seconds
from sonarsynth.description import BY_KIND, description
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.hovering import Hover, hover_pose, hover_spin, hover_velocity
from sonarsynth.geometry.recorded_track import RecordedTrack, track_pose, track_spin, track_velocity


@description
class Still:
    """At rest."""

    kind: Literal["still"] = "still"
    position: Position
    """Position (x, y, z): east, north and up, 0 at the surface."""
    heading: Radians = 0.0
    """Heading, clockwise from north; left out, it looks north (a sonar too: its beams are about its heading)."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""


@description
class Line:
    """From start to stop at constant velocity over `duration` from time 0, and on at the same velocity."""

    kind: Literal["line"] = "line"
    start: Position
    """Where the body is at time 0."""
    stop: Position
    """Where it is after `duration`."""
    duration: PositiveSeconds
    """Time from start to stop."""
    heading: Radians | None = None
    """Heading, clockwise from north; left out: along the track."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""


@description
class Waypoint:
    """A place to be at a time, with a heading."""

    time: Seconds
    """Time since the start of the motions."""
    position: Position
    """Position (x, y, z): east, north and up, 0 at the surface."""
    heading: Radians | None = None
    """Heading there, clockwise from north; left out: to the next waypoint (the last, and where it waits: as before)."""


@description
class Waypoints:
    """Straight lines between waypoints; headings turn evenly, the short way. At rest before and after."""

    kind: Literal["waypoints"] = "waypoints"
    points: Annotated[tuple[Waypoint, ...], MinLen(2)]
    """Waypoints in the order of their times."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""

    @field_validator("points")
    @classmethod
    def _check(cls, points: tuple[Waypoint, ...]) -> tuple[Waypoint, ...]:
        for i, (a, b) in enumerate(pairwise(points), start=1):
            if b.time <= a.time:
                raise ValueError(f"waypoint {i} is not later than waypoint {i - 1}")
        return points


@description
class Circle:
    """Round a centre in the horizontal plane at constant speed, heading along the track."""

    kind: Literal["circle"] = "circle"
    centre: Position
    """Centre of the circle, at the depth of the body."""
    radius: PositiveMetres
    """Radius of the circle."""
    speed: MetresPerSecond
    """Speed along the circle; positive is counter-clockwise seen from above."""
    bearing: Radians = 0.0
    """Compass bearing from the centre to the body at time 0."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""


@description
class ConstantVelocity:
    """From start at constant speed, straight ahead: what a grid over ranges, headings, speeds and depths varies."""

    kind: Literal["course"] = "course"
    start: Position
    """Where the body is at time 0."""
    heading: Radians = 0.0
    """Compass heading of the body and of its way; left out: north (a sonar looks there too)."""
    speed: MetresPerSecond = 0.0
    """Speed ahead; negative is astern."""
    climb: MetresPerSecond = 0.0
    """Speed upwards; the body stays level."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""


Motion = Annotated[Still | Line | Waypoints | Circle | ConstantVelocity | Hover | RecordedTrack, BY_KIND]


def pose(motion: Motion, time: float) -> Pose:
    """Where a body is at a time (s). Raises TrackError where the file of a track cannot be used."""
    match motion:
        case RecordedTrack():
            return track_pose(motion, time)
        case Hover():
            return hover_pose(motion, time)
        case Still():
            return Pose(np.array(motion.position), quaternion(motion.heading, motion.pitch, motion.roll))
        case Line():
            position = np.array(motion.start) + velocity(motion, time) * time
            heading = _course(velocity(motion, time)) if motion.heading is None else motion.heading
            return Pose(position, quaternion(heading, motion.pitch, motion.roll))
        case ConstantVelocity():
            position = np.array(motion.start) + velocity(motion, time) * time
            return Pose(position, quaternion(motion.heading, motion.pitch, motion.roll))
        case Waypoints():
            return _pose_on_waypoints(motion, time)
        case Circle():
            angle = _angle(motion, time)
            position = np.array(motion.centre) + motion.radius * np.array([np.cos(angle), np.sin(angle), 0.0])
            return Pose(position, quaternion(_course(velocity(motion, time)), motion.pitch, motion.roll))
    assert_never(motion)


def velocity(motion: Motion, time: float) -> Floats:
    """Velocity (3,) in the world at a time (m/s); at a waypoint, that of the leg that begins."""
    match motion:
        case RecordedTrack():
            return track_velocity(motion, time)
        case Hover():
            return hover_velocity(motion, time)
        case Still():
            return np.zeros(3)
        case Line():
            return np.asarray((np.array(motion.stop) - np.array(motion.start)) / motion.duration)
        case ConstantVelocity():
            ahead = motion.speed * np.array([np.sin(motion.heading), np.cos(motion.heading), 0.0])
            return np.asarray(ahead + [0.0, 0.0, motion.climb])
        case Waypoints():
            a, b = _leg(motion, time)
            if not motion.points[0].time <= time < motion.points[-1].time:
                return np.zeros(3)
            return np.asarray((np.array(b.position) - np.array(a.position)) / (b.time - a.time))
        case Circle():
            angle = _angle(motion, time)
            return np.asarray(motion.speed * np.array([-np.sin(angle), np.cos(angle), 0.0]))
    assert_never(motion)


def spin(motion: Motion, time: float) -> Floats:
    """Angular velocity (3,) in the world at a time (rad/s): headings alone change, but on a track; at a waypoint, of
    the leg that begins."""
    match motion:
        case RecordedTrack():
            return track_spin(motion, time)
        case Hover():
            return hover_spin(motion, time)
        case Circle():
            return np.array([0.0, 0.0, motion.speed / motion.radius])
        case Waypoints():
            a, b = _leg(motion, time)
            if not motion.points[0].time <= time < motion.points[-1].time:
                return np.zeros(3)
            return np.array([0.0, 0.0, -_turn(motion, a, b) / (b.time - a.time)])
        case Still() | Line() | ConstantVelocity():
            return np.zeros(3)
    assert_never(motion)


@dataclass(frozen=True, eq=False)
class Track:
    """Where something that moves is about an instant."""

    pose: Pose
    velocity: Floats  # (xyz) m/s, world
    motion: Motion | None = None  # that brought it here; None: it goes on at its velocity, and does not turn
    time: float = 0.0  # s: of the motion
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m, own frame, from what the motion moves

    @property
    def spin(self) -> Floats:
        """(xyz) rad/s: angular velocity, world."""
        return np.zeros(3) if self.motion is None else spin(self.motion, self.time)

    @property
    def still(self) -> bool:
        """Whether it stays where it is."""
        return (self.motion is None and not self.velocity.any()) or isinstance(self.motion, Still)

    @property
    def straight(self) -> bool:
        """Whether it keeps its velocity and does not turn, at any time."""
        return self.motion is None or isinstance(self.motion, Still | Line | ConstantVelocity)

    def part(self, offset: Floats) -> Track:
        """The track of a point of it, offset (xyz) m in its own frame."""
        turned = self.pose.turn_to_world(offset)
        pose = Pose(self.pose.position + turned, self.pose.orientation)
        x, y, z = (np.asarray(self.offset) + offset).tolist()
        turning = np.cross(self.spin, turned) if offset.any() else 0.0
        return Track(pose, self.velocity + turning, self.motion, self.time, (x, y, z))

    @property
    def in_own_frame(self) -> tuple[Floats, Floats]:
        """Velocity (xyz) m/s and spin (xyz) rad/s along its own axes."""
        return self.pose.turn_to_body(self.velocity), self.pose.turn_to_body(self.spin)

    def later(self, seconds: float) -> Track:
        """The same so many seconds (s) after, or before."""
        time = self.time + seconds
        if self.motion is None or self.straight:
            there = self.pose.position + self.velocity * seconds
            moved = self.pose if self.still else Pose(there, self.pose.orientation)
            return Track(moved, self.velocity, self.motion, time, self.offset)
        body = Track(pose(self.motion, time), velocity(self.motion, time), self.motion, time)
        return body.part(np.array(self.offset)) if any(self.offset) else body

    def positions(self, seconds: Floats) -> Floats:
        """Where it is (..., xyz) m, world, so many seconds (...) s after."""
        if self.straight:
            return np.asarray(self.pose.position + seconds[..., None] * self.velocity)
        places = [self.later(late).pose.position for late in seconds.ravel().tolist()]
        return np.array(places).reshape(*seconds.shape, 3)


def _angle(motion: Circle, time: float) -> float:
    """Polar angle of the body about the centre, from x (rad)."""
    return 0.5 * np.pi - motion.bearing + motion.speed / motion.radius * time


def _course(v: Floats) -> float:
    """Compass heading of a velocity; 0 (north) at rest or straight up."""
    return float(np.arctan2(v[0], v[1])) if np.hypot(v[0], v[1]) > 0 else 0.0


def _leg(motion: Waypoints, time: float) -> tuple[Waypoint, Waypoint]:
    times = [p.time for p in motion.points]
    i = int(np.clip(np.searchsorted(times, time, side="right") - 1, 0, len(times) - 2))
    return motion.points[i], motion.points[i + 1]


def _heading_at(motion: Waypoints, index: int) -> float:
    """Heading at a waypoint: its own, or that of the leg that begins; where that goes nowhere, or straight up, what the
    body came with, or else the first that there is."""
    points, last = motion.points, len(motion.points) - 1
    for i in (*range(index, -1, -1), *range(index + 1, last)):
        heading, leg = points[i].heading, min(i, last - 1)
        way = np.subtract(points[leg + 1].position, points[leg].position)
        if heading is not None or way[:2].any():
            return _course(way) if heading is None else heading
    return points[last].heading or 0.0


def _pose_on_waypoints(motion: Waypoints, time: float) -> Pose:
    a, b = _leg(motion, time)
    fraction = float(np.clip((time - a.time) / (b.time - a.time), 0.0, 1.0))
    position = (1 - fraction) * np.array(a.position) + fraction * np.array(b.position)
    i = motion.points.index(a)
    start = _heading_at(motion, i)
    if a.heading is None and b.heading is None and fraction >= 1.0:
        start = _heading_at(motion, i + 1)
    return Pose(position, quaternion(start + fraction * _turn(motion, a, b), motion.pitch, motion.roll))


def _turn(motion: Waypoints, a: Waypoint, b: Waypoint) -> float:
    """By how much (rad) the heading changes on the leg from a to b, clockwise."""
    if a.heading is None and b.heading is None:
        return 0.0  # along each leg, turning at the waypoint
    i = motion.points.index(a)
    return float((_heading_at(motion, i + 1) - _heading_at(motion, i) + np.pi) % (2 * np.pi) - np.pi)
