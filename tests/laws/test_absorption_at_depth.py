"""Water absorbs by the depths that each path passes: against quadratures of the formula along it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import sonarsynth as ss
from sonarsynth.environment.absorption import DepthAbsorption
from sonarsynth.environment.sea import Absorption
from sonarsynth.equations.water.seawater import francois_garrison
from sonarsynth.planning import Choices, Plan, arrivals_of, plan
from sonarsynth.propagation import Straight
from sonarsynth.signals.direct_sum import relative_absorption

COLD = Absorption(temperature=4.0, salinity=35.0, ph=8.0)


def fg(frequency: float, depth: float) -> float:
    return float(francois_garrison(frequency, 4.0, 35.0, depth, 8.0))


def slant(frequency: float, one: np.ndarray, other: np.ndarray) -> float:
    """dB between two places (xyz), by quadrature along the straight line between them."""
    length = float(np.linalg.norm(other - one))
    return length * quad(lambda s: fg(frequency, -(one + s * (other - one))[2]), 0.0, 1.0, epsrel=1e-12)[0]


def scene(
    depth: float,
    snap: tuple[float, float, float],
    array: tuple[float, float, float],
    target: tuple[float, float, float],
) -> ss.Recipe:
    ball = ss.Target(
        name="ball",
        shape=ss.Sphere(radius=0.5, edge=0.4),
        motion=ss.Still(position=target),
        scattering=ss.Isotropic(strength=1.0),
    )
    world = ss.World(
        environment=ss.Environment(depth=depth, sound_speed=ss.Isovelocity(speed=1500.0), absorption=COLD),
        targets=(ball,),
        sources=(ss.SnappingShrimp(position=snap),),
    )
    sonar = ss.Sonar(array=ss.PlanarLattice(columns=2, rows=2, pitch=0.02), beams=ss.BeamGrid(azimuths=3, elevations=3))
    trajectory = ss.Trajectory(sonar=ss.Still(position=array, heading=0.5 * np.pi))
    physics = ss.Physics(subarrays=1)
    return ss.Recipe(
        scene=ss.Scene(world=world, sonar=sonar, trajectory=trajectory, physics=physics),
        accuracy=ss.Accuracy(signal=0.02),
    )


@pytest.fixture(scope="module")
def planned() -> dict[str, Plan]:
    scenes = {
        "shallow in 5 km": scene(5000.0, (500.0, 30.0, -60.0), (0.0, 0.0, -40.0), (480.0, -40.0, -50.0)),
        "straight up 3 km": scene(3100.0, (1.0, 2.0, -3050.0), (0.0, 0.0, -50.0), (40.0, 5.0, -3000.0)),
        "slant": scene(4000.0, (1500.0, 0.0, -100.0), (0.0, 0.0, -2500.0), (1400.0, 60.0, -200.0)),
    }
    return {name: plan(recipe, ("signals",), Choices()) for name, recipe in scenes.items()}


@pytest.mark.parametrize("name", ["shallow in 5 km", "straight up 3 km", "slant"])
def test_a_path_loses_its_own_mean_at_the_centre_and_over_the_band(planned: dict[str, Plan], name: str) -> None:
    made = planned[name]
    frame = made.recipe.frame(0)[1]
    found = arrivals_of(made, frame)
    band, source, array = made.scene.sonar.band, frame.moment.snaps[0].position, frame.sonar_pose.position
    assert found.direct.any() and not found.direct.all()
    for row in (int(np.flatnonzero(found.direct)[0]), int(np.flatnonzero(~found.direct)[-1])):
        points = [source, array] if found.direct[row] else [source, found.point[row], array]
        for frequency in (band.low, band.centre, band.high):
            exact = sum(slant(frequency, a, b) for a, b in pairwise(points))
            relative = relative_absorption(made.absorption, np.array([frequency]), band.centre)[0]
            got = float(found.absorption[row]) * (1.0 + float(relative))
            allowed = 2e-5 * exact if frequency == band.centre else made.absorption_error + 2e-5 * exact
            assert abs(got - exact) <= allowed, (frequency, got, exact)
    # of the scenes here one spectrum serves all paths, and the plan says how well
    assert made.absorption_error < 0.09
    (row_said,) = [o for o in made.left_out if o.what.startswith("depth dependence of the absorption")]
    assert row_said.bound.startswith(f"{made.absorption_error:.1g} dB")


def test_a_shallow_scene_in_deep_water_is_not_absorbed_as_if_half_way_down(planned: dict[str, Plan]) -> None:
    """16.7 dB/km at 50 m where mid-depth has 11.7: 2.5 dB over 500 m."""
    made = planned["shallow in 5 km"]
    found = arrivals_of(made, made.recipe.frame(0)[1])
    direct = found.direct
    per_km = 1e3 * found.absorption[direct] / found.length[direct]
    assert per_km == pytest.approx(1e3 * fg(55e3, 50.0), rel=1e-4)
    assert (per_km - 1e3 * fg(55e3, 2500.0)) * 0.5 == pytest.approx(2.5, abs=0.1)


def test_sources_far_apart_in_depth_are_noted_where_one_spectrum_does_not_serve_both(planned: dict[str, Plan]) -> None:
    recipe = planned["straight up 3 km"].recipe
    world = recipe.scene.world
    both = (*world.sources, ss.SnappingShrimp(position=(1500.0, 0.0, -60.0), snap_times=(0.0,)))
    tight = replace(
        recipe, scene=replace(recipe.scene, world=replace(world, sources=both)), accuracy=ss.Accuracy(signal=1e-3)
    )
    made = replace(planned["straight up 3 km"], recipe=tight)
    assert made.absorption_error > 0.2
    said = "all paths share the absorption spectrum"
    assert any(said in note for note in plan(tight, ("signals",), Choices()).warnings)
    assert not any(said in note for note in planned["slant"].warnings)


def test_reflected_paths_lose_what_lies_on_their_ways() -> None:
    """By surface and bottom of 300 m of water."""
    recipe = scene(300.0, (500.0, 30.0, -60.0), (0.0, 0.0, -40.0), (480.0, -40.0, -50.0))
    physics = replace(recipe.scene.physics, tracing=Straight(bounces=2))
    made = plan(replace(recipe, scene=replace(recipe.scene, physics=physics)), ("signals",), Choices())
    found = arrivals_of(made, made.recipe.frame(0)[1])
    down, up, all_of_it = [(60.0, 300.0), (300.0, 40.0)], [(60.0, 0.0), (0.0, 40.0)], [(0.0, 300.0)]
    legs = {(0, 1): down, (1, 0): up, (1, 1): [down[0], *all_of_it, up[1]]}
    for (surface, bottom), pieces in legs.items():
        row = np.flatnonzero(found.direct & (found.surface == surface) & (found.bottom == bottom))[0]
        total, deep = (
            sum(quad(f, *sorted(ends))[0] for ends in pieces) for f in (lambda z: fg(55e3, z), lambda z: 1.0)
        )
        exact = found.length[row] * total / deep
        assert found.absorption[row] == pytest.approx(exact, rel=2e-5)


def test_the_formula_at_no_absorption_is_nothing() -> None:
    table = DepthAbsorption.of(Absorption(formula="none"), 55e3, 100.0)
    assert table.along(*np.ones((3, 1)), np.zeros(1, int))[0] == table.mean == 0.0
