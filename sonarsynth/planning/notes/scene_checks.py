"""Is everything in the water, and can every file be read? Asked before anything is computed."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.casting.surface_distances import enclosed
from sonarsynth.conventions import FASTEST, REFERENCE_PRESSURE, SLOWEST, Floats, depth
from sonarsynth.description import FieldError
from sonarsynth.environment.casts import profile_above, profile_of
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays.ray_solutions import TOLERANCE
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.motion import Track, pose
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.planning.notes.noise_checks import check_noises, source_places
from sonarsynth.planning.notes.track_checks import check_tracks
from sonarsynth.receiver import Sonar, elements
from sonarsynth.receiver.sensor_errors import drawn_errors
from sonarsynth.recipe.scene import Frame, Scene
from sonarsynth.signals.array_paths import MAX_DOPPLER
from sonarsynth.signals.filtered_pulse import heard_part
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.sources.sound_source import SoundSource
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.tracing.meetings import family_times

FARTHEST = 1e6
"""m from the origin: beyond, travel times lose their microseconds."""
CLOSEST = 1e-3
"""m: a snap no nearer to the centre of the array, or to a hydrophone."""
LATEST = 1e6
"""s from the instant of a frame: beyond, the times of its sound lose their nanoseconds."""
OLDEST = 1e10
"""s from the start of the motions: beyond, what moves at some metres a second loses its micrometres."""
LOUDEST = 300.0
"""dB re 1 uPa at 1 m: single precision holds the signals of no louder snap everywhere."""
LONGEST_SNAP = 0.1
"""s."""
FAINTEST = 1e-9
"""Part of a snap that the filter must let pass: what rounding makes of nothing is less."""
IN_WATER = (1000.0, 2500.0)
"""m/s: what may be measured in water, warm or cold, in depths or in a tank."""
STEEPEST = 1e6
"""m/s a metre: more is a jump, which is written as two speeds at one depth."""


def read_inputs(scene: Scene) -> Profile:
    """Read cast, tracks and meshes, so that a missing or broken file is known before anything is computed; the sound
    speed of the water down to the bottom."""
    world = ("scene", "world")
    try:
        profile = profile_of(scene.world.environment.sound_speed)
    except (ValueError, OSError, ImportError) as error:
        raise FieldError((*world, "environment", "sound_speed"), str(error)) from None
    _check_profile(scene, profile)
    check_noises(scene)
    check_tracks(scene)
    for i, (target, law) in enumerate(zip(scene.world.targets, scene.laws, strict=True)):
        try:
            _check_plain(scene, i)
            target.mesh(law, scene.sonar.shortest_wavelength)
        except FieldError:
            raise
        except (ValueError, OSError) as error:
            raise FieldError((*world, "targets", i, "shape"), str(error)) from None
    try:
        elements(scene.sonar.array)
    except ValueError as error:
        raise FieldError(("scene", "sonar", "array"), str(error)) from None
    return _water(scene)


def _water(scene: Scene) -> Profile:
    """The sound speed down to the bottom."""
    environment = scene.world.environment
    return profile_above(environment.sound_speed, environment.depth)


def _check_profile(scene: Scene, profile: Profile) -> None:
    """The sound speed must be that of water, somewhere above the bottom, and change at a rate that rays can follow."""
    path = ("scene", "world", "environment", "sound_speed")
    slowest, fastest = IN_WATER if scene.world.environment.sound_speed.measured else (SLOWEST, FASTEST)
    odd = np.flatnonzero(~((profile.speed >= slowest) & (profile.speed <= fastest)))
    if len(odd):
        feet = IN_WATER[0] <= 0.3048 * profile.speed[odd[0]] <= IN_WATER[1]
        raise FieldError(
            path,
            f"is {profile.speed[odd[0]]:g} m/s at {profile.depth[odd[0]]:g} m, outside {slowest:g} to {fastest:g} m/s"
            + (": is it in feet per second?" if feet else ""),
        )
    if profile.depth[0] > scene.world.environment.depth:
        line = f"is given from {profile.depth[0]:g} m down, below the bottom at {scene.world.environment.depth:g} m"
        raise FieldError(path, line)
    steep = np.flatnonzero(np.abs(np.diff(profile.speed)) > STEEPEST * np.diff(profile.depth))
    jumps = steep[np.diff(profile.depth)[steep] > 0]
    if len(jumps):
        at, below = profile.depth[jumps[0]], profile.depth[jumps[0] + 1]
        line = f"changes by more than {STEEPEST:g} m/s per metre between {at:.12g} and {below:.12g} m"
        raise FieldError(path, line)


def _check_plain(scene: Scene, number: int) -> None:
    """A mesh file must be in the water as it stands, before it is cut into many facets: its unit may be wrong."""
    target, bottom_depth = scene.world.targets[number], scene.world.environment.depth
    if target.shape.plain is None:
        return
    plain = mesh_of(target.shape.plain).scaled(target.scale)
    body = PlacedTarget(target.name, plain, pose(target.motion, scene.trajectory.time(0)), np.zeros(3))
    if not _box_in_water(body, bottom_depth):
        size = float(np.ptp(plain.box, axis=0).max())
        name = f"target '{body.name}', {f'{size:.3g} m long {target.shape.read_as}'.strip()},"
        path = ("scene", "world", "targets", number, "motion")
        _check_depth(path, name, _places(body), bottom_depth, "the first frame")


def check_shrimp(scene: Scene) -> None:
    """Every source must be in the water, and its pulse one that can be made and heard."""
    bottom_depth = scene.world.environment.depth
    for i, source in enumerate(scene.sources):
        path = ("scene", "world", "sources", i)
        position = source.checked_position(bottom_depth, scene.trajectory.start)
        if not np.abs(position).max() <= FARTHEST:
            raise FieldError((*path, "position"), f"is more than {FARTHEST:g} m from the origin")
        down = -float(position[2])
        if not 0 <= down <= bottom_depth:
            raise FieldError((*path, "position"), f"depth {down:.12g} m is outside the water (0 to {bottom_depth:g} m)")
        if late := [time for time in source.times if not abs(time) <= LATEST]:
            line = f"{late[0]:g} s is more than {LATEST:g} s from the instant of a frame"
            raise FieldError((*path, source.times_field), line)
        try:
            _check_pulse(source, bottom_depth, scene.sonar)
        except ValueError as error:
            raise FieldError((*path, source.pulse_field), str(error)) from None
    if (chorus := scene.world.chorus) is not None:
        try:
            shrimp = SnappingShrimp(position=(0.0, 0.0), snap=chorus.snap, source_level=chorus.level)
            _check_pulse(shrimp, bottom_depth, scene.sonar)
        except ValueError as error:
            raise FieldError(("scene", "world", "chorus", "snap"), str(error)) from None


def check_frame(scene: Scene, frame: Frame) -> None:
    """The array and every body must be in the water, no snap inside a body or the array, and a hydrophone must hear."""
    _check_hearing(scene, frame)
    array, bottom_depth, when = elements(scene.sonar.array), scene.world.environment.depth, f"frame {frame.index}"
    if not abs(frame.time) <= OLDEST:
        line = f"{when} is {frame.time:.3g} s from the start of the motions: too far"
        raise FieldError(("scene", "trajectory"), line)
    centre = frame.sonar_pose.position
    if not _ball_in_water(centre, array.aperture, bottom_depth):
        hydrophones = frame.sonar_pose.to_world(array.position)
        name = f"the array, {np.linalg.norm(np.ptp(hydrophones, axis=0)):.3g} m across,"
        _check_depth(("scene", "trajectory", "sonar"), name, hydrophones, bottom_depth, when)
    for i, body in enumerate(frame.moment.bodies):
        path = ("scene", "world", "targets", i, "motion")
        if not _box_in_water(body, bottom_depth):
            _check_depth(path, f"target '{body.name}'", _places(body), bottom_depth, when)
        if scene.physics.doppler:
            _check_speed(scene, frame, i)
            _check_met(scene, frame, i)
        if _apart(body, centre, array.aperture):
            continue
        if enclosed(body, centre[None])[0]:
            raise FieldError(path, f"target '{body.name}' contains the sonar at {when}, or touches it")
        if (sensors := enclosed(body, frame.sonar_pose.to_world(array.position))).any():
            line = f"target '{body.name}' contains hydrophone {sensors.argmax()} at {when}, or touches it"
            raise FieldError(path, line)
    _check_sources(scene, frame)
    for number, field in enumerate(frame.moment.scatterers):
        _check_depth(("scene", "world", "scatterers", number), "a scatterer", field.position, bottom_depth, when)


def _check_hearing(scene: Scene, frame: Frame) -> None:
    """Processing must be left a hydrophone, without those that it knows to be dead or stuck."""
    gain, errors = elements(scene.sonar.array).gain, scene.sonar.sensor_errors
    if not gain.any():
        raise FieldError(("scene", "sonar", "array", "dead"), "names every hydrophone: none is left to hear")
    if errors is None or errors.known == "none":
        return
    if not (gain * drawn_errors(errors, len(gain), frame.seed, frame.key).works).any():
        line = f"every hydrophone is dead or stuck at frame {frame.index}"
        raise FieldError(("scene", "sonar", "sensor_errors"), line)


def _check_met(scene: Scene, frame: Frame, number: int) -> None:
    """A body must be in the water where the sound of each snap meets it, and no snap inside it when it sounds."""
    body, slowest = frame.moment.bodies[number], float(_water(scene).speed.min())
    snaps, path = frame.moment.snaps, ("scene", "world", "targets", number, "motion")
    if body.track.still or not snaps:
        return
    bottom_depth, name = scene.world.environment.depth, f"target '{body.name}', where sound meets it,"
    bounces = 0 if body.track.straight else scene.physics.tracing.bounces  # what turns is met anew by each family
    met = family_times([body.track], snaps, bottom_depth, bounces, slowest)
    for late in {float(met.min()), float(met.max())}:
        moved = body.later(late)
        if not _box_in_water(moved, bottom_depth):
            _check_depth(path, name, _places(moved), bottom_depth, f"frame {frame.index}")
    for snap in snaps:
        if snap.time and enclosed(body.later(snap.time), snap.position[None])[0]:
            raise FieldError(path, f"{name} contains a snap at frame {frame.index}, or touches it")


def _check_speed(scene: Scene, frame: Frame, number: int) -> None:
    """Nothing moves so fast that the pulses are stretched beyond what the synthesis can do (`MAX_DOPPLER`)."""
    body, sonar = frame.moment.bodies[number], frame.sonar_track
    array, own = _fastest(sonar, elements(scene.sonar.array).aperture), _fastest(body.track, body.mesh.radius)
    slowest = float(_water(scene).speed.min())
    if array + 2.0 * own > 0.9 * MAX_DOPPLER * slowest:
        faster = array > 2.0 * own
        path = ("scene", "trajectory", "sonar") if faster else ("scene", "world", "targets", number, "motion")
        name, speed, track = ("the array", array, sonar) if faster else (f"target '{body.name}'", own, body.track)
        moves = "moves and turns at up to" if track.spin.any() else "moves at"
        raise FieldError(path, f"{name} {moves} {speed:.3g} m/s at frame {frame.index}, too fast for sound in water")


def _fastest(track: Track, reach: float) -> float:
    """Speed (m/s) of the fastest part of what moves, and turns, and reaches so far (m) from its origin."""
    return math.hypot(*track.velocity) + math.hypot(*track.spin) * reach  # squares nothing: absurd speeds overflow


def _check_sources(scene: Scene, frame: Frame) -> None:
    """No source, of snaps or of noise, is at the centre of the array, at a hydrophone, or inside a target."""
    array, centre = elements(scene.sonar.array), frame.sonar_pose.position
    slowest, bottom = float(_water(scene).speed.min()), scene.world.environment.depth
    for path, place, speed in source_places(scene, frame):
        if (away := math.dist(place, centre)) < CLOSEST:
            raise FieldError(path, f"is at the centre of the array at frame {frame.index}")
        if away < 2.0 * (array.aperture + CLOSEST):
            distance = np.linalg.norm(frame.sonar_pose.to_world(array.position) - place, axis=1)
            if distance.min() < CLOSEST:
                raise FieldError(path, f"is at hydrophone {distance.argmin()} of the array at frame {frame.index}")
        _check_depth(path, "a source", place[None], bottom, f"frame {frame.index}")
        fast = math.hypot(*speed, *frame.sonar_velocity) > 0.4 * MAX_DOPPLER * slowest
        if fast and (scene.physics.doppler or "noise_sources" in path):  # recordings are played by it all the same
            raise FieldError(path, f"moves too fast for sound in water at frame {frame.index}")
        for body in frame.moment.bodies:
            if not _apart(body, place) and enclosed(body, place[None])[0]:
                raise FieldError(path, f"is inside target '{body.name}' at frame {frame.index}, or touches it")


def _apart(body: PlacedTarget, place: Floats, radius: float = 0.0) -> bool:
    """Whether a ball about a place (xyz), both in m, is so far from the ball round a body that they do not touch."""
    return math.dist(body.pose.position, place) > 1.01 * (body.mesh.radius + radius) + CLOSEST


def _ball_in_water(centre: Floats, radius: float, bottom_depth: float) -> bool:
    """Whether all that is so near (m) to a place (xyz) m is in the water."""
    down = -float(centre[2])
    return radius <= down <= bottom_depth - radius and max(map(abs, centre.tolist())) + radius <= FARTHEST


def _box_in_water(body: PlacedTarget, bottom_depth: float) -> bool:
    """Whether the ball or the box round a body is in the water: then all of the body is."""
    if _ball_in_water(body.pose.position, body.mesh.radius, bottom_depth):
        return True
    corners = body.box
    down = depth(corners)
    return bool(down.min() >= 0.0 and down.max() <= bottom_depth and np.abs(corners).max() <= FARTHEST)


def _places(body: PlacedTarget) -> Floats:
    """Places in the world of the vertices of a body that lie farthest out along each axis of the world, either way."""
    extreme = []
    for block in in_blocks(len(body.mesh.vertices)):
        places = body.pose.to_world(body.mesh.vertices[block])
        extreme.append(places[np.concatenate([places.argmin(axis=0), places.argmax(axis=0)])])
    return np.concatenate(extreme)


def _check_pulse(source: SoundSource, bottom_depth: float, sonar: Sonar) -> None:
    """Whether the pulse can be made, is short, neither too loud nor out of the sonar's band; else ValueError."""
    model = source.model(bottom_depth)
    gain, longest = source.largest_scales
    if fault := model.fault(longest, LONGEST_SNAP):
        raise ValueError(fault)
    pulse = model.checked_pulse(0.0, 0.0)
    if not longest * (pulse.end - pulse.start) <= LONGEST_SNAP:
        raise ValueError(f"lasts {longest * (pulse.end - pulse.start):.3g} s; a snap is over in {LONGEST_SNAP:g} s")
    level = float(20.0 * np.log10(gain * pulse.peak / REFERENCE_PRESSURE))
    if not abs(level) <= LOUDEST:
        raise ValueError(f"makes a source level of {level:.3g} dB re 1 uPa at 1 m; {LOUDEST:g} dB is the most")
    for width in {longest, 1.0 / longest}:
        passed = heard_part(waveform(model, width), sonar.antialias)
        if not passed >= FAINTEST:
            raise ValueError(f"is not heard: the sonar's filter passes only {passed:.1g} of it")


def _check_depth(path: tuple[str | int, ...], name: str, points: Floats, bottom_depth: float, when: str) -> None:
    if not np.abs(points).max() <= FARTHEST:
        raise FieldError(path, f"{name} is more than {FARTHEST:g} m from the origin at {when}")
    shallow, deep = float(depth(points).min()), float(depth(points).max())
    if shallow < -TOLERANCE:
        raise FieldError(path, f"{name} is {-shallow:.3g} m above the surface at {when}")
    if deep > bottom_depth + TOLERANCE:
        raise FieldError(path, f"{name} is {deep - bottom_depth:.3g} m below the bottom at {when}")
