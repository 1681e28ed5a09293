"""Eigenrays of all families where things degenerate: an answer, continuous with its neighbours, or a flag."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.rays.ray_matching import rays_of
from sonarsynth.validation.references.rays.exact_rays import exact_rays
from sonarsynth.validation.references.rays.followed_rays import families
from tests.ray_paths import family, images
from tests.waiting import HANGING

CHANNEL = ray_solutions.water(np.array([0.0, 20.0, 50.0]), np.array([1510.0, 1500.0, 1515.0]), 50.0)
FALLING = ray_solutions.water(np.array([0.0, 100.0]), np.array([1530.0, 1500.0]), 100.0)
JUMPS = ray_solutions.water(np.array([0.0, 15.0, 15.0, 30.0]), np.array([1510.0, 1505.0, 1500.0, 1503.0]), 40.0)
WATERS = {"channel": CHANNEL, "falling": FALLING, "jumps": JUMPS}


def one(
    water: ray_solutions.Water, start: float, end: float, distance: float, vertices: int = 4, hits: int = 4
) -> ray_solutions.Eigenrays:
    return ray_solutions.eigenrays(water, np.array([start]), np.array([end]), np.array([distance]), vertices, hits)


def names(found: ray_solutions.Eigenrays) -> list[tuple[int, ...]]:
    return sorted(family(found, i)[1:4] for i in range(len(found.pair)))


def check(
    water: ray_solutions.Water, found: ray_solutions.Eigenrays, start: float, end: float, distance: float, some: int = 8
) -> None:
    """All is finite and in order; some rays take the time that they take in long doubles."""
    for name in ("travel_time", "length", "slowness", "start_sine", "end_sine", "amplitude"):
        assert np.isfinite(getattr(found, name)).all(), name
    assert (np.diff(found.travel_time) >= 0).all()
    assert np.isin(found.flag, list(ray_solutions.REASONS)).all()
    above, below = found.surface + found.turning > 0, found.bottom + found.turning > 0
    assert (np.isfinite(found.upper) | np.isfinite(found.lower))[above | below].all()
    assert (found.upper[found.surface > 0] == 0).all()
    assert (found.lower[found.bottom > 0] == water.depth[-1]).all()
    assert (found.amplitude > 0).all()
    assert len({(*family(found, i), found.travel_time[i]) for i in range(len(found.pair))}) == len(found.pair)
    sharp = (found.start_sine != 0) & (found.flag != ray_solutions.CAUSTIC) & (found.slowness > 1e-12)
    few = np.random.default_rng(0).permutation(np.flatnonzero(sharp))[:some]
    ends = (np.array([x]) for x in (start, end, distance))
    exact = exact_rays(water, rays_of(found).select(few), found.slowness[few], *ends)
    np.testing.assert_allclose(found.travel_time[few], exact.travel_time, rtol=1e-14)


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize(("start", "end"), [(0.0, 40.0), (12.0, 31.0), (31.0, 12.0), (7.0, 7.0), (40.0, 0.0)])
def test_straight_up_and_down(name: str, start: float, end: float) -> None:
    water = WATERS[name]
    bottom_depth = water.depth[-1]
    found = one(water, start, end, 0.0, 5, 5)
    whole = float(ray_solutions.mean_slowness(water, np.array([0.0]), np.array([bottom_depth]))[0]) * bottom_depth
    down = [float(ray_solutions.mean_slowness(water, np.array([0.0]), np.array([z]))[0]) * z for z in (start, end)]
    expected = images(whole, *down, 5)
    tall = images(bottom_depth, start, end, 5)
    keep = [i for i, row in enumerate(tall) if row[4] > 0]
    moving = found.length > 0
    np.testing.assert_allclose(found.travel_time[moving], [expected[i][4] for i in keep], rtol=1e-14)
    np.testing.assert_allclose(found.length[moving], [tall[i][4] for i in keep], rtol=1e-14)
    np.testing.assert_array_equal(found.slowness[moving], 0.0)
    np.testing.assert_array_equal(np.abs(found.start_sine[moving]), 1.0)
    np.testing.assert_array_equal(found.turning, 0)
    assert (found.flag[~moving] == ray_solutions.COINCIDENT).all()
    assert np.isfinite(found.amplitude[moving]).all()
    np.testing.assert_array_equal(found.upper[moving & (found.surface > 0)], 0.0)
    np.testing.assert_array_equal(found.lower[moving & (found.bottom > 0)], bottom_depth)


@pytest.mark.parametrize(
    ("depths", "speeds", "at", "count"),
    [
        ([0.0, 20.0, 50.0], [1510.0, 1500.0, 1515.0], 0.0, 7),
        ([0.0, 20.0, 50.0], [1515.0, 1500.0, 1510.0], 50.0, 7),
        ([0.0, 15.0, 15.0, 50.0], [1510.0, 1505.0, 1500.0, 1503.0], 15.0, 8),
    ],
)
def test_coincident_ends_on_a_boundary_or_a_jump_take_no_time_to_search(
    depths: list[float], speeds: list[float], at: float, count: int
) -> None:
    """In a process of its own: a search without an end could not be interrupted."""
    code = (
        "import numpy as np; from sonarsynth.equations.rays import ray_solutions as rays\n"
        f"water = rays.water(np.array({depths}), np.array({speeds}), 50.0)\n"
        f"found = rays.eigenrays(water, np.array([{at}]), np.array([{at}]), np.array([0.0]), 4, 4)\n"
        "print(len(found.pair), np.isfinite(found.travel_time).all(), (found.flag == rays.COINCIDENT).sum())"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=HANGING, check=True)
    rays_found, finite, coincident = run.stdout.split()
    assert finite == "True"
    assert int(coincident) in (1, 9 - count)
    assert int(rays_found) - int(coincident) == count


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize("distance", [1e-300, 1e-100, 1e-15, 1e-9, 1e-6])
def test_nearly_straight_up_and_down(name: str, distance: float) -> None:
    water = WATERS[name]
    level, near = one(water, 12.0, 31.0, 0.0), one(water, 12.0, 31.0, distance)
    for field in ("travel_time", "length", "amplitude", "start_sine", "end_sine"):
        np.testing.assert_allclose(getattr(near, field), getattr(level, field), rtol=1e-9, err_msg=field)
    np.testing.assert_allclose(near.slowness, distance * near.slowness[0] / distance, rtol=1.0, atol=1e-3 * distance)
    np.testing.assert_array_equal(near.upper, np.where(near.surface > 0, 0.0, np.nan))
    np.testing.assert_array_equal(near.lower, np.where(near.bottom > 0, water.depth[-1], np.nan))


@pytest.mark.parametrize("gradient", [0.0, *(s * 10.0**k for s in (1, -1) for k in (-13, -11, -9, -6, -3, -1))])
@pytest.mark.parametrize("depth", [1e-9, 1e-6, 1e-3, 5.0, 10.0 - 1e-3, 10.0 - 1e-6])
def test_between_two_points_of_one_depth_there_is_always_a_ray(gradient: float, depth: float) -> None:
    """However little the water bends it, and however near the surface: level, or turning where there is room for it."""
    water = ray_solutions.water(np.array([0.0, 10.0]), np.array([1500.0, 1500.0 + 10 * gradient]), 10.0)
    for distance in (1e-6, 1e-3, 1.0, 5.0):
        room = depth if gradient < 0 else 10.0 - depth
        if distance**2 * abs(gradient) / 12000 < 0.9 * room:
            found = one(water, depth, depth, distance, 2, 0)
            assert names(found) == [(0, 0, int(water.speed[0] != water.speed[1]))]
            assert found.travel_time[0] * 1500 / distance == pytest.approx(1.0, abs=1e-6 + 20 * abs(gradient) / 1500)
            assert found.amplitude[0] * distance == pytest.approx(1.0, abs=1e-6 + 20 * abs(gradient) / 1500)


@pytest.mark.parametrize("gradient", [s * 10.0**k for s in (1, -1) for k in range(-13, 5)])
def test_weak_to_violent_gradients(gradient: float) -> None:
    """A layer of that gradient, at most 20 m/s across, between two others."""
    thickness = min(10.0, 20.0 / abs(gradient))
    speed = 1500.0 + np.array([0.0, 0.0, gradient * thickness, gradient * thickness + 1.0])
    water = ray_solutions.water(np.array([0.0, 20.0, 20.0 + thickness, 50.0]), speed, 50.0)
    for start, end in (
        (5.0, 45.0),
        (20.0, 20.0 + thickness),
        (20.0 + thickness / 3, 20.0 + thickness / 2),
        (3.0, 20.0),
    ):
        for distance in (3.0, 300.0, 3e4):
            found = one(water, start, end, distance, 3, 3)
            check(water, found, start, end, distance, 3)
            if abs(gradient) > 1e-5:
                fan = families(water, start, end, np.array([distance]), 3, 3)[0]
                assert sorted(family(found, i) for i in range(len(found.pair))) == sorted(row[0] for row in fan)


def test_a_hundred_kilometres_in_eleven_kilometres_of_water_and_twelve_vertices() -> None:
    depth = np.array([0.0, 50.0, 200.0, 1000.0, 1300.0, 4000.0, 11000.0])
    water = ray_solutions.water(depth, np.array([1540.0, 1539.0, 1515.0, 1483.0, 1482.0, 1522.0, 1645.0]), 11000.0)
    for start, end in ((1000.0, 1300.0), (10.0, 4000.0), (0.0, 11000.0)):
        found = one(water, start, end, 1e5, 12, 12)
        assert len(found.pair) > 10
        check(water, found, start, end, 1e5)
        fan = families(water, start, end, np.array([1e5]), 12, 12)[0]
        assert sorted(family(found, i) for i in range(len(found.pair))) == sorted(row[0] for row in fan)


@pytest.mark.parametrize("name", WATERS)
@pytest.mark.parametrize(
    ("start", "end"),
    [(0.0, 22.0), (22.0, 0.0), (0.0, 1e9), (1e9, 1e9), (0.0, 0.0), (22.0, 1e9), (15.0, 33.0), (20.0, 3.0)],
)
def test_ends_on_nodes_and_boundaries_are_the_limit_of_ends_beside_them(name: str, start: float, end: float) -> None:
    water = WATERS[name]
    a, b = min(start, water.depth[-1]), min(end, water.depth[-1])
    inwards = [z + (1e-9 if z == 0 else -1e-9) if z in (0.0, water.depth[-1]) else z for z in (a, b)]
    if a not in (0.0, water.depth[-1]):  # a jump: the side that faces the other end
        inwards[0] = a + 1e-9 * np.sign(b - a)
    for distance in (0.1, 30.0, 777.0):
        on, off = one(water, a, b, distance), one(water, *inwards, distance)
        assert names(on) == names(off)
        np.testing.assert_allclose(on.travel_time, off.travel_time, rtol=1e-9, atol=1e-11)
        sharp = (on.flag != ray_solutions.CAUSTIC) & (off.flag != ray_solutions.CAUSTIC)
        np.testing.assert_allclose(on.length[sharp], off.length[sharp], rtol=1e-5)


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-12, 1e-6])
@pytest.mark.parametrize("distance", [0.0, 1e-6, 1e-3])
def test_ends_a_micrometre_apart(gap: float, distance: float) -> None:
    for water in WATERS.values():
        for depth in (10.0, 20.0, 33.3):
            found = one(water, depth, depth + gap, distance)
            far = np.hypot(depth + gap - depth, distance)
            assert found.travel_time[0] * 1500 == pytest.approx(far, rel=0.03, abs=1e-13)
            same = found.flag == ray_solutions.COINCIDENT
            assert same.sum() == (far == 0)
            assert np.isfinite(found.amplitude[~same]).all()
            hits = found.surface + found.bottom
            assert [int((hits == k).sum()) for k in (1, 2, 3, 4)] == [2, 2, 2, 2]


def test_nodes_named_twice_change_nothing() -> None:
    once = np.array([0.0, 10.0, 20.0, 50.0]), np.array([1510.0, 1505.0, 1500.0, 1515.0])
    twice = [np.repeat(v, [1, 2, 3, 1]) for v in once]
    for start, end, distance in ((3.0, 44.0, 200.0), (10.0, 20.0, 30.0), (20.0, 20.0, 90.0), (0.0, 10.0, 400.0)):
        a, b = (one(ray_solutions.water(*v, 50.0), start, end, distance) for v in (once, twice))
        assert names(a) == names(b)
        np.testing.assert_allclose(a.travel_time, b.travel_time, rtol=1e-15)
        np.testing.assert_allclose(a.amplitude, b.amplitude, rtol=1e-9)
        np.testing.assert_array_equal(a.flag, b.flag)


def test_turning_exactly_at_a_node_is_one_ray() -> None:
    water = ray_solutions.water(np.array([0.0, 30.0, 50.0]), np.array([1500.0, 1512.0, 1516.0]), 50.0)
    ends = 1500.0 + 0.4 * np.array([5.0, 12.0])
    r = np.sum(np.sqrt((1512.0 - ends) * (1512.0 + ends))) / 0.4  # down to the node, where it is level, and up
    for step in (0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6):
        found = one(water, 5.0, 12.0, r * (1 + step), 1, 0)
        mine = (found.turning == 1) & (abs(found.lower - 30.0) < 1e-3)
        assert mine.sum() == 1
        assert found.lower[mine][0] == pytest.approx(30.0, abs=1e-7 + 1e3 * abs(step))
