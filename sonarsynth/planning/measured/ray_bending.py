"""Whether rays bend by so little that straight ones will do, in paths and in ranges."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.description.method import Demand
from sonarsynth.environment.sea import Profile
from sonarsynth.products import Paths
from sonarsynth.propagation import Propagation, Straight
from sonarsynth.ranging.location.refraction import refracted_solution
from sonarsynth.ranging.placing.solution import isovelocity_solution
from sonarsynth.receiver import elements
from sonarsynth.recipe.scene import Frame, Scene

SHARE = 0.3
"""Of the error allowed to signals that straight rays may take."""


def propagation(scene: Scene, profile: Profile, frames: Iterable[Frame], signal: float) -> Propagation:
    """How sound travels in this water; a model may err by a share of `signal`."""

    def error(model: Propagation) -> float:
        return bending_error(model, scene, profile, frames)

    chosen: Propagation = scene.physics.tracing.resolve(Demand(SHARE * signal, signal == 0.0, error))[0]
    return chosen


def bending_error(model: Propagation, scene: Scene, profile: Profile, frames: Iterable[Frame]) -> float:
    """Error of signals, relative, that a model makes in some frames against its exact one, in water whose sound speed
    varies; inf where paths differ in number.

    The phase of the highest frequency by which travel times differ, and by which the direction at the array does at
    its rim; and the difference of amplitudes; over the ways out to the boxes round the bodies, back, and straight in.
    """
    if profile.uniform:
        return 0.0
    bottom, highest = scene.world.environment.depth, scene.sonar.band.high
    worst = 0.0
    for frame in frames:
        array = frame.sonar_pose.position
        start, end = ways(frame, bottom)
        if not len(start):
            continue
        paths, theirs = (of.connect(profile, bottom, start, end) for of in (model, model.exact()))
        if not _alike(paths, theirs):
            return np.inf
        late = 2.0 * np.pi * highest * np.abs(paths.travel_time - theirs.travel_time)
        turned = np.linalg.norm(paths.arrival - theirs.arrival, axis=1)
        wave = 2.0 * np.pi * highest / float(profile.at(depth(array)))
        over = wave * elements(scene.sonar.array).aperture * turned
        louder = np.abs(paths.spreading / theirs.spreading - 1.0)
        worst = max(worst, 2.0 * float(np.max(late + over + louder, initial=0.0)))
    return worst


def ways(frame: Frame, bottom: float) -> tuple[Floats, Floats]:
    """Starts and ends (pair, xyz) from each snap to `around` bodies and scatterers, from there to the array, and
    straight in."""
    array, points = frame.sonar_pose.position, around(frame, bottom)
    loose = [s.position[np.r_[s.position.argmin(axis=0), s.position.argmax(axis=0)]] for s in frame.moment.scatterers]
    points = np.concatenate([points, *loose])
    snaps = np.array([snap.position for snap in frame.moment.snaps]).reshape(-1, 3)
    start = np.concatenate([np.repeat(snaps, len(points), axis=0), points, snaps])
    end = np.concatenate([np.tile(points, (len(snaps), 1)), np.broadcast_to(array, (len(points) + len(snaps), 3))])
    return start, end


def unlike_straight(model: Propagation, frame: Frame, profile: Profile, bottom: float) -> float:
    """By how much (s) direct paths of a model are later or earlier than straight lines, with room: the most of those to
    `around` bodies and the array, and half as much more."""
    start, end = ways(frame, bottom)
    paths, lines = (travel_model.connect(profile, bottom, start, end) for travel_model in (model.direct, Straight()))
    return 1.5 * float(np.max(np.abs(paths.travel_time - lines.travel_time[paths.pair]), initial=0.0))


def around(frame: Frame, bottom: float) -> Floats:
    """Corners and middles (point, xyz) of the boxes round the bodies of a frame, in the water."""
    boxes = [body.box for body in frame.moment.bodies]
    points = np.concatenate([np.empty((0, 3)), *(np.vstack([box, box.mean(axis=0)]) for box in boxes)])
    points[:, 2] = np.clip(points[:, 2], -bottom, 0.0)
    return points


def _alike(first: Paths, second: Paths) -> bool:
    """Whether two models find the same paths: of the same pairs and reflections, none flagged or past a caustic."""
    if len(first.pair) != len(second.pair) or first.flag.any() or second.flag.any():
        return False
    same = (np.array_equal(getattr(first, name), getattr(second, name)) for name in ("pair", "surface", "bottom"))
    return all(same) and not second.caustics.any()


def ranging_error(scene: Scene, profile: Profile, frames: Iterable[Frame], *, shape: bool = False) -> float:
    """Largest difference (m) of ranges by the closed form from those along rays, over the boxes round the bodies.

    shape: what the shape of the profile does; the closed form then has the sound speed of the water at the array.
    """
    speed, worst = scene.sonar.assumed_sound_speed, 0.0
    if profile.uniform and (shape or profile.speed[0] == speed):
        return 0.0
    for frame in frames:
        speed = float(profile.at(depth(frame.sonar_pose.position))) if shape else speed
        points = frame.sonar_pose.to_body(around(frame, scene.world.environment.depth))
        if not len(points):
            continue
        distance = np.linalg.norm(points, axis=1)
        beam = points / distance[:, None]
        for snap in frame.moment.snaps:
            source = frame.sonar_pose.to_body(snap.position[None])[0]
            delay = (np.linalg.norm(points - source, axis=1) + distance - np.linalg.norm(source)) / speed
            straight = isovelocity_solution(delay, beam, source, speed).range
            refracted = refracted_solution(delay, beam, source, speed, frame.sonar_pose, profile).range
            differ = np.abs(straight - refracted)
            worst = max(worst, float(np.nan_to_num(differ, nan=0.0).max(initial=0.0)))
    return worst
