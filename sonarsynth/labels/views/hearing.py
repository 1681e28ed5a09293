"""When the array hears each body, and the bodies as it has them then: where sound met them, from where it is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose, quaternion_product
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.state import FrameContext

BRIEF = 1e-6
"""s: from the instant of a frame, in which nothing moves or turns."""
ROUNDS = 3
"""Of solving for when the array hears: each leaves its speed over that of sound of the error."""
TINY = 1e-300


class Hearing(NamedTuple):
    """Of the snap that lights targets and is loudest at the array, by direct paths; in the mean of the others where one
    has none."""

    bodies: tuple[PlacedTarget, ...]  # where its sound meets them
    heard: Floats  # (target,) s: when the middle of the array hears that
    sonar: Track


def hearing(
    context: FrameContext, met: Floats, there: list[tuple[PlacedTarget, ...]], snap_level: Floats
) -> Hearing | None:
    """Of a frame; None where nothing moves while sound is under way, or no snap lights a target.

    met: (snap, target) s when the sound of each snap meets each target; there: of each snap, `met_at` that; snap_level:
    (snap,) dB.
    """
    track, snaps, known = context.receiver.track, context.snaps, np.isfinite(met)
    lights = [n for n, snap in enumerate(snaps) if snap.illuminates and known[n].any()]
    if track is None or not lights:
        return None
    away = [max(math.dist(snap.position, track.pose.position), TINY) for snap in snaps]
    loudest = max(lights, key=lambda n: snap_level[n] - 20.0 * math.log10(away[n]))
    times, bodies = met[loudest], there[loudest]
    if not known[loudest].all():
        times = np.where(known[loudest], times, times[known[loudest]].mean())
        bodies = met_at(context.bodies, times)
    place, heard = np.array([body.pose.position for body in bodies]), times
    for _ in range(1 if track.still else ROUNDS):
        away = np.linalg.norm(place - track.positions(heard), axis=1)
        heard = times + away / context.receiver.speed(context.medium)
    return Hearing(bodies, heard, track)


def met_at(bodies: tuple[PlacedTarget, ...], times: Floats) -> tuple[PlacedTarget, ...]:
    """Bodies where they are at times (body,) s of the frame; at the instant of the frame where these are NaN."""
    return tuple(
        body if np.isnan(time) else body.later(time) for body, time in zip(bodies, times.tolist(), strict=True)
    )


def as_heard(bodies: tuple[PlacedTarget, ...], when: Hearing | None) -> tuple[PlacedTarget, ...]:
    """Bodies where sound met them, as far and in the direction that the array then has them, from its place at the
    instant of the frame."""
    if when is None:
        return bodies
    there, now = when.bodies, when.sonar.pose
    if when.sonar.still:
        return there
    heard = []
    for body, time in zip(there, when.heard.tolist(), strict=True):
        then, place = when.sonar.later(time).pose, body.pose
        turn = quaternion_product(now.orientation, _inverse(then.orientation))
        carried = Pose(now.to_world(then.to_body(place.position)), quaternion_product(turn, place.orientation))
        heard.append(replace(body, pose=carried))
    return tuple(heard)


def mean_motion(sonar: Track | None, when: Hearing | None) -> tuple[Floats, Floats]:
    """Velocity (xyz) m/s and spin (xyz) rad/s, world, that bring the array from the instant of the frame to where it is
    when it hears echoes, in the mean over targets; those of the instant where it hears none."""
    if sonar is None:
        return np.zeros(3), np.zeros(3)
    heard = 0.0 if when is None else float(when.heard.mean())
    if sonar.straight or abs(heard) < BRIEF:
        return sonar.velocity, sonar.spin
    then = sonar.later(heard).pose
    turn = quaternion_product(then.orientation, _inverse(sonar.pose.orientation))
    turn *= np.copysign(1.0, turn[0])
    sine = float(np.linalg.norm(turn[1:]))
    rate = 2.0 * float(np.arctan2(sine, turn[0])) / max(sine, TINY) / heard
    return (then.position - sonar.pose.position) / heard, rate * turn[1:]


def _inverse(orientation: Floats) -> Floats:
    w, *rest = orientation
    return np.array([w, *np.negative(rest)])
