"""Where targets are when sound meets them: the retarded equation, on tracks that are straight and that bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from sonarsynth.description import FieldError
from sonarsynth.environment.noise.directions import OneDirection
from sonarsynth.environment.noise.flat_noise import FlatNoise
from sonarsynth.geometry.hovering import Hover
from sonarsynth.geometry.motion import Circle, ConstantVelocity, Still, Track, Waypoint, Waypoints, pose, spin, velocity
from sonarsynth.labels import label
from sonarsynth.pipeline.synthesis import frame_signals
from sonarsynth.planning import Choices, plan
from sonarsynth.planning.measured.sampled_arrivals import context_of
from sonarsynth.planning.notes.scene_checks import check_frame
from sonarsynth.propagation import AutoTracing, Refracted, Straight
from sonarsynth.receiver import POINT, BeamGrid, PlanarLattice, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Physics
from sonarsynth.state import FrameContext, Medium, Receiver
from sonarsynth.tracing.arrivals import trace
from tests.bodies import ball
from tests.laws.test_traced_families import BOTTOM_DEPTH, RIGID, SONAR, THERMOCLINE, UNIFORM, C
from tests.laws.test_traced_families import snap as snap_at
from tests.scenes import remus

TIMES = (-0.1, 0.0, 0.1)
NOW = 2.0
MOTIONS = {
    "still": Still(position=(15.0, 1.0, -6.0)),
    "course": ConstantVelocity(start=(15.0, -50.0, -6.0), heading=0.3, speed=30.0, climb=0.5),
    "circle": Circle(centre=(18.0, 0.0, -5.0), radius=6.0, speed=-9.0, bearing=4.0),
    "waypoints": Waypoints(
        points=(
            Waypoint(time=0.0, position=(20.0, 8.0, -6.0), heading=0.1),
            Waypoint(time=2.01, position=(18.0, -6.0, -5.0), heading=2.1),
            Waypoint(time=4.0, position=(10.0, -8.0, -5.0), heading=-2.9),
        )
    ),
}
"""The last passes a waypoint while sound is under way."""


def truth(motion, straight: bool = True, doppler: bool = True):
    body = replace(ball(), pose=pose(motion, NOW), velocity=velocity(motion, NOW), motion=motion, time=NOW)
    rays, water = (Straight(), UNIFORM) if straight else (Refracted(), THERMOCLINE)
    beams = BeamGrid(azimuth_span=0.2, azimuths=3, elevation_span=0.2, elevations=3)
    track = Track(SONAR, np.zeros(3)) if doppler else None
    receiver, snaps = Receiver(SONAR, POINT, Sonar(beams=beams), track), tuple(snap_at(time) for time in TIMES)
    context = FrameContext(NOW, (body,), snaps, Medium(RIGID, water), receiver)
    return label(context, rays, np.zeros(len(TIMES)))


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_snap_meets_a_target_at_the_root_of_the_retarded_equation(kind: str) -> None:
    motion, found = MOTIONS[kind], truth(MOTIONS[kind])
    for n, time in enumerate(TIMES):
        source = found.snap_position[n]
        met = brentq(
            lambda t, s=source, e=time: t - e - np.linalg.norm(pose(motion, NOW + t).position - s) / C,
            time,
            time + 0.1,
            xtol=1e-14,
        )
        assert found.meeting_time[n, 0] == pytest.approx(met, abs=1e-9)
        np.testing.assert_allclose(found.position_at_echo[n, 0], pose(motion, NOW + met).position, atol=1e-7)


def test_through_bent_water_the_direct_ray_says_when() -> None:
    found = truth(MOTIONS["course"], straight=False)
    for n, time in enumerate(TIMES):
        there = found.position_at_echo[n]
        rays = Refracted().connect(THERMOCLINE, BOTTOM_DEPTH, found.snap_position[n][None], there)
        assert found.meeting_time[n, 0] == pytest.approx(time + rays.travel_time[0], abs=1e-9)
        np.testing.assert_allclose(
            there[0], pose(MOTIONS["course"], NOW + found.meeting_time[n, 0]).position, atol=1e-9
        )


def test_where_nothing_moves_while_sound_is_under_way_a_target_is_met_where_it_is() -> None:
    for kind, doppler in (("still", True), ("course", False), ("circle", False)):
        found = truth(MOTIONS[kind], doppler=doppler)
        assert np.array_equal(found.position_at_echo, np.broadcast_to(found.target_position, (3, 1, 3)))
        straight = np.linalg.norm(found.target_position - found.snap_position, axis=1) / C
        np.testing.assert_allclose(found.meeting_time[:, 0], straight + TIMES, atol=1e-12)


@pytest.mark.parametrize("kind", MOTIONS)
def test_the_spin_of_a_motion_is_the_rate_of_its_orientation(kind: str) -> None:
    motion, step = MOTIONS[kind], 1e-5
    for time in (0.5, 1.9, 2.5):
        turned = (pose(motion, time + step).rotation - pose(motion, time - step).rotation) / (2 * step)
        rate = turned @ pose(motion, time).rotation.T
        np.testing.assert_allclose(
            spin(motion, time), [rate[2, 1], rate[0, 2], rate[1, 0]], atol=1e-7 * (1 + np.abs(rate).max())
        )


def moved(motion, times: tuple[float, ...] = (0.0,)):
    """A frame of a vehicle on a motion, lit by snaps at some times."""
    recipe = remus(1)
    world = recipe.scene.world
    target = replace(world.targets[0], motion=motion)
    shrimp = replace(world.sources[0], snap_times=times)
    scene = replace(recipe.scene, world=replace(world, targets=(target,), sources=(shrimp,)))
    return replace(recipe, scene=scene)


def test_a_target_that_sound_would_meet_out_of_the_water_is_refused() -> None:
    rising = ConstantVelocity(start=(20.0, 0.0, -0.5), climb=10.0)
    for time in (0.0, 0.1):
        scene, frame = moved(rising, (time,)).frame(0)
        if time:
            with pytest.raises(
                FieldError, match=r"'remus', where sound meets it, is .* m above the surface at frame 0"
            ):
                check_frame(scene, frame)
        else:
            check_frame(scene, frame)


def reflected(motion, own=None):
    """A vehicle on a motion in 60 m of water, heard by four hydrophones with up to two reflections."""
    scene = moved(motion).scene
    environment = replace(scene.world.environment, depth=60.0)
    (shrimp,) = scene.world.sources
    world = replace(scene.world, environment=environment, sources=(replace(shrimp, position=(14.0, -5.0, -8.0)),))
    sonar = replace(scene.sonar, array=PlanarLattice(columns=2, rows=2, pitch=0.01))
    way = scene.trajectory if own is None else replace(scene.trajectory, sonar=own)
    physics = Physics(tracing=AutoTracing(bounces=2))
    return Recipe(scene=replace(scene, world=world, sonar=sonar, trajectory=way, physics=physics))


STAYS = Still(position=(20.0, 0.0, -4.5))


@pytest.mark.parametrize(
    ("body", "own"),
    [
        (Circle(centre=(20.0, 0.0, -4.5), radius=4.0, speed=0.6), None),
        (Circle(centre=(20.0, 0.0, -4.5), radius=4.0, speed=1.4), None),
        (STAYS, Circle(centre=(2.0, 0.0, -5.0), radius=2.0, speed=0.6, bearing=1.5 * np.pi)),
        (STAYS, Hover(position=(0.0, 0.0, -5.0), heading=0.5 * np.pi, surge=0.5, phase=3.0)),
    ],
)
def test_a_plan_says_by_how_much_signals_err_where_bodies_or_sonar_turn(body, own) -> None:
    """Beside each family traced for itself: no less than that, and no more than ten times as much."""
    recipe = reflected(body, own)
    made = plan(recipe, ("signals",), Choices(negligible=1e-11))
    frame = made.recipe.frame(0)[1]
    context, heard = context_of(made, frame), []
    for shared in (context.tolerances.shared, 0.0):
        apart = replace(context, tolerances=replace(context.tolerances, shared=shared))
        arrivals = trace(apart, made.propagation)
        heard.append(frame_signals(made, frame, arrivals.select(~arrivals.direct)).pressure)
    (row,) = (o for o in made.left_out if "motion" in o.what)
    error, said = np.abs(heard[0] - heard[1]).max() / np.abs(heard[1]).max(), float(row.bound.split(" of the")[0])
    assert 0.0 < error < said < 10.0 * error < made.recipe.accuracy.signal


def test_a_plan_says_how_far_a_sonar_turns_while_it_hears_noise() -> None:
    """Its rate times half the length of the record, from whose middle the noise is heard; nothing at rest."""
    for own in (None, Circle(centre=(2.0, 0.0, -5.0), radius=2.0, speed=0.6, bearing=1.5 * np.pi)):
        recipe = reflected(STAYS, own)
        environment = replace(
            recipe.scene.world.environment, noise=FlatNoise(level=30.0, directions=OneDirection(bearing=1.0))
        )
        scene = replace(recipe.scene, world=replace(recipe.scene.world, environment=environment))
        made = plan(replace(recipe, scene=scene), ("signals",), Choices())
        rows = [float(o.bound.split()[3]) for o in made.left_out if "in noise" in o.what]
        half = 0.5 * made.windows.samples / scene.sonar.sampling_frequency
        assert rows == ([] if own is None else pytest.approx([np.rad2deg(0.3 * half)], rel=0.1))


@pytest.mark.parametrize("own", [ConstantVelocity(start=(0.0, 0.0, -0.03), climb=2.0),
                                 Hover(position=(0.0, 0.0, -0.06), heave=0.5, period=2.0)])  # fmt: skip
def test_a_sonar_that_would_hear_out_of_the_water_is_refused(own) -> None:
    """In the water when the snap sounds, and at its instant."""
    made = plan(reflected(STAYS, own), ("signals",), Choices())
    with pytest.raises(
        FieldError, match=r"trajectory\.sonar: the array, where it hears sound, reaches above the surface"
    ):
        trace(context_of(made, made.recipe.frame(0)[1]), made.propagation)


def test_a_target_that_turns_is_refused_where_a_reflection_would_meet_it_out_of_the_water() -> None:
    """In the water till the direct sound has met it."""
    rising = Hover(position=(20.0, 0.0, -0.17), heave=0.5, period=2.0)  # at 1.6 m/s
    scene, frame = reflected(rising).frame(0)
    check_frame(replace(scene, physics=Physics()), frame)
    with pytest.raises(FieldError, match=r"'remus', where sound meets it, is .* m above the surface at frame 0"):
        check_frame(scene, frame)
