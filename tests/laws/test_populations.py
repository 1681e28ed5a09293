"""Populations: bodies lie where region, water and the others let them, and each draw depends on its own key."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare, kstest

from sonarsynth.conventions import azimuth_elevation
from sonarsynth.description import FieldError
from sonarsynth.environment.sea import Environment, Isovelocity
from sonarsynth.geometry.hovering import Hover
from sonarsynth.geometry.motion import Still, pose, spin, velocity
from sonarsynth.pipeline import render
from sonarsynth.planning.notes.population_notes import population_notes
from sonarsynth.receiver import BeamGrid, PlanarLattice, Sonar
from sonarsynth.recipe import Axis, Choice, Recipe, Splits, reading
from sonarsynth.recipe.populations.drawn_tracks import AnyOrientation, Hovering, StraightAhead, Upright, Wandering
from sonarsynth.recipe.populations.population import BodyModel, Population
from sonarsynth.recipe.populations.regions import Annulus, BoxRegion, FieldOfView, PolygonRegion
from sonarsynth.recipe.scene import Scene, Trajectory, World
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target

DEPTH = 20.0
BALL = BodyModel(category="ball", shape=Sphere(radius=0.3, edge=0.15), scale=(0.5, 2.0))
CRATE = BodyModel(category="crate", shape=Box(size=(0.9, 0.5, 0.4)), weight=3.0)
ANYWHERE = BoxRegion(low=(5.0, -8.0, -19.0), high=(25.0, 8.0, -1.0))
L_SHAPE = PolygonRegion(
    corners=((5.0, -8.0), (25.0, -8.0), (25.0, 0.0), (15.0, 0.0), (15.0, 8.0), (5.0, 8.0)), heights=(-18.0, -2.0)
)


def some(name: str = "body", **more: Any) -> Population:
    return Population(**({"name": name, "models": (BALL, CRATE), "most": 5, "region": ANYWHERE, "apart": 0.2} | more))


def recipe(*populations: Population, repeats: int = 200, targets: tuple[Target, ...] = (), **more: Any) -> Recipe:
    world = World(
        environment=Environment(depth=DEPTH, sound_speed=Isovelocity(speed=1500.0)),
        targets=targets,
        populations=populations,
        sources=(SnappingShrimp(position=(14.0, -4.0)),),
    )
    sonar = Sonar(array=PlanarLattice(columns=5, rows=4, pitch=0.03), beams=BeamGrid(azimuths=25, elevations=25))
    track = Still(position=(0.0, 0.0, -8.0), heading=0.5 * np.pi)
    scene = Scene(world=world, sonar=sonar, trajectory=Trajectory(frames=4, interval=1.0, sonar=track))
    return Recipe(**({"seed": 8, "scene": scene, "repeats": repeats} | more))


def drawn(of: Recipe, name: str = "body") -> list[list[Target]]:
    return [[t for t in of.scene_of(n).world.targets if t.name.startswith(f"{name}_")] for n in range(of.sequences)]


def test_numbers_models_scales_and_headings_are_drawn_as_they_say() -> None:
    bodies = drawn(recipe(some(least=1, most=3, weights=(1.0, 2.0, 1.0), apart=0.0), repeats=400))
    numbers = Counter(map(len, bodies))
    assert chisquare([numbers[n] for n in (1, 2, 3)], [100, 200, 100]).pvalue > 1e-3
    every = [target for of in bodies for target in of]
    kinds = Counter(target.category for target in every)
    assert chisquare([kinds["ball"], kinds["crate"]], np.array([0.25, 0.75]) * len(every)).pvalue > 1e-3
    scale = np.log([target.scale for target in every if target.category == "ball"]) / np.log(2.0)
    assert kstest(scale, "uniform", (-1.0, 2.0)).pvalue > 1e-3
    assert {target.scale for target in every if target.category == "crate"} == {1.0}
    headings = [target.motion.heading for target in every if isinstance(target.motion, Still)]
    assert kstest(np.array(headings) / (2 * np.pi), "uniform").pvalue > 1e-3


@pytest.mark.parametrize("varied", [(), (Choice(path="trajectory.interval", values=(1, 2)),)], ids=["alone", "choice"])
def test_sequences_of_drawn_bodies_are_split_in_the_shares(varied: tuple[Choice, ...]) -> None:
    made = recipe(some(), repeats=50, variations=varied, splits=Splits(train=0.8, validation=0.1, test=0.1))
    assert np.bincount(made.spanned.split, minlength=3).tolist() == [40, 5, 5]


@pytest.mark.parametrize(
    "region",
    [ANYWHERE, Annulus(centre=(15.0, 1.0), inner=3.0, outer=9.0, heights=(-18.0, -2.0)), L_SHAPE],
    ids=["box", "annulus", "polygon"],
)
def test_places_fill_a_region_evenly(region: Any) -> None:
    """Against points thrown on a larger box, of which those in the region are kept: halves of it are met alike."""
    bodies = drawn(recipe(some(region=region, least=1, most=1, models=(BodyModel(shape=Sphere(radius=0.01)),))))
    at = np.array([pose(of[0].motion, 1.5).position for of in bodies])
    thrown = np.random.default_rng(3).uniform((0.0, -12.0, -19.0), (30.0, 12.0, -1.0), (40_000, 3))
    x, y, z = thrown.T
    if isinstance(region, Annulus):
        away = np.hypot(x - 15.0, y - 1.0)
        thrown = thrown[(away > 3.0) & (away < 9.0) & (z > -18.0) & (z < -2.0)]
    elif isinstance(region, PolygonRegion):
        inside = (x > 5) & (x < 25) & (y > -8) & (y < 8) & ~((x > 15) & (y > 0)) & (z > -18) & (z < -2)
        thrown = thrown[inside]
    else:
        thrown = thrown[(x > 5) & (x < 25) & (np.abs(y) < 8)]
    for axis in range(3):
        assert at[:, axis].min() >= thrown[:, axis].min() - 0.1 and at[:, axis].max() <= thrown[:, axis].max() + 0.1
        assert kstest(at[:, axis], thrown[:, axis]).pvalue > 1e-3


def test_sobol_places_are_one_in_each_part_of_the_region_and_what_comes_after_changes_none() -> None:
    """Of 64 repeats, in each of x, y, z and the number of bodies; and a second population has others."""
    tank = BoxRegion(low=(5.0, -8.0, -15.0), high=(25.0, 8.0, -5.0))  # a body anywhere in it is clear of all else
    ball = BodyModel(shape=Sphere(radius=0.01, edge=0.01))
    even = some(models=(ball,), least=1, most=4, region=tank, apart=0.0, sobol=True)
    alone, both = drawn(recipe(even, repeats=64)), recipe(even, replace(even, name="more"), repeats=64)
    assert np.bincount([len(bodies) for bodies in alone]).tolist() == [0, 16, 16, 16, 16]
    place = np.array([bodies[0].motion.position for bodies in alone])
    part = (place - np.array(tank.low)) / (np.array(tank.high) - np.array(tank.low))
    assert all(sorted(np.floor(64 * column)) == list(range(64)) for column in part.T)
    assert drawn(both) == alone
    other = np.array([bodies[0].motion.position for bodies in drawn(both, "more")])
    assert abs(np.corrcoef(place.T, other.T)[:3, 3:]).max() < 0.3


def test_a_field_of_view_is_the_sonars() -> None:
    made = recipe(some(region=FieldOfView(near=4.0, far=12.0), least=1, most=1, models=(BALL,)))
    view, beams = pose(made.scene.trajectory.sonar, 1.5), made.scene.sonar.beams
    own = view.to_body(np.array([pose(of[0].motion, 1.5).position for of in drawn(made)]))
    azimuth, elevation = azimuth_elevation(own)
    assert np.abs(azimuth).max() <= 0.5 * beams.azimuth_span and np.abs(elevation).max() <= 0.5 * beams.elevation_span
    assert kstest((np.linalg.norm(own, axis=1) - 4.0) / 8.0, "uniform").pvalue > 1e-3
    assert kstest(azimuth / beams.azimuth_span + 0.5, "uniform").pvalue > 1e-3


TRACKS = {
    "straight": StraightAhead(speed=(0.5, 2.0), climb=(-0.1, 0.1)),
    "hovering": Hovering(heave=(0.1, 0.5), surge=(0.0, 1.0), yaw=(0.0, 0.3)),
    "wandering": Wandering(speed=(0.2, 1.0), leg=0.7, turn=1.0),
}


@pytest.mark.parametrize("track", TRACKS.values(), ids=TRACKS)
def test_bodies_are_in_the_water_and_apart_in_every_frame(track: Any) -> None:
    """By all vertices of their meshes, which nothing but the tests looks at in all frames."""
    quay = Target(name="quay", shape=Box(size=(1.0, 6.0, 18.0)), motion=Still(position=(15.0, 0.0, -10.0), heading=1.0))
    made = recipe(some(track=track, least=4, most=5), targets=(quay,), repeats=12)
    for sequence in range(12):
        scene = made.scene_of(sequence)
        for step in range(4):
            bodies = made.frame(4 * sequence + step)[1].moment.bodies
            assert bodies[0].name == "quay" and len(bodies) >= 5
            points = [body.pose.to_world(body.mesh.vertices) for body in bodies]
            assert all((p[:, 2] > -DEPTH).all() and (p[:, 2] < 0.0).all() for p in points)
            for one, other in combinations(points[1:], 2):
                assert np.linalg.norm(one[:, None] - other[None], axis=2).min() > 0.2
            low, high = bodies[0].mesh.box
            for p in points[1:]:
                own = bodies[0].pose.to_body(p)
                assert not ((own > low) & (own < high)).all(axis=1).any()
        assert scene.world.populations == ()


def test_what_lies_on_the_bottom_touches_it_however_it_lies() -> None:
    made = recipe(some(on_bottom=True, orientation=AnyOrientation(), least=2, most=2), repeats=20)
    for n in range(20):
        for body in made.frame(4 * n)[1].moment.bodies:
            assert body.pose.to_world(body.mesh.vertices)[:, 2].min() == pytest.approx(-DEPTH + 1e-3, abs=1e-9)


def test_any_orientation_is_even_over_rotations() -> None:
    """The body's axes then point evenly over the sphere: each coordinate is even from -1 to 1 (Archimedes)."""
    models = (BodyModel(shape=Sphere(radius=0.01)),)
    bodies = drawn(recipe(some(orientation=AnyOrientation(), models=models, least=1, most=1), repeats=300))
    axes = np.array([pose(of[0].motion, 0.0).rotation for of in bodies])
    for axis in (0, 1, 2):
        for coordinate in (0, 1, 2):
            assert kstest(0.5 * (1.0 + axes[:, coordinate, axis]), "uniform").pvalue > 1e-3


def test_nothing_that_comes_after_changes_a_body() -> None:
    first = some()
    alone = [[(t.name, t.motion, t.scale) for t in of] for of in drawn(recipe(first, repeats=30))]
    rock = some("rock", on_bottom=True, clutter=True)
    more = drawn(recipe(first, rock, repeats=40, title="other"))
    assert [[(t.name, t.motion, t.scale) for t in of] for of in more[:30]] == alone
    backwards = recipe(first, repeats=30)
    assert [backwards.scene_of(n).world.targets for n in reversed(range(30))][::-1] == [
        tuple(of) for of in drawn(recipe(first, repeats=30))
    ]
    other = drawn(replace(recipe(first, repeats=30), seed=9))
    assert [[(t.name, t.motion, t.scale) for t in of] for of in other] != alone


def test_bodies_of_a_population_share_meshes_of_which_they_are_copies_to_scale() -> None:
    made = recipe(some(), repeats=20)
    assert list(made.meshes) == ["body"] and len(made.meshes["body"]) == 2
    assert made.categories == ("ball", "crate")
    for n in range(20):
        scene = made.scene_of(n)
        for i, target in enumerate(scene.world.targets):
            base = made.meshes["body"][made.mesh_number(scene, i)]
            np.testing.assert_allclose(scene.mesh_of(i).vertices, target.scale * base.vertices, rtol=1e-15)


def test_a_frame_has_its_bodies_in_their_slots_and_the_others_missing() -> None:
    """A sequence with fewer bodies, and one with none; beams and points name slots."""
    # in front of the sonar, so that beams meet it
    place = BoxRegion(low=(8.0, -2.0, -10.0), high=(12.0, 2.0, -7.0))
    made = recipe(some(most=3, region=place), some("rock", most=2, region=place), repeats=20)
    counts = [(len(drawn(made)[n]), len(drawn(made, "rock")[n])) for n in range(20)]
    empty, partly = (next(n for n, (b, r) in enumerate(counts) if wanted(b, r)) for wanted in (
        lambda b, r: b + r == 0, lambda b, r: b == 1 and r > 0
    ))  # fmt: skip
    for n in (empty, partly):
        tree = render(made, 4 * n)
        truth, here = tree["truth/targets"].dataset, made.scene_of(n).world.targets
        assert truth["target"].values.tolist() == ["body_1", "body_2", "body_3", "rock_1", "rock_2"]
        names = {target.name for target in here}
        present = truth["present"].values.astype(bool)
        assert [str(name) in names for name in truth["target"].values] == present.tolist()
        assert (np.isfinite(truth["position"].values).all(axis=1) == present).all()
        assert (truth["category"].values[~present] == -1).all() and np.isnan(truth["echo_level"].values[~present]).all()
        assert set(np.unique(tree["truth/beams/target"])) <= {-1, *np.flatnonzero(present).tolist()}
        assert set(np.unique(tree["cloud/target"])) <= {-1, *np.flatnonzero(present).tolist()}
        for target in here:
            mine = truth.sel(target=target.name)
            np.testing.assert_allclose(mine["position"], pose(target.motion, 0.0).position, rtol=1e-14)
            assert made.categories[int(mine["category"])] == target.category and float(mine["scale"]) == target.scale
        budget = tree["link_budget/paths"].values[0]
        assert budget.shape[0] == 6 and (budget[-1] > 0).any() == bool(np.isfinite(tree["truth/emissions/arrival"][0]))
    assert np.unique(render(made, 4 * partly)["truth/beams/target"]).max() >= 3  # the second body is a rock


def test_a_region_that_is_too_small_names_the_population_and_the_sequence() -> None:
    crowd = some(least=5, region=BoxRegion(low=(10.0, 0.0, -9.0), high=(11.0, 1.0, -8.0)), models=(CRATE,), apart=1.0)
    with pytest.raises(FieldError, match=r"no room for body \d of 5 in 1000 tries") as raised:
        population_notes(recipe(crowd, repeats=3))
    assert raised.value.path[:4] == ("scene", "world", "populations", 0)


def test_a_model_that_has_no_mesh_is_named() -> None:
    """It ended with a traceback where a sequence was drawn before the models were looked at."""
    fine = BodyModel(shape=Sphere(radius=400.0, edge=0.01), weight=1e6)
    with pytest.raises(FieldError, match="use a longer edge") as raised:
        recipe(some(least=1, models=(CRATE, fine))).scene_of(0)
    assert raised.value.path == ("scene", "world", "populations", 0, "models", 1, "shape")


def test_a_plan_says_how_many_bodies_there_are_and_how_many_places_were_refused() -> None:
    """Half of the box is in the air."""
    half = some(least=2, most=2, region=BoxRegion(low=(5.0, -8.0, -15.0), high=(25.0, 8.0, 15.0)), apart=0.0)
    (note,) = population_notes(recipe(half, repeats=300))
    assert note.startswith("populations: 2 to 2 bodies in 300 sequences drawn, 2 on average, none in 0; ")
    share = float(note.split("; ")[1].split(" %")[0])
    assert 48.0 < share < 62.0


def test_a_population_is_varied_like_all_else_but_for_its_room() -> None:
    grid = (Axis(path="populations.body.least", values=(0, 3), name="least"),)
    made = recipe(some(most=3), grid=grid, repeats=30)
    numbers = [len(of) for of in drawn(made)]
    assert min(numbers[30:]) == 3 and min(numbers[:30]) == 0
    for path in ("populations.body.most", "populations.body.models.0.scale", "populations.0"):
        with pytest.raises(ValueError, match="cannot vary: the store has room"):
            Axis(path=path, values=(1, 2))


def test_names_must_differ_and_ranges_ascend() -> None:
    with pytest.raises(ValueError, match="'body_2' of population 'body' is the name of 'body_2' too"):
        recipe(some(), targets=(Target(name="body_2", shape=Sphere(radius=0.1), motion=Still(position=(9, 0, -5))),))
    with pytest.raises(ValueError, match="has 2 weights for 6 numbers, 0 to 5"):
        some(weights=(1.0, 2.0))
    with pytest.raises(ValueError, match="must be the least and the largest"):
        StraightAhead(speed=(2.0, 1.0))
    with pytest.raises(ValueError, match="corners enclose no area"):
        PolygonRegion(corners=((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)), heights=(-2.0, -1.0))


def test_a_recipe_with_populations_survives_yaml() -> None:
    made = recipe(some(track=TRACKS["wandering"]), some("rock", orientation=Upright(pitch=(0.1, 0.2))))
    again = reading.loads(reading.dump(made), resolved=True)
    assert again == made and again.digest == made.digest


def test_a_hovering_body_moves_as_its_velocity_and_spin_say() -> None:
    motion = Hover(position=(9.0, 1.0, -5.0), heading=0.7, surge=0.5, sway=0.2, heave=0.3, yaw=0.4, period=4.0)
    for time in np.linspace(0.0, 4.0, 9):
        step = 1e-5
        ahead, behind = pose(motion, time + step), pose(motion, time - step)
        np.testing.assert_allclose((ahead.position - behind.position) / (2 * step), velocity(motion, time), atol=1e-8)
        turning = (ahead.rotation - behind.rotation) / (2 * step)
        w = spin(motion, time)
        cross = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        np.testing.assert_allclose(turning, cross @ pose(motion, time).rotation, atol=1e-8)
    np.testing.assert_allclose(pose(motion, 0.0).position, pose(motion, 4.0).position, atol=1e-12)
