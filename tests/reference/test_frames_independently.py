"""Whole frames against a computation that shares nothing with the fast one: every path to every hydrophone from the
description alone, in float64 (`validation.references.frames.frame_pressure`)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sonarsynth.environment.sea import Environment, Isovelocity, Linear, Profile
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.frontiers.exact_frame import each_hydrophone, exact_plan
from sonarsynth.geometry.hovering import Hover
from sonarsynth.geometry.motion import Circle, ConstantVelocity, Motion, Still
from sonarsynth.pipeline.synthesis import frame_signals
from sonarsynth.planning import Choices, Plan, arrivals_of, frame_start, plan
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import Band, PlanarLattice, Sonar
from sonarsynth.recipe import Accuracy, Recipe, reading
from sonarsynth.recipe.scene import Physics, Scene, Trajectory, World
from sonarsynth.scattering import Isotropic
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.sources.transmitter import Sweep, TransmitBeam, Transmitter
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target
from sonarsynth.validation.rays.ray_matching import Rays, rays_of
from sonarsynth.validation.references.frames.frame_pressure import FramePressure
from sonarsynth.validation.references.frames.line_of_sight import Surface
from sonarsynth.validation.references.frames.path_sum import Contributions, transfer
from sonarsynth.validation.references.frames.sound_paths import hidden
from sonarsynth.validation.references.rays.exact_rays import exact_rays
from sonarsynth.validation.references.rays.layered_rays import families, rays
from sonarsynth.validation.references.rays.layers_crossed import Water

ALLOWED = 1e-3  # of the largest pressure


def away(made: Plan, sensors: list[int]) -> tuple[float, float]:
    """How far echoes, and what comes without a target, are from the independent computation, over its peak."""
    frame = made.recipe.frame(0)[1]
    start, samples = frame_start(made, frame), made.windows.samples
    arrivals = arrivals_of(made, frame)
    exact = FramePressure(made.scene, frame, made.profile).pressure(sensors, start, samples)
    found = []
    for some, right in zip((~arrivals.direct, arrivals.direct), exact, strict=True):
        heard = frame_signals(made, frame, arrivals.select(some)).pressure[sensors]
        assert np.abs(right).max() > 0.0
        found.append(float(np.abs(heard - right).max() / np.abs(right).max()))
    return found[0], found[1]


@pytest.mark.parametrize(
    ("name", "sensors", "choices"),
    [
        ("remus", [140, 504], None),
        ("tank", [0, 90], None),
        ("crowd", [5, 300], None),
        ("deep", [17, 200], None),
        ("thermocline", [140], Choices(occlusion="sensors")),  # what its plan chooses, in 14 s
    ],
)
def test_a_frame_of_a_shipped_recipe_is_what_its_description_says(
    name: str, sensors: list[int], choices: Choices | None
) -> None:
    recipe = reading.load(Path(__file__).parents[2] / "configs" / f"{name}.yaml")
    way = recipe.scene.trajectory
    scene = replace(recipe.scene, trajectory=replace(way, frames=1, start=way.time(way.frames // 3)))
    recipe = replace(recipe, scene=scene, accuracy=replace(recipe.accuracy, signal=min(recipe.accuracy.signal, 1e-3)))
    made = plan(recipe, ("signals",), choices)
    assert made.choices.subarrays == 1  # else `frame_signals` traces again
    assert max(away(made, sensors)) < ALLOWED


def crossing(
    target: Motion, sonar: Motion, edge: float = 0.15, bounces: int = 0, times: tuple[float, ...] = (-0.1, 0.0, 0.1)
) -> Plan:
    """A crate before a small array, with snaps 100 ms before the instant, at it and 100 ms after it."""
    made = Scene(
        world=World(
            environment=Environment(depth=60.0, sound_speed=Isovelocity(speed=1500.0)),
            targets=(Target(name="crate", shape=Box(size=(1.2, 0.7, 0.6), edge=edge), motion=target),),
            sources=(SnappingShrimp(position=(12.0, -7.0, -33.0), snap_times=times),),
        ),
        sonar=Sonar(array=PlanarLattice(columns=8, rows=6, pitch=0.05), assumed_sound_speed=1500.0),
        trajectory=Trajectory(start=1.0, sonar=sonar),
        physics=Physics(tracing=AutoTracing(bounces=bounces)),
    )
    return plan(Recipe(title="crossing", scene=made, accuracy=Accuracy(signal=1e-3)), ("signals",), Choices())


STATION = Still(position=(0.0, 0.0, -30.0), heading=0.5 * np.pi)


def test_it_says_where_there_are_rays_that_it_does_not_know() -> None:
    """In a channel with its axis at the crate: rays turn again and again on the way to one far off, not to one near."""
    channel = Profile(depth=np.array([0.0, 30.0, 60.0]), speed=np.array([1500.0, 1480.0, 1500.0]))
    for far, refused in ((22.0, False), (3000.0, True)):
        made = crossing(Still(position=(far, 3.0, -29.0)), STATION)
        frame = made.recipe.frame(0)[1]
        assert bool(FramePressure(made.scene, frame, channel).unknown) == refused
        assert not FramePressure(made.scene, frame, made.profile).unknown  # the water of one speed


def test_what_moves_in_water_that_a_formula_describes_is_heard() -> None:
    """Which ends at the bottom: a gradient of -1 leads on to 100 m/s, where 4 m/s was refused as too fast, and records
    were as long as sound takes there. No longer than those in water that is faster below."""
    ours, start = Still(position=(0.0, 0.0, -30.0), heading=0.5 * np.pi), (22.0, 1.0, -29.0)
    plans = []
    for slope in (-0.1, 0.1):
        scene = crossing(ConstantVelocity(start=start, heading=3.5, speed=8.0), ours, times=(0.0,)).recipe.scene
        water = replace(scene.world.environment, sound_speed=Linear(surface_speed=1500.0, gradient=slope))
        scene = replace(scene, world=replace(scene.world, environment=water))
        plans.append(plan(Recipe(title="linear", scene=scene, accuracy=Accuracy(signal=1e-3)), ("signals",), Choices()))
        assert max(away(plans[-1], [0, 47])) < ALLOWED
    assert abs(plans[0].windows.samples - plans[1].windows.samples) < 0.02 * plans[1].windows.samples


def pinged(crate: Motion) -> Recipe:
    """A crate before a sonar that moves and pings."""
    ours = ConstantVelocity(start=(0.0, 0.0, -30.0), heading=np.deg2rad(80), speed=4.0)
    scene = crossing(crate, ours, 0.35, 1).recipe.scene
    beam = TransmitBeam(azimuth_width=np.deg2rad(50), elevation_width=np.deg2rad(80), azimuth=0.2)
    pulse = Sweep(start=40e3, stop=70e3, duration=0.4e-3)
    ping = Transmitter(position=(0.1, 0.2, -0.3), pulse=pulse, source_level=200.0, beam=beam)
    scene = replace(scene, world=replace(scene.world, sources=(ping,)))
    return Recipe(title="ping", scene=scene, accuracy=Accuracy(signal=1e-3))


def test_a_ping_is_heard_as_it_is_sent_on_the_way() -> None:
    """By a sonar that moves: in each direction as its beam and its speed make it, by surface and bottom too."""
    made = plan(pinged(Still(position=(22.0, 1.0, -29.0), heading=0.4)), ("signals",), Choices(subarrays=1))
    assert away(made, [0, 47])[0] < ALLOWED


def test_a_ping_meets_what_moves_as_it_is_sent_and_reflected_towards_there() -> None:
    """A crate that is 0.3 m on when reflections of the ping meet it, heard by each hydrophone by itself: the beam, and
    the bottom, made echoes by them as for where it is met first (2e-4 off; 3e-3 in random scenes)."""
    made = plan(pinged(ConstantVelocity(start=(22.0, -11.0, -29.0), speed=12.0)), ("signals",), Choices())
    frame, sensors = made.recipe.frame(0)[1], np.array([0, 47])
    heard = each_hydrophone(exact_plan(made), frame, sensors=sensors).pressures[0]
    start, samples = frame_start(made, frame), made.windows.samples
    right = FramePressure(made.scene, frame, made.profile).pressure([0, 47], start, samples)[0]
    np.testing.assert_allclose(heard, right, rtol=0.0, atol=2e-5 * np.abs(right).max())


@pytest.mark.parametrize("sonar", [0.0, 5.0])
@pytest.mark.parametrize("speed", [0.0, 1.4, 30.0])
def test_what_moves_is_heard_where_the_sound_met_it(speed: float, sonar: float) -> None:
    """At any speed, before the instant of the frame and after it, by a sonar that moves too."""
    heading, drift = np.deg2rad(200.0), np.deg2rad(60.0)
    start = np.array([22.0, 1.0, -29.0]) - speed * np.array([np.sin(heading), np.cos(heading), 0.05])
    body = ConstantVelocity(start=tuple(start), heading=heading, speed=speed, climb=0.05 * speed)
    ours = ConstantVelocity(start=(0.0, 0.0, -30.0), heading=drift, speed=sonar)
    made = crossing(body, ours)
    assert max(away(made, [0, 47])) < ALLOWED


@pytest.mark.parametrize(("bounces", "times"), [(0, (-0.1, 0.0, 0.1)), (3, (0.0,))])
def test_what_turns_is_heard_as_it_stood_when_the_sound_met_it(bounces: int, times: tuple[float, ...]) -> None:
    """A crate on a circle at 20 degrees a second, which has turned on by 3 degrees when sound comes to it by surface
    and bottom."""
    circle = Circle(centre=(22.0, 3.0, -29.0), radius=4.0, speed=1.4, bearing=0.3)
    assert away(crossing(circle, STATION, 0.35, bounces, times), [29])[0] < ALLOWED


@pytest.mark.parametrize(
    "sonar",
    [
        Circle(centre=(0.0, 2.0, -30.0), radius=2.0, speed=-3.1, bearing=np.pi - 1.55),  # at 90 degrees a second
        Hover(position=(0.0, 0.0, -30.0), heading=0.5 * np.pi, heave=0.5, yaw=0.35, period=3.0, phase=1.0),
    ],
)
def test_a_sonar_that_turns_hears_as_it_stands_when_the_sound_meets_it(sonar: Motion) -> None:
    """Echoes, and the snap itself, by surface and bottom, after 40 ms in which it turns on and its speed changes."""
    crate = Still(position=(22.0, 1.0, -29.0), heading=0.4)
    assert max(away(crossing(crate, sonar, 0.35, 2, (0.0,)), [0])) < ALLOWED


def test_each_family_finds_lit_and_hidden_what_is_when_it_comes() -> None:
    """A ball at 30 m/s before a crate in 4 m of water: by the bottom sound meets it 2 cm farther on. Lit and hidden as
    where direct sound meets it, echoes by surface and bottom would err by 1.3e-3."""
    still = Still(position=(8.0, 1.0, -2.1), heading=0.4)
    passing = ConstantVelocity(start=(7.3, 0.7 - 30.0, -2.0), heading=0.0, speed=30.0)
    crate = Target(name="crate", shape=Box(size=(0.5, 0.4, 0.4), edge=0.06), motion=still)
    ball = Target(name="ball", shape=Sphere(radius=0.15, edge=0.06), motion=passing)
    scene = crossing(still, replace(STATION, position=(0.0, 0.0, -2.0)), bounces=1, times=(0.0,)).recipe.scene
    water = replace(scene.world.environment, depth=4.0)
    source = SnappingShrimp(position=(5.0, -2.0, -3.0), snap_times=(0.0,))
    scene = replace(scene, world=World(environment=water, targets=(crate, ball), sources=(source,)))
    choices = Choices(subarrays=1, occlusion="sensors")
    made = plan(Recipe(title="passing", scene=scene, accuracy=Accuracy(signal=1e-3)), ("signals",), choices)
    assert away(made, [0, 29, 47])[0] < 0.5 * ALLOWED


def test_a_corner_of_the_array_that_sees_other_limbs_is_asked() -> None:
    """A quarter of the hydrophones has facets of a coarse ball behind its limb that the middle of the array sees, and
    none of the few that errors over the array are measured at: they hear echoes as the default accuracy allows, where
    the view of the middle would err by 0.18."""
    still, ahead = Still(position=(22.0, 1.0, -29.0)), Still(position=(0.0, 0.0, -30.0), heading=0.5 * np.pi)
    scene = crossing(still, ahead, times=(0.0,)).recipe.scene
    ball = Target(name="ball", shape=Sphere(radius=0.5, edge=0.2), motion=still)
    physics = replace(scene.physics, scattering=Isotropic(strength=1e-3))
    made = replace(scene, world=replace(scene.world, targets=(ball,)), physics=physics)
    planned = plan(Recipe(title="ball", scene=made), ("signals",))
    assert away(planned, [0, 9, 40])[0] < planned.recipe.accuracy.signal


def test_faces_that_a_wave_takes_long_to_cross_hear_the_whole_pulse() -> None:
    """Faces of 1 m, hit from the side: a pulse is longer by what a wave takes to cross one, here by 0.5 ms."""
    made = crossing(Still(position=(22.0, 1.0, -29.0)), Still(position=(0.0, 0.0, -30.0), heading=0.5 * np.pi))
    sonar = replace(made.scene.sonar, array=PlanarLattice(columns=4, rows=3, pitch=1.0), band=Band(low=2e3, high=6e3))
    recipe = replace(made.recipe, scene=replace(made.scene, sonar=sonar))
    assert max(away(plan(recipe, ("signals",), Choices(subarrays=1, occlusion="sensors")), [0, 11])) < ALLOWED


@pytest.mark.parametrize("slope", [-6.0, -0.016, 0.016, 5.0])
def test_rays_by_images_are_those_of_many_digits_where_the_speed_is_linear(slope: float) -> None:
    """Times, amplitudes and directions, turning rays among them."""
    generator, bottom = np.random.default_rng(3), 10.0
    first, last, far = generator.uniform(0.0, bottom, (2, 24)).tolist() + [generator.uniform(15.0, 30.0, 24)]
    first, last = np.array(first), np.array(last)
    depth, speed = np.array([0.0, bottom]), np.array([1500.0, 1500.0 + slope * bottom])
    layers = ray_solutions.water(depth, speed, bottom)
    near = ray_solutions.eigenrays(layers, first, last, far, 1, 1)
    other = exact_rays(layers, rays_of(near), near.slowness, first, last, far)
    start, end = np.column_stack([0.0 * far, 0.0 * far, -first]), np.column_stack([far, 0.0 * far, -last])
    water = Water(depth, speed, bottom)
    seen = 0
    for family in families(1):
        found = rays(water, start, end, family)
        mine = other.select(_family(other, family.bounces, family.bottom))
        row = mine.pair
        both = np.isfinite(found.time[row])
        seen += int(both.sum())
        row, mine = row[both], mine.select(both)
        np.testing.assert_allclose(found.time[row], mine.travel_time, rtol=1e-13)
        np.testing.assert_allclose(found.spreading[row], mine.amplitude, rtol=1e-9)
        np.testing.assert_allclose(np.arcsin(found.departure[row, 2]), mine.start_angle, atol=1e-11)
        np.testing.assert_allclose(np.arcsin(found.arrival[row, 2]), mine.end_angle, atol=1e-11)
    assert seen > 20


def test_rays_that_are_nearly_vertical_arrive() -> None:
    """Up through layers, as long as the water is deep, and to the second order as much longer as they are slanted: the
    root has few digits there, and was taken for none."""
    water = Water(np.array([0.0, 30.0, 60.0, 100.0]), np.array([1496.0, 1494.0, 1502.0, 1507.0]), 100.0)
    aside = np.geomspace(1e-6, 0.3, 25)
    start, end = np.zeros((2, len(aside), 3))
    start[:, 2], end[:, 2], end[:, 0] = -99.0, -17.0, aside
    levels = np.linspace(17.0, 99.0, 200_001)
    slowness = 1.0 / water.at(levels)
    up = np.trapezoid(slowness, levels)
    for family in families(0):
        found = rays(water, start, end, family)
        slanted = up + 0.5 * aside**2 / np.trapezoid(1.0 / slowness, levels)
        np.testing.assert_allclose(found.time, slanted, rtol=1e-9)
        np.testing.assert_allclose(found.spreading, 1.0 / 82.0, rtol=0.01)


def test_a_ray_that_does_not_arrive_is_hidden() -> None:
    """In water that bends sound up no ray goes far but by the surface."""
    water = Water(np.array([0.0, 5.0]), np.array([1521.0, 1551.0]), 5.0)
    end = np.column_stack([np.linspace(5.0, 200.0, 40), np.zeros(40), np.full(40, -2.5)])
    start = np.broadcast_to([0.0, 0.0, -4.25], end.shape)
    ray = rays(water, start, end, families(1)[0])
    found = hidden([], water, start, end, ray, *np.zeros((2, 40)))
    np.testing.assert_array_equal(found, ~np.isfinite(ray.time))
    assert 0 < found.sum() < 40
    assert hidden([], water, start, end, ray.select(np.flatnonzero(found)[[0] * 40]), *np.zeros((2, 40))).all()


def _family(some: Rays, bounces: int, bottom: int) -> np.ndarray:
    return np.asarray((some.surface + some.bottom == bounces) & (some.bottom == bottom))


def test_a_line_of_sight_is_cut_by_any_triangle_and_by_no_sphere_around_it() -> None:
    generator = np.random.default_rng(5)
    corners = generator.uniform(-1.0, 1.0, (200, 1, 3)) + generator.normal(0.0, 0.1, (200, 3, 3))
    start, end = generator.uniform(-3.0, 3.0, (2, 400, 3))
    across = end - start
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    part = np.einsum("tx,ltx->lt", normal, corners[:, 0] - start[:, None]) / (across @ normal.T)
    point = start[:, None] + part[..., None] * across[:, None]
    inside = (part > 0.0) & (part < 1.0)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        side = np.cross(corners[:, b] - corners[:, a], point - corners[:, a])
        inside &= np.einsum("ltx,tx->lt", side, normal) >= 0.0
    found = Surface.of(corners).between(start, end)
    np.testing.assert_array_equal(found, inside.any(axis=1))
    assert 20 < found.sum() < 380


def test_at_the_lowest_of_frequencies_faces_hear_as_points() -> None:
    count, at = 5, np.random.default_rng(1)
    paths = Contributions(
        time=at.random(count),
        size=at.normal(size=count) + 1j * at.normal(size=count),
        longer=np.zeros(count),
        length=np.zeros((count, 3)),
        delay_std=np.zeros(count),
        face=1e-6 * at.normal(size=(count, 2)),
    )
    found = transfer(paths, np.ones((count, 1)), 0.0, 1.0, 0, np.zeros((2, 3)))[0]
    np.testing.assert_allclose(found, [paths.size.sum(), paths.size @ np.exp(-2j * np.pi * paths.time)], rtol=1e-9)
