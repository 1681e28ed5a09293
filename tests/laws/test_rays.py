"""Laws of rays in layered water: closed forms, limits, reciprocity, ray tubes, and rays followed arc by arc."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions


def linear(gradient: float, deep: float = 20e3, middle: float = 1500.0) -> ray_solutions.Water:
    """Water of one gradient (1/s), 1500 m/s half way down."""
    half = 0.5 * deep * gradient
    return ray_solutions.water(np.array([0.0, deep]), np.array([middle - half, middle + half]), deep)


def closed_form(water: ray_solutions.Water, z1: Floats, z2: Floats, r: Floats) -> tuple[Floats, Floats]:
    """Travel time and length in one gradient layer: an arc through both points, centred where the speed would be 0."""
    g = (water.speed[1] - water.speed[0]) / water.depth[1]
    c1, c2 = (water.speed[0] + g * z for z in (z1, z2))
    chord = np.hypot(r, z2 - z1)
    centre = (c2 + c1) * (z2 - z1) / (2 * r) + g * r / 2  # g times (horizontal offset of the centre from the first end)
    radius = np.hypot(c1, centre) / abs(g)
    half = 0.5 * abs(g) * chord / np.sqrt(c1 * c2)
    return 2 / abs(g) * np.arcsinh(half), 2 * radius * np.arcsin(np.minimum(0.5 * chord / radius, 1.0))


@pytest.mark.parametrize("gradient", [0.05, -0.05, 0.017, 1e-3])
def test_one_layer_has_the_closed_form_whether_or_not_the_ray_turns(gradient: float) -> None:
    rng = np.random.default_rng(0)
    water = linear(gradient)
    z1, z2 = rng.uniform(9e3, 11e3, (2, 3000))
    r = 10 ** rng.uniform(1, 4.3, 3000)
    found = ray_solutions.eigenrays(water, z1, z2, r)
    assert np.array_equal(found.pair, np.arange(3000))
    assert 0 < np.isfinite(np.fmax(found.upper, found.lower)).sum() < 3000
    time, length = closed_form(water, z1, z2, r)
    np.testing.assert_allclose(found.travel_time, time, rtol=3e-14)
    np.testing.assert_allclose(found.length, length, rtol=1e-9)


def test_uniform_water_has_straight_rays() -> None:
    rng = np.random.default_rng(1)
    water = ray_solutions.water(np.array([0.0, 13.0, 40.0]), np.full(3, 1540.0), 100.0)
    z1, z2, r = rng.uniform(0, 100, 500), rng.uniform(0, 100, 500), 10 ** rng.uniform(-3, 5, 500)
    z2[:100] = z1[:100]
    z2[100:200] = z1[100:200] + 10 ** rng.uniform(-14, -3, 100)
    z2 = np.minimum(z2, 100.0)
    found = ray_solutions.eigenrays(water, z1, z2, r)
    d = np.hypot(r, z2 - z1)
    assert np.array_equal(found.pair, np.arange(500))
    np.testing.assert_allclose(found.travel_time, d / 1540.0, rtol=1e-15)
    np.testing.assert_allclose(found.length, d, rtol=1e-15)
    np.testing.assert_allclose(found.amplitude, 1 / d, rtol=4e-15)
    np.testing.assert_allclose(found.start_sine, (z1 - z2) / d, rtol=1e-12, atol=1e-300)
    np.testing.assert_allclose(found.end_sine, found.start_sine, rtol=1e-15)
    assert (found.flag == ray_solutions.GOOD).all()


def thermocline() -> ray_solutions.Water:
    """A surface layer, 1.5 m of -4.3 per second, a slower layer of slight gradient."""
    return ray_solutions.water(np.array([0.0, 5.0, 6.5, 20.0]), np.array([1540.0, 1540.0, 1533.55, 1533.2]), 20.0)


def test_a_path_is_the_same_from_both_ends() -> None:
    rng = np.random.default_rng(2)
    water = thermocline()
    z1, z2, r = rng.uniform(0, 20, 400), rng.uniform(0, 20, 400), 10 ** rng.uniform(0, 3, 400)
    there, back = ray_solutions.eigenrays(water, z1, z2, r), ray_solutions.eigenrays(water, z2, z1, r)
    assert np.array_equal(there.pair, back.pair)
    for name in ("travel_time", "length", "slowness", "amplitude", "upper", "lower"):
        np.testing.assert_allclose(getattr(there, name), getattr(back, name), rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(there.start_sine, -back.end_sine, rtol=1e-9)
    np.testing.assert_allclose(there.end_sine, -back.start_sine, rtol=1e-9)
    np.testing.assert_array_equal(there.flag, back.flag)


def test_snell_and_the_slope_of_the_travel_time() -> None:
    rng = np.random.default_rng(3)
    water = thermocline()
    z1, z2, r = rng.uniform(0, 20, 200), rng.uniform(0, 20, 200), 10 ** rng.uniform(0.5, 2, 200)
    here, near, far = (ray_solutions.eigenrays(water, z1, z2, r * s) for s in (1.0, 1 - 1e-5, 1 + 1e-5))
    one = [np.bincount(f.pair, minlength=200) == 1 for f in (here, near, far)]
    keep = np.flatnonzero(one[0] & one[1] & one[2])
    here, near, far = (select(f, keep) for f in (here, near, far))
    same = np.isnan(np.fmax(near.upper, near.lower)) == np.isnan(np.fmax(far.upper, far.lower))
    for sine, speed in ((here.start_sine, here.start_speed), (here.end_sine, here.end_speed)):
        np.testing.assert_allclose(here.slowness * speed, np.sqrt(1 - sine**2), rtol=1e-12)
    slope = (far.travel_time - near.travel_time) / (2e-5 * r[keep])
    np.testing.assert_allclose(slope[same], here.slowness[same], rtol=1e-6)
    assert same.sum() > 100


def select(found: ray_solutions.Eigenrays, pairs: np.ndarray) -> ray_solutions.Eigenrays:
    keep = np.isin(found.pair, pairs)
    return ray_solutions.Eigenrays(**{name: value[keep] for name, value in vars(found).items()})


def test_the_amplitude_is_that_of_a_ray_tube() -> None:
    rng = np.random.default_rng(4)
    water = thermocline()
    z1, z2, r = rng.uniform(7, 20, 200), rng.uniform(7, 20, 200), 10 ** rng.uniform(0.5, 1.5, 200)
    z1[:60] = rng.uniform(0, 20, 60)
    here, near, far = (ray_solutions.eigenrays(water, z1, z2, r * s) for s in (1.0, 1 - 1e-5, 1 + 1e-5))
    pairs = [i for i in range(200) if all((f.pair == i).sum() == 1 for f in (here, near, far))]
    here, near, far = (select(f, np.array(pairs)) for f in (here, near, far))
    r = r[pairs]
    angle = [np.arctan2(f.start_sine, f.slowness * f.start_speed) for f in (near, far)]
    spread = 2e-5 * r / np.abs(angle[1] - angle[0])  # dX/dtheta
    cosine = here.slowness * here.start_speed
    intensity = cosine / (r * spread * np.abs(here.end_sine))  # power in d(theta) over its area at the end
    expected = np.sqrt(intensity * here.end_speed / here.start_speed)  # intensity is p^2/(rho c)
    smooth = np.abs(here.amplitude / expected - 1)
    assert len(pairs) > 150
    assert np.quantile(smooth, 0.9) < 1e-5  # a few straddle a kink between near and far


@pytest.mark.parametrize("gradient", [1e-16, 1e-13, 1e-10, 1e-7, 1e-4])
def test_a_vanishing_gradient_goes_over_into_uniform_water(gradient: float) -> None:
    rng = np.random.default_rng(5)
    z1, z2, r = rng.uniform(90, 110, 300), rng.uniform(90, 110, 300), 10 ** rng.uniform(0, 2, 300)
    for sign in (1, -1):
        water = linear(sign * gradient, 200.0)
        found = ray_solutions.eigenrays(water, z1, z2, r)
        d = np.hypot(r, z2 - z1)
        c1, c2 = np.interp(z1, water.depth, water.speed), np.interp(z2, water.depth, water.speed)
        x = 0.5 * gradient * d / np.sqrt(c1 * c2)
        assert np.array_equal(found.pair, np.arange(300))
        np.testing.assert_allclose(found.travel_time, d / np.sqrt(c1 * c2) * (1 - x * x / 6), rtol=2e-15)
        np.testing.assert_allclose(found.amplitude * d, 1.0, rtol=1e-14 + 1e-3 * gradient * 200)
    level = ray_solutions.eigenrays(linear(gradient, 200.0), z1, z1, r)
    np.testing.assert_allclose(level.travel_time, r / np.interp(z1, [0, 200], linear(gradient, 200.0).speed), rtol=1e-9)


def test_steep_rays_go_over_into_the_vertical_one() -> None:
    water = thermocline()
    distance = np.array([0.0, 1e-300, 1e-100, 1e-15, 1e-9, 1e-4])
    found = ray_solutions.eigenrays(water, np.full(6, 1.0), np.full(6, 19.0), distance)
    depth = np.array([1.0, 5.0, 6.5, 19.0])
    c = np.interp(depth, water.depth, water.speed)
    drop = c[:-1] - c[1:]
    parts = np.diff(depth) * np.divide(np.log1p(drop / c[1:]), drop, out=1 / c[1:], where=drop > 0)
    np.testing.assert_allclose(found.travel_time[:5], sum(parts), rtol=1e-14)
    np.testing.assert_allclose(found.length[:5], 18.0, rtol=1e-15)
    np.testing.assert_allclose(found.amplitude, found.amplitude[0], rtol=1e-9)
    np.testing.assert_allclose(found.start_sine, -1.0, rtol=1e-9)
    np.testing.assert_allclose(found.slowness[1:] / distance[1:], found.slowness[5] / 1e-4, rtol=1e-8)
    assert found.slowness[0] == 0


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


def test_a_thermocline_bends_with_a_radius_of_350_m() -> None:
    found = ray_solutions.eigenrays(thermocline(), np.array([5.1]), np.array([6.4]), np.array([20.0]))
    turn = np.arcsin(found.start_sine[0]) - np.arcsin(found.end_sine[0])
    radius = found.length[0] / turn
    assert radius == pytest.approx(1537.0 / 4.3, rel=5e-3)


def test_a_shadow_zone_has_no_path_and_its_edge_is_where_the_grazing_ray_goes() -> None:
    water = ray_solutions.water(np.array([0.0, 50.0]), np.array([1540.0, 1530.0]), 50.0)
    limit = (
        np.sqrt(1540.0**2 - 1538.0**2) / 0.2 + np.sqrt(1540.0**2 - 1534.0**2) / 0.2
    )  # from 10 m over the surface to 30 m
    found = ray_solutions.eigenrays(water, np.full(2, 10.0), np.full(2, 30.0), limit * np.array([1 - 1e-9, 1 + 1e-9]))
    assert list(found.pair) == [0]
    assert np.fmax(found.upper, found.lower)[0] == pytest.approx(0.0, abs=1e-4)


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


def test_a_jump_is_the_limit_of_a_thin_layer() -> None:
    jump = ray_solutions.water(np.array([0.0, 10.0, 10.0, 30.0]), np.array([1500.0, 1502.0, 1520.0, 1521.0]), 30.0)
    rng = np.random.default_rng(6)
    z1, z2, r = rng.uniform(0, 30, 200), rng.uniform(0, 30, 200), 10 ** rng.uniform(0, 2.3, 200)
    sharp = ray_solutions.eigenrays(jump, z1, z2, r)
    thin = ray_solutions.eigenrays(
        ray_solutions.water(np.array([0.0, 10.0, 10.0 + 1e-10, 30.0]), jump.speed, 30.0), z1, z2, r
    )
    assert np.array_equal(sharp.pair, thin.pair)
    np.testing.assert_allclose(sharp.travel_time, thin.travel_time, rtol=1e-11)
    assert np.isfinite(np.fmax(sharp.upper, sharp.lower)).sum() > 5


def test_splitting_a_layer_changes_nothing() -> None:
    whole = thermocline()
    depth = np.sort(np.concatenate([whole.depth, np.linspace(0.5, 19.5, 58)]))
    split = ray_solutions.water(depth, np.interp(depth, whole.depth, whole.speed), 20.0)
    rng = np.random.default_rng(7)
    z1, z2, r = rng.uniform(0, 20, 200), rng.uniform(0, 20, 200), 10 ** rng.uniform(0, 2, 200)
    a, b = ray_solutions.eigenrays(whole, z1, z2, r), ray_solutions.eigenrays(split, z1, z2, r)
    assert np.array_equal(a.pair, b.pair)
    np.testing.assert_allclose(a.travel_time, b.travel_time, rtol=1e-14)
    np.testing.assert_allclose(a.amplitude, b.amplitude, rtol=1e-6)


def test_a_ray_followed_arc_by_arc_ends_where_the_eigenray_does() -> None:
    from sonarsynth.equations.rays import ray_arcs

    rng = np.random.default_rng(8)
    depth = np.sort(rng.uniform(0, 100, 9))
    depth[4] = depth[5]
    water = ray_solutions.water(depth, 1500 + 8 * rng.normal(size=9), 100.0)
    z1, z2, r = rng.uniform(0, 100, 800), rng.uniform(0, 100, 800), 10 ** rng.uniform(0, 3.3, 800)
    found = ray_solutions.eigenrays(water, z1, z2, r)
    nodes = np.empty((200 * len(found.pair), 3))
    angle = -np.arctan2(found.start_sine, found.slowness * found.start_speed)
    count = ray_arcs.chords(water.depth, water.speed, z1[found.pair], angle, found.slowness, found.length, 1e-3, nodes)
    last = np.flatnonzero(np.diff(nodes[:count, 0], append=-1))
    _, x, z = nodes[last].T
    assert np.isfinite(np.fmax(found.upper, found.lower)).sum() > 50
    np.testing.assert_allclose(x, r[found.pair], rtol=1e-8)
    np.testing.assert_allclose(z, z2[found.pair], atol=2e-6)


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
