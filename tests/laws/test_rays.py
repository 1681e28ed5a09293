"""Laws of rays in layered water: closed forms, limits, reciprocity, ray tubes, and rays followed arc by arc."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.propagation.path_model import KnownRays
from sonarsynth.propagation.refracted import Refracted


def linear(gradient: float, deep: float = 20e3, middle: float = 1500.0) -> ray_solutions.Water:
    """Water of one gradient (1/s), 1500 m/s half way down."""
    half = 0.5 * deep * gradient
    return ray_solutions.water(np.array([0.0, deep]), np.array([middle - half, middle + half]), deep)


def thermocline() -> ray_solutions.Water:
    """A surface layer, 1.5 m of -4.3 per second, a slower layer of slight gradient."""
    return ray_solutions.water(np.array([0.0, 5.0, 6.5, 20.0]), np.array([1540.0, 1540.0, 1533.55, 1533.2]), 20.0)


def test_the_last_straight_ray_and_the_first_turning_one_meet() -> None:
    water = linear(0.1, 400.0)
    g, c1, c2 = 0.1, 1490.0, 1500.0  # ends at 100 and 200 m
    limit = np.sqrt((c2 - c1) * (c2 + c1)) / g  # the ray that arrives level
    offset = np.array([-1e-2, -1e-6, -1e-10, -1e-13, 0.0, 1e-13, 1e-10, 1e-6, 1e-2])
    r = limit * (1 + offset)
    found = ray_solutions.eigenrays(water, np.full(9, 100.0), np.full(9, 200.0), r)
    assert np.array_equal(found.pair, np.arange(9))
    assert np.isnan(np.fmax(found.upper, found.lower)[:3]).all()
    assert np.isfinite(np.fmax(found.upper, found.lower)[6:]).all()
    chord = np.hypot(r, 100.0)
    np.testing.assert_allclose(found.travel_time, 2 / g * np.arcsinh(g * chord / 2 / np.sqrt(c1 * c2)), rtol=1e-14)
    assert np.abs(found.end_sine[[3, 4, 5]]).max() < 1e-6
    np.testing.assert_allclose(found.amplitude[3:6], found.amplitude[4], rtol=1e-5)


def test_the_bed_ends_the_water_that_a_ray_may_turn_in() -> None:
    profile = np.array([0.0, 100.0]), np.array([1500.0, 1520.0])
    vertex = ray_solutions.eigenrays(
        ray_solutions.water(*profile, 100.0), np.array([40.0]), np.array([40.0]), np.array([400.0])
    ).lower[0]
    for bottom_depth, paths in ((vertex + 1e-6, 1), (vertex - 1e-6, 0)):
        found = ray_solutions.eigenrays(
            ray_solutions.water(*profile, bottom_depth), np.array([40.0]), np.array([40.0]), np.array([400.0])
        )
        assert len(found.pair) == paths


@pytest.mark.parametrize("layers", [0, 800])
def test_mean_slowness_is_the_integral_of_the_slowness(layers) -> None:
    """In few layers, and in so many that whole ones are summed beforehand."""
    water = thermocline()
    if layers:
        depth = np.linspace(0.0, 20.0, layers + 1)
        water = ray_solutions.water(depth, np.interp(depth, water.depth, water.speed) + 0.3 * np.sin(9.0 * depth), 20.0)
    nodes = np.linspace(0, 20, 200001)
    total = np.concatenate(
        [[0], np.cumsum(np.diff(nodes) / np.interp(0.5 * (nodes[1:] + nodes[:-1]), water.depth, water.speed))]
    )
    z1, z2 = np.array([0.0, 3.0, 6.0, 20.0]), np.array([20.0, 5.5, 6.0, 1.0])
    mean = ray_solutions.mean_slowness(water, z1, z2)
    i, j = np.rint(z1 * 1e4).astype(int), np.rint(z2 * 1e4).astype(int)
    expected = np.where(
        i == j, 1 / np.interp(z1, water.depth, water.speed), (total[j] - total[i]) / np.where(i == j, 1, z2 - z1)
    )
    np.testing.assert_allclose(mean, expected, rtol=1e-11)


@pytest.mark.parametrize("gradient", [0.016, 1.0, -0.05])
def test_hops_along_a_boundary_have_the_closed_form(gradient: float) -> None:
    """Both ends on the surface (or the bottom) of water that bends rays back to it: n equal arcs."""
    c, bottom_depth, r = 1500.0, 1000.0, 800.0
    speeds = np.array([c, c + gradient * bottom_depth]) if gradient > 0 else np.array([c - gradient * bottom_depth, c])
    water, end = (
        ray_solutions.water(np.array([0.0, bottom_depth]), speeds, bottom_depth),
        0.0 if gradient > 0 else bottom_depth,
    )
    found = ray_solutions.eigenrays(water, np.array([end]), np.array([end]), np.array([r]), 11, 11)
    g = abs(gradient)
    for hops in range(1, 6):
        hits = found.surface if gradient > 0 else found.bottom
        mine = (found.turning == hops) & (found.surface + found.bottom == hits)
        assert sorted(hits[mine]) == [hops - 1, hops, hops, hops + 1]  # reflected or not at either end
        tangent = g * r / (2 * hops * c)
        np.testing.assert_allclose(found.travel_time[mine], 2 * hops / g * np.arcsinh(tangent), rtol=2e-15)
        np.testing.assert_allclose(
            found.length[mine], 2 * hops * c / g * np.arctan(tangent) * np.hypot(1, tangent), rtol=1e-12
        )
        np.testing.assert_allclose(np.abs(found.start_sine[mine]), tangent / np.hypot(1, tangent), rtol=1e-12)
        deepest = c * (np.hypot(1, tangent) - 1) / g
        vertex = found.lower[mine] if gradient > 0 else bottom_depth - found.upper[mine]
        np.testing.assert_allclose(vertex, deepest, rtol=1e-9)
        assert set(found.caustics[mine]) == {hops - 1}
        assert sorted(np.sign(found.start_sine[mine])) == [-1, -1, 1, 1]


def test_rays_to_places_about_a_level_end_are_reached_from_the_ray_to_its_middle() -> None:
    """None is given up and searched for, though that to the middle is fifty times as level as those to its ends;
    all are those that the search finds."""
    profile = Profile(np.array([0.0, 6.5, 8.0, 10.0]), np.array([1541.0, 1541.1, 1534.7, 1534.7]))
    model, start = Refracted(bounces=2), np.array([[0.0, 0.0, -4.5]])
    end = np.array([[20.0, 0.1 * n, -4.49 + 0.12 * n] for n in range(-5, 6)])
    middle = model.connect(profile, 10.0, start, end[5:6])
    known = KnownRays(
        np.repeat(start, len(middle.pair), axis=0), middle.departure, middle.surface + middle.bottom + middle.turning
    )
    beside = model.beside(profile, 10.0, known, end)
    every = model.connect(profile, 10.0, np.repeat(start, len(end), axis=0), end)
    assert len(middle.pair) == 5
    for ray, (surface, bottom, up) in enumerate(
        zip(middle.surface, middle.bottom, middle.departure[:, 2] > 0.0, strict=True)
    ):
        same = (every.surface == surface) & (every.bottom == bottom)
        same &= (surface + bottom == 0) | ((every.departure[:, 2] > 0.0) == up)
        assert np.array_equal(every.pair[same], np.arange(len(end)))
        np.testing.assert_allclose(beside.travel_time[ray], every.travel_time[same], rtol=1e-15)
        np.testing.assert_allclose(beside.departure[ray], every.departure[same], atol=1e-13)
        np.testing.assert_allclose(beside.spreading[ray], every.spreading[same], rtol=1e-6)
