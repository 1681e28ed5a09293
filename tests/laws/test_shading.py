"""What a body hides from part of the array, that part does not hear; the rest does."""

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth import planning
from sonarsynth.environment.sea import Profile
from sonarsynth.frontiers import measure
from sonarsynth.geometry.motion import Still
from sonarsynth.pipeline import trace_frame
from sonarsynth.planning import arrivals_of
from sonarsynth.planning.choosing import PerSensorReference
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Refracted, Straight
from sonarsynth.receiver import BeamGrid, PlanarLattice
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.recipe import Recipe
from sonarsynth.signals import GriddedSynthesis
from sonarsynth.signals.array_paths import array_paths
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.targets.target import Target
from tests.hearing import hearing
from tests.laws.test_synthesis import FACES, SNAPS, SONAR, absorption, error, some_of, target_at
from tests.scenes import point_scene, remus


def screened(edge: float) -> Recipe:
    """A small ball 20 m ahead, and half way a screen whose left edge is `edge` m to the right of the line to it."""
    recipe = point_scene((20.0, 0.0, -50.0), (6.0, 9.0, -45.0))
    ball = replace(recipe.scene.world.targets[0], shape=Sphere(radius=0.1, edge=0.03))
    wall = Target(
        name="screen",
        shape=Box(size=(0.02, 2.0, 2.0)),
        motion=Still(position=(10.0, -1.0 - edge, -50.0), heading=0.5 * np.pi),
    )
    world = replace(recipe.scene.world, targets=(ball, wall))
    return replace(recipe, scene=replace(recipe.scene, world=world))


def test_each_hydrophone_hears_what_it_sees() -> None:
    """Behind the edge of a screen: as each hydrophone traced by itself, which the middle's view is far from."""
    made = planning.plan(screened(0.02), {"signals"})
    assert made.choices.occlusion == "sensors"
    measure = PerSensorReference.of(made, 0)
    assert measure.error(1, "centre") > 0.1
    assert measure.error(1, "sensors") < 2e-3


def test_paths_are_hidden_as_each_hydrophone_finds_for_itself() -> None:
    made = planning.plan(screened(0.02), {"signals"})
    made = replace(made, choices=replace(made.choices, occlusion="sensors", negligible=0.0))
    frame = made.recipe.frame(0)[1]
    whole = arrivals_of(made, frame)
    hidden = whole.hidden(made.elements.count)
    assert 0.05 < hidden[whole.target == 0].mean() < 0.95
    key = whole.facet + 10_000 * (whole.target + 1)
    for sensor in range(0, made.elements.count, 61):
        own = arrivals_of(made, frame, subarray(made.elements, np.array([sensor])))
        alone = own.facet + 10_000 * (own.target + 1)
        ball = (whole.target == 0) & ~hidden[:, sensor]
        assert set(key[ball]) == set(alone[own.target == 0])


def test_shadows_that_are_rounded_off_change_no_more_than_is_allowed() -> None:
    made = planning.plan(screened(0.02), {"signals"})
    made = replace(made, choices=replace(made.choices, occlusion="sensors", negligible=0.0))
    front = array_paths(arrivals_of(made, made.recipe.frame(0)[1]), SNAPS, made.elements)
    front = replace(front, delay=np.arange(front.count, dtype=float))  # names them
    sensors = made.elements.count
    rows = front.occluded.any(axis=1)
    energy = front.amplitude**2 * front.expansion.mean_square(made.elements.position)
    partly = [rows.sum()]
    for tolerance in (2e-2, 6e-2, 0.2):
        few = front.without_faint_shadows(tolerance, made.elements)
        hidden = np.ones((front.count, sensors), bool)
        hidden[few.delay.astype(int)] = few.hidden(sensors)
        changed = energy @ (hidden != front.hidden(sensors)).mean(axis=1)
        assert 0.0 < changed <= tolerance**2 * np.minimum(energy, energy[rows].max()).sum()  # not of the direct snap
        partly.append(few.occluded.any(axis=1).sum())
    assert (np.diff(partly) < 0).all()


def test_shadows_of_paths_that_are_loud_at_the_rim_alone_are_kept() -> None:
    """Five of the echoes that half of the array misses at random are faint in its middle, and as loud at its rim."""
    of = partly_hidden(target_at(8.0, 60, 4, refracted=True, direct=False), 30)
    faint, terms = np.arange(60) >= 55, np.zeros((60, 20))
    terms[faint, 7] = 1e4  # of y squared
    of = replace(of, amplitude=np.where(faint, 1e-4, 1.0) * of.amplitude)
    of = replace(of, expansion=replace(of.expansion, amplitude=terms))
    hears = hearing(of, SONAR, FACES, absorption)
    some = np.argsort(-np.linalg.norm(FACES.position, axis=1), kind="stable")[:4]
    exact, _ = DirectSum().pressure(
        of.for_sensors(some, FACES.count), SNAPS, hears._replace(elements=FACES.select(some))
    )
    for method in (GriddedSynthesis(), GriddedSynthesis(tolerance=1e-3)):
        got = method.signals(of, SNAPS, hears).pressure[some]
        assert error(got, exact) < method.tolerance


def test_convex_and_alone_nothing_is_hidden_from_some() -> None:
    made = planning.plan(remus(2), {"signals"})
    frame = made.recipe.frame(0)[1]
    seen = replace(made, choices=replace(made.choices, occlusion="sensors"))
    one, other = arrivals_of(made, frame), arrivals_of(seen, frame)
    hidden = other.hidden(made.elements.count).any(axis=1)
    assert hidden.mean() < 0.1  # facets of the flanks, in the shade of others for some
    np.testing.assert_array_equal(np.sort(one.delay), np.sort(other.seen_from_centre.delay))


def test_truth_and_link_budget_are_of_the_centre() -> None:
    made = planning.plan(screened(0.02), {"signals"})
    made, seen = (replace(made, choices=replace(made.choices, occlusion=v)) for v in ("centre", "sensors"))
    centre, own = trace_frame(made, 0), trace_frame(seen, 0)
    np.testing.assert_array_equal(centre.budget.level, own.budget.level)
    np.testing.assert_array_equal(centre.echoes.level, own.echoes.level)
    assert len(own.arrivals.delay) > len(centre.arrivals.delay)


def test_the_snap_is_not_heard_behind_a_screen() -> None:
    """The direct pulse reaches the hydrophones whose straight line to the snap passes beside the screen."""
    recipe = screened(0.0)
    world = recipe.scene.world
    snap = replace(world.sources[0], position=(30.0, 0.0, -50.0))
    ball = replace(world.targets[0], motion=Still(position=(20.0, 3.0, -50.0), heading=0.0))
    world = replace(world, sources=(snap,), targets=(ball, world.targets[1]))
    made = planning.plan(replace(recipe, scene=replace(recipe.scene, world=world)), {"signals"})
    seen = replace(made, choices=replace(made.choices, occlusion="sensors"))
    frame = made.recipe.frame(0)[1]
    arrivals = arrivals_of(seen, frame)
    hidden = arrivals.select(arrivals.direct).hidden(made.elements.count)[0]
    place = frame.sonar_pose.to_world(made.elements.position)
    at_screen = place[:, 1] * 20.0 / 30.0  # from (30, 0) to (0, y), at x = 10 m: the screen is at y < 0
    clear = np.abs(at_screen) > 0.01
    assert 0.4 < hidden.mean() < 0.6
    np.testing.assert_array_equal(hidden[clear], at_screen[clear] < 0.0)


@pytest.mark.parametrize("bounces", [0, 2])
def test_bent_rays_in_uniform_water_see_what_straight_ones_do(bounces: int) -> None:
    made = planning.plan(screened(0.02), {"signals"})
    made = replace(made, choices=replace(made.choices, occlusion="sensors", negligible=0.0))
    frame = made.recipe.frame(0)[1]
    slope = Profile(made.profile.depth[[0, -1]], made.profile.speed[[0, -1]] + np.array([0.0, 1e-9]))
    found = []
    for rays, water in ((Straight(bounces=bounces), made.profile), (Refracted(bounces=bounces), slope)):
        traced = arrivals_of(replace(made, propagation=rays, profile=water), frame)
        order = np.lexsort((traced.delay.round(9), traced.facet, traced.target))
        found.append(traced.select(order).hidden(made.elements.count))
    assert found[0].shape == found[1].shape
    assert (found[0] != found[1]).mean() < 1e-3


@pytest.mark.parametrize(("hidden", "step"), [(1, 12), (12, 12), (40, 12), (12, 2)])
def test_kernel_deposit_keeps_silent_where_the_exact_sum_does(hidden: int, step: int) -> None:
    """Of many hydrophones, paths that miss some are synthesised one by one, of few together."""
    array = some_of(FACES, step)
    of = partly_hidden(target_at(8.0, 40, 2, refracted=True, direct=True), hidden, array.count)
    hears = hearing(of, SONAR, array, absorption)
    exact, _ = DirectSum().pressure(of, SNAPS, hears)
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    plain = GriddedSynthesis().signals(of.seen_from_centre, SNAPS, hears).pressure
    late = slice(int((of.delay[of.target == 0].min() - 1e-3 - hears.start) * SONAR.sampling_frequency), None)
    assert error(got[:, late], exact[:, late]) < 1e-4
    assert error(got, exact) < 1e-4
    assert error(plain, exact) > 1e-2


def partly_hidden(of: Arrivals, count: int, sensors: int = FACES.count) -> Arrivals:
    """Some of the paths hidden from random hydrophones, the direct one too."""
    dark = np.zeros((len(of.delay), 1 + sensors), np.uint8)
    dark[-count:, 1:] = np.random.default_rng(count).integers(0, 2, (count, sensors))
    return replace(of, occluded=np.packbits(dark, axis=1))


def test_hydrophones_keep_their_own_shade() -> None:
    of = partly_hidden(target_at(8.0, 40, 2), 20)
    rows = np.array([400, 3, 77])
    np.testing.assert_array_equal(of.for_sensors(rows, FACES.count).hidden(3), of.hidden(FACES.count)[:, rows])


def test_shade_of_another_array_is_refused() -> None:
    of = partly_hidden(target_at(8.0, 4, 2), 2)
    hears = hearing(of, SONAR, FACES, absorption)
    array = replace(FACES, position=FACES.position[:9], gain=FACES.gain[:9])
    with pytest.raises(ValueError, match="hidden from hydrophones of another array"):
        GriddedSynthesis().signals(of, SNAPS, hears._replace(elements=array))


@pytest.mark.long
def test_errors_are_measured_where_each_hydrophone_sees_for_itself() -> None:
    """Every knob of `accuracy RECIPE`: subarrays and views of the targets, syntheses, images."""
    recipe = screened(0.02)
    scene = recipe.scene
    few = PlanarLattice(columns=12, rows=8, pitch=0.1)
    band = replace(scene.sonar, array=few, beams=BeamGrid(azimuths=5, elevations=5))
    points = measure(replace(recipe, scene=replace(scene, sonar=band)), (0,), hydrophones=3, peers=False).points
    views = {p.setting: p.error for p in points if p.knob in ("subarrays", "occlusion") and p.stage == "trace"}
    assert views["1 part"] < 2e-3
    assert views["from the centre, 1 part"] > 0.1
