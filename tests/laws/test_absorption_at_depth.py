"""Water absorbs by the depths that each path passes: against quadratures of the formula along it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import sonarsynth as ss
from sonarsynth.environment.absorption import ALIKE, DepthAbsorption
from sonarsynth.environment.sea import Absorption, Profile
from sonarsynth.equations.water.seawater import francois_garrison
from sonarsynth.planning import Choices, Plan, arrivals_of, plan
from sonarsynth.propagation import Refracted
from sonarsynth.signals.direct_sum import relative_absorption

COLD = Absorption(temperature=4.0, salinity=35.0, ph=8.0)
FLAT = Profile(np.array([0.0]), np.array([1500.0]))


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


def test_reflected_straight_paths_pass_the_depths_of_their_images() -> None:
    """Down to the bottom, up to the surface and back down: each leg by itself."""
    bottom_depth, table = 3000.0, DepthAbsorption.of(COLD, 55e3, 3000.0)
    z1, z2, level = 500.0, 900.0, 700.0
    drop = (bottom_depth - z1) + bottom_depth + z2
    climb = -drop / np.hypot(drop, level)
    got = table.along(FLAT, np.array([z1]), np.array([z2]), np.array([climb]), np.array([2]))[0]
    total = sum(quad(lambda z: fg(55e3, z), a, b)[0] for a, b in ((z1, bottom_depth), (0.0, bottom_depth), (0.0, z2)))
    assert got == pytest.approx(total / drop, rel=2e-5)


@pytest.mark.parametrize(("start", "degrees", "vertices"), [(800.0, -6.0, 0), (800.0, -12.0, 1), (200.0, 10.0, 2)])
def test_bent_rays_pass_the_depths_of_their_arcs(start: float, degrees: float, vertices: int) -> None:
    """In a constant gradient a ray is an arc of radius c/(g cos): integrated along its length, turning or reflected."""
    c0, g, bottom_depth = 1480.0, 0.05, 4000.0
    profile = Profile(np.array([0.0, bottom_depth]), np.array([c0, c0 + g * bottom_depth]))
    angle = np.deg2rad(degrees)  # up positive; the ray bends upwards by g cos/c
    radius = (c0 + g * start) / (g * np.cos(angle))
    at_turn = start + radius * (1.0 - np.cos(angle))

    def along(phi: float) -> float:
        return at_turn - radius * (1.0 - np.cos(phi))  # depth where the ray climbs at phi

    def piece(a: float, b: float) -> tuple[float, float]:
        return radius * (b - a), radius * quad(lambda phi: fg(55e3, along(phi)), a, b)[0]

    if vertices == 0:
        end_angle = np.deg2rad(-1.0)
        pieces = [piece(angle, end_angle)]
    elif vertices == 1:
        end_angle = np.deg2rad(5.0)
        pieces = [piece(angle, end_angle)]
    else:  # by the surface, then round below, and up again
        top = float(np.arccos(1.0 - at_turn / radius))
        end_angle = np.deg2rad(2.0)
        pieces = [piece(angle, top), piece(-top, end_angle)]
    length, absorbed = np.sum(pieces, axis=0)
    table = DepthAbsorption.of(COLD, 55e3, bottom_depth)
    ends = np.array([start]), np.array([along(end_angle)])
    got = table.along(profile, *ends, np.array([np.sin(angle)]), np.array([vertices]))[0]
    assert got == pytest.approx(absorbed / length, rel=3e-5)
    assert Refracted().bends  # what makes such rays


def test_the_formula_at_no_absorption_is_nothing() -> None:
    table = DepthAbsorption.of(Absorption(formula="none"), 55e3, 100.0)
    assert table.along(FLAT, np.array([1.0]), np.array([1.0]), np.zeros(1), np.zeros(1, np.int64))[0] == 0.0


def test_rays_over_alike_depths_lose_as_much_as_those_that_are_followed() -> None:
    """By `ALIKE` at most, whatever they pass: turning, reflected, short and long."""
    bottom_depth, rng = 40.0, np.random.default_rng(5)
    profile = Profile(np.array([0.0, 15.0, 20.0, bottom_depth]), np.array([1540.0, 1538.0, 1510.0, 1508.0]))
    table = DepthAbsorption.of(COLD, 55e3, bottom_depth)
    start, end = rng.uniform(0.0, bottom_depth, (2, 400))
    rays = profile, start, end, rng.uniform(-0.5, 0.5, 400), rng.integers(0, 4, 400)
    length = 10.0 ** rng.uniform(0.5, 3.5, 400)
    off = np.abs(table.lost(length, *rays) - length * table.along(*rays))
    alike = length * np.ptp(table.value) <= ALIKE
    assert 50 < alike.sum() < 350
    assert 0.01 * ALIKE < off[alike].max() <= ALIKE
    assert (off[~alike] == 0.0).all()
