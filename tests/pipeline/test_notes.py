"""What `plan` says of targets before anything is computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.planning.notes import target_notes


def warnings(distance: float, law: ss.Kirchhoff | ss.MirrorLobe) -> str:
    ball = ss.Target(
        name="ball",
        shape=ss.Sphere(radius=0.3, edge=0.1),
        motion=ss.Still(position=(distance, 0.0, -5.0)),
        scattering=law,
    )
    world = ss.World(
        environment=ss.Environment(depth=20.0, sound_speed=ss.Isovelocity(speed=1540.0)),
        targets=(ball,),
        sources=(ss.SnappingShrimp(name="rock", position=(3.0, 6.0)),),
    )
    quick = ss.Accuracy(signal=0.02)
    return "\n".join(ss.plan(ss.Recipe(scene=ss.Scene(world=world), accuracy=quick)).warnings)


@pytest.mark.parametrize(("heading", "noted"), [(0.0, True), (90.0, False)])
def test_a_sonar_that_looks_past_its_targets_is_told(small: ss.Recipe, heading: float, noted: bool) -> None:
    """Left out, a heading is north; the target of this recipe is in the east."""
    sonar = replace(small.scene.trajectory.sonar, heading=np.deg2rad(heading))
    trajectory = replace(small.scene.trajectory, sonar=sonar)
    said = ss.plan(replace(small, scene=replace(small.scene, trajectory=trajectory))).warnings
    assert any("the sonar looks to 0 deg (0 is north, 90 east" in line for line in said) == noted


@pytest.mark.long
@pytest.mark.parametrize(("distance", "said"), [(2.0, True), (6.0, False)])
def test_a_coherent_target_close_by_is_noted(distance: float, said: bool) -> None:
    assert ("ball: nearer than 2.5 m" in warnings(distance, ss.Kirchhoff())) == said
    assert "nearer than" not in warnings(distance, ss.MirrorLobe())


@pytest.mark.parametrize(
    ("water", "why"),
    [
        (ss.Isovelocity(speed=1530.0), "for sound travels at 1530 m/s and scene.sonar.assumed_sound_speed is 1540 m/s"),
        (ss.Linear(surface_speed=1530.0, gradient=-1.0), "where rays bend"),
    ],
)
def test_ranges_that_err_are_blamed_on_what_makes_them_err(water: ss.Isovelocity | ss.Linear, why: str) -> None:
    """In water of one speed no ray bends: there it is the speed that the sonar assumes."""
    world = ss.World(
        environment=ss.Environment(depth=20.0, sound_speed=water),
        targets=(
            ss.Target(name="ball", shape=ss.Sphere(radius=0.3, edge=0.1), motion=ss.Still(position=(20.0, 0.0, -5.0))),
        ),
        sources=(ss.SnappingShrimp(name="rock", position=(3.0, 6.0)),),
    )
    scene = ss.Scene(world=world, processing=ss.Processing(placing=ss.IsovelocityPlacing()))
    lines = ss.plan(ss.Recipe(scene=scene)).warnings
    (note,) = [line for line in lines if line.startswith("range errors are")]
    assert any("sound at 1540 m/s, good to 0.1 m/s" in line and "further off than predicted" in line for line in lines)
    assert why in note
    assert ("bend" in note) == (not isinstance(water, ss.Isovelocity))


def test_subarrays_that_a_kink_of_the_sound_speed_asks_for_are_put_down_to_it(small_text: str) -> None:
    """The array is 5 m deep and 15 cm high; of a kink elsewhere nothing is said."""
    bent = "kind: thermocline, mixed_depth: {} m"
    said = {}
    for deep, allowed in ((5.0, 1e-4), (5.05, 1e-4), (8.0, 1e-7)):
        text = small_text.replace("kind: isovelocity, speed: 1540", bent.format(deep))
        made = ss.plan(ss.loads(f"{text}\naccuracy: {{signal: {allowed}}}\n"), ["signals"])
        (said[deep],) = (line for line in made.warnings if "traced by itself" in line)
    for deep in (5.0, 5.05):
        assert said[deep].endswith(
            f", for the sound speed has a kink at {deep:g} m, within the array: move one of the two"
        )
    assert "kink" not in said[8.0]


def test_a_body_that_stands_before_the_snap_is_noted_in_the_frames_that_have_no_clock() -> None:
    """It crosses the line from the snap to the array in the middle frame alone; there nothing is located."""
    world = ss.World(
        environment=ss.Environment(depth=10.0, sound_speed=ss.Isovelocity(speed=1540.0)),
        targets=(
            ss.Target(
                name="ball",
                shape=ss.Sphere(radius=0.8, edge=0.2),
                motion=ss.Line(start=(7.0, -8.5, -7.5), stop=(7.0, 3.5, -7.5), duration=6.0),
            ),
        ),
        sources=(ss.SnappingShrimp(position=(14.0, -5.0)),),
    )
    sonar = ss.Sonar(array=ss.PlanarLattice(columns=6, rows=6, pitch=0.1))
    recipe = ss.Recipe(scene=ss.Scene(world=world, sonar=sonar, trajectory=ss.Trajectory(frames=3, interval=3.0)))
    (line,) = (note for note in ss.plan(recipe).warnings if "hides all snaps" in note)
    assert line.startswith("ball: ") and "in 1 of 3 frames examined (first: frame 1)" in line
    located = [np.isfinite(ss.render(recipe, frame)["source_estimates/time"].values[0]) for frame in range(3)]
    assert located == [True, False, True]


@pytest.mark.parametrize(
    ("shape", "law", "why"),
    [
        (ss.Cylinder(radius=0.01, length=1.0), ss.MirrorLobe(), "for `shape.edge` is left out"),
        (ss.Cylinder(radius=0.1, length=1.0, edge=5e-3), ss.MirrorLobe(), "as `shape.edge` says"),
        (ss.Sphere(radius=0.3, edge=0.1), ss.Kirchhoff(), "for the wavelength, by scene.sonar.band.high"),
        (ss.Sphere(radius=0.3, edge=0.1), ss.MirrorLobe(), ""),
    ],
)
def test_what_very_many_facets_cost_is_said_with_the_field_that_makes_them(
    shape: ss.Cylinder | ss.Sphere, law: ss.Kirchhoff | ss.MirrorLobe, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(target_notes, "MANY_FACETS", 20_000)
    body = ss.Target(name="needle", shape=shape, motion=ss.Still(position=(12.0, 0.0, -5.0)), scattering=law)
    world = ss.World(
        environment=ss.Environment(depth=20.0, sound_speed=ss.Isovelocity(speed=1540.0)),
        targets=(body,),
        sources=(ss.SnappingShrimp(name="rock", position=(3.0, 6.0)),),
    )
    plan = ss.plan(ss.Recipe(scene=ss.Scene(world=world)), [])
    said = [line for line in plan.warnings if "facets up to" in line]
    assert len(said) == bool(why)
    for line in said:
        assert line.startswith(f"needle: {len(plan.scene.meshes[0].faces)} facets up to ") and why in line
        assert " s of one core and " in line and line.endswith(" of memory")


@pytest.mark.parametrize(
    ("water", "tracing", "why"),
    [
        (ss.Isovelocity(speed=1540.0), ss.AutoTracing(), "the sound speed is uniform"),
        (ss.Isovelocity(speed=1540.0), ss.Refracted(), "requested"),
        (ss.Linear(surface_speed=1540.0, gradient=1.0), ss.AutoTracing(), "the sound speed varies"),
        (ss.Linear(surface_speed=1540.0, gradient=1.0), ss.Straight(), "requested"),
    ],
)
def test_the_reason_why_rays_are_traced_so_is_the_true_one(
    small: ss.Recipe, water: ss.Isovelocity | ss.Linear, tracing: ss.AutoTracing | ss.Refracted | ss.Straight, why: str
) -> None:
    """Straight rays that a recipe asks for in bending water were said to err by little enough."""
    world = replace(small.scene.world, environment=replace(small.scene.world.environment, sound_speed=water))
    scene = replace(small.scene, world=world, physics=replace(small.scene.physics, tracing=tracing))
    (trace,) = (stage for stage in ss.plan(replace(small, scene=scene), ["paths"]).stages if stage.stage == "trace")
    assert trace.why == why
