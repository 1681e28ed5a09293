"""A body that keeps its place as well as it can, and swings about it: a vehicle on station, or moored in swell."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, NonNegativeMetres, Position, PositiveSeconds, Radians
from sonarsynth.description import description
from sonarsynth.geometry import Pose, quaternion


@description
class Hover:
    """About a place, along its heading, across and up, and about the vertical: amplitude times the sine of the phase.

    The four swings begin a quarter of a period after each other, so that the body goes round its place.
    """

    kind: Literal["hover"] = "hover"
    position: Position
    """Position (x, y, z) that it swings about: east, north and up, 0 at the surface."""
    heading: Radians = 0.0
    """Heading that it swings about, clockwise from north."""
    pitch: Radians = 0.0
    """Pitch: the nose up is positive."""
    roll: Radians = 0.0
    """Roll: the starboard side down is positive."""
    surge: NonNegativeMetres = 0.0
    """Amplitude of the level swing along the heading."""
    sway: NonNegativeMetres = 0.0
    """Amplitude of the level swing to port and starboard."""
    heave: NonNegativeMetres = 0.0
    """Amplitude of the swing up and down."""
    yaw: Annotated[Radians, Ge(0), Le(np.pi)] = 0.0
    """Amplitude of the swing of the heading."""
    period: PositiveSeconds = 10.0
    """Period of all four swings."""
    phase: Radians = 0.0
    """Phase of the heave at time 0; surge, sway and yaw are a quarter, a half and three quarters of a period later."""


_LATER = 0.5 * np.pi * np.array([1.0, 2.0, 0.0, 3.0])  # surge, sway, heave, yaw


def _swing(motion: Hover, time: float) -> tuple[Floats, Floats]:
    """Surge, sway, heave and yaw (m, m, m, rad), and how fast they change (per s)."""
    amplitude = np.array([motion.surge, motion.sway, motion.heave, motion.yaw])
    rate = 2.0 * np.pi / motion.period
    angle = rate * time + motion.phase - _LATER
    return amplitude * np.sin(angle), rate * amplitude * np.cos(angle)


def _along(motion: Hover, swing: Floats) -> Floats:
    """(xyz) in the world of a swing forward, to port and up, by the mean heading."""
    sine, cosine = np.sin(motion.heading), np.cos(motion.heading)
    forward, port = np.array([sine, cosine, 0.0]), np.array([-cosine, sine, 0.0])
    return np.asarray(swing[0] * forward + swing[1] * port + swing[2] * np.array([0.0, 0.0, 1.0]))


def hover_pose(motion: Hover, time: float) -> Pose:
    """Where it is at a time (s)."""
    swing, _ = _swing(motion, time)
    turned = quaternion(motion.heading + float(swing[3]), motion.pitch, motion.roll)
    return Pose(np.array(motion.position) + _along(motion, swing), turned)


def hover_velocity(motion: Hover, time: float) -> Floats:
    """Velocity (xyz) m/s in the world at a time (s)."""
    return _along(motion, _swing(motion, time)[1])


def hover_spin(motion: Hover, time: float) -> Floats:
    """Angular velocity (xyz) rad/s in the world at a time (s); headings are clockwise."""
    return np.array([0.0, 0.0, -float(_swing(motion, time)[1][3])])
