"""All families of eigenrays against image sources, closed forms, 50 digits followed leg by leg, and a dense fan."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions
from tests.following import Visit, families, family, images, nodes, random_water, solve_again


@pytest.mark.parametrize(("vertices", "reflections"), [(6, 6), (6, 3), (2, 4), (1, 1), (3, 0), (0, 2)])
def test_uniform_water_has_image_sources(vertices: int, reflections: int) -> None:
    rng = np.random.default_rng(vertices)
    bottom_depth, c, size = 31.0, 1520.0, 60
    water = ray_solutions.water(np.array([0.0, 7.0, 20.0]), np.full(3, c), bottom_depth)
    z1, z2 = rng.uniform(0, bottom_depth, (2, size))
    r = 10 ** rng.uniform(-4, 5, size)
    z1[:20], z2[10:30], r[25:35] = rng.choice([0.0, 7.0, 31.0], 20), rng.choice([0.0, 20.0, 31.0], 20), 0.0
    z2[40:50] = z1[40:50]
    boundary = (z1 == z2) & ((z1 == 0) | (z1 == bottom_depth))
    z2[boundary] = 5.0
    found = ray_solutions.eigenrays(water, z1, z2, r, vertices, reflections)
    for i in range(size):
        expected = sorted(
            images(bottom_depth, z1[i], z2[i], min(vertices, reflections)), key=lambda row: (*row[1:3], row[0])
        )
        mine = np.flatnonzero(found.pair == i)
        assert (np.diff(found.travel_time[mine]) >= 0).all()
        order = np.lexsort([found.start_sine[mine], found.bottom[mine], found.surface[mine]])
        assert len(mine) == len(expected)
        for k, (up, surface, bottom, arrives, height) in zip(mine[order], expected, strict=True):
            d = np.hypot(height, r[i])
            assert (found.surface[k], found.bottom[k], found.turning[k]) == (surface, bottom, 0)
            assert found.caustics[k] == 0
            assert found.flag[k] == (ray_solutions.GOOD if d > 0 else ray_solutions.COINCIDENT)
            assert found.start_speed[k] == found.end_speed[k] == c
            assert abs(found.travel_time[k] * c - d) <= 4e-15 * d
            assert abs(found.length[k] - d) <= 4e-15 * d
            if d > 0:
                assert abs(found.amplitude[k] * d - 1) < 1e-13
                assert abs(found.start_sine[k] - up * height / d) < 1e-14
                assert abs(found.end_sine[k] - arrives * height / d) < 1e-14
                assert abs(found.slowness[k] * c - r[i] / d) < 1e-14
                np.testing.assert_equal(found.upper[k], 0.0 if surface else np.nan)
                np.testing.assert_equal(found.lower[k], bottom_depth if bottom else np.nan)


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


def bare(water: ray_solutions.Water, depth: float, up: int) -> mp.mpf:
    """Speed at a depth that is not on a jump, to all digits."""
    z, c = nodes(water, (depth, depth), mp.mpf)
    return c[z.index(mp.mpf(depth))]


PROFILES = [(2, 5.0, 1), (5, 3.0, 2), (9, 20.0, 3), (12, 1.0, 4), (6, 1e-3, 5), (4, 1e-8, 6)]


@pytest.mark.parametrize(("layers", "spread", "seed"), PROFILES)
def test_every_number_of_a_ray_to_many_digits(layers: int, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = turned = 0
    for _ in range(8):
        water = random_water(rng, layers, spread)
        start, end = rng.uniform(0, 100, (2, 3))
        end[0] = rng.choice(water.depth[:2])
        distance = 10 ** rng.uniform(2, 4, 3) / np.sqrt(min(1.0, spread))
        found = ray_solutions.eigenrays(water, start, end, distance, 5, 4)
        order = rng.permutation(len(found.pair))
        for i in [*order[found.turning[order] > 0][:5], *order[found.turning[order] == 0][:5]]:
            a, b, r = (float(v[found.pair[i]]) for v in (start, end, distance))
            if found.flag[i] == ray_solutions.CAUSTIC or kinked(water, found, i):
                continue
            with mp.workdps(60):
                p, visit = solve_again(water, a, b, mp.mpf(r), found, int(i))
                compare(water, a, b, p, visit, found, int(i))
            seen += 1
            turned += found.turning[i] > 0
    assert seen > 35
    assert turned > 5


def kinked(water: ray_solutions.Water, found: ray_solutions.Eigenrays, i: int) -> bool:
    """Whether a turning depth is so near to a node that 16 digits cannot tell on which side."""
    vertices = [v for v in (found.upper[i], found.lower[i]) if np.isfinite(v) and 0 < v < water.depth[-1]]
    return any(0 < np.min(np.abs(water.depth - v)) < 1e-9 for v in vertices)


def compare(
    water: ray_solutions.Water,
    start: float,
    end: float,
    p: mp.mpf,
    visit: Visit,
    found: ray_solutions.Eigenrays,
    i: int,
) -> None:
    x, time, length, slope = visit.sums
    assert abs(found.travel_time[i] - time) <= 1e-13 * min(1, time) + 2e-15 * time
    assert abs(found.travel_time[i] / time - 1) < 5e-15
    assert abs(found.length[i] / length - 1) < 1e-9
    assert np.sign(found.end_sine[i]) == visit.up
    sines = []
    for depth, sine, speed in (
        (start, found.start_sine[i], found.start_speed[i]),
        (end, found.end_sine[i], found.end_speed[i]),
    ):
        c = bare(water, depth, visit.up)
        assert abs(speed / c - 1) < 1e-15
        sines.append(mp.sqrt(1 - (p * c) ** 2))
        assert abs(np.arctan2(abs(sine), found.slowness[i] * speed) - mp.asin(sines[-1])) < 1e-9
    amplitude = mp.sqrt(p * bare(water, start, 1) * bare(water, end, 1) / (x * abs(slope) * sines[0] * sines[1]))
    rounded = 1e-12 / np.ptp(water.speed)  # of the speeds at the ends, against what bends the ray
    assert abs(found.amplitude[i] / amplitude - 1) < 1e-9 + 100 * rounded
    for depth, vertex in ((found.upper[i], visit.upper), (found.lower[i], visit.lower)):
        if vertex is None:
            assert np.isnan(depth)
        else:
            assert abs(depth - vertex) < 1e-9 + 100 * rounded
    assert found.caustics[i] == (visit.turning - (slope < 0) if visit.turning else 0)


@pytest.mark.parametrize(
    ("layers", "spread", "vertices", "reflections", "size"),
    [
        (1, 5.0, 4, 4, 3),
        (3, 5.0, 4, 4, 12),
        (6, 10.0, 4, 2, 12),
        (9, 40.0, 3, 3, 12),
        (12, 2.0, 8, 1, 6),
        (15, 5.0, 3, 0, 6),
    ],
)
def test_no_family_is_missed_and_no_ray_comes_twice(
    layers: int, spread: float, vertices: int, reflections: int, size: int
) -> None:
    rng = np.random.default_rng(layers)
    for k in range(size):
        water = random_water(rng, layers, spread)
        start, end = ends(rng, water, k)
        distance = 10 ** rng.uniform(0.5, 3.8, 16)
        found = ray_solutions.eigenrays(water, np.full(16, start), np.full(16, end), distance, vertices, reflections)
        fan = families(water, start, end, distance, vertices, reflections)
        for i in range(16):
            mine = np.flatnonzero(found.pair == i)
            assert sorted(family(found, j) for j in mine) == sorted(f for f, _, _ in fan[i])
            for f, low, high in fan[i]:  # one in each bracket: none twice
                width = 1e-12 * high + 1e-9 * (high - low)
                near = [j for j in mine if low - width <= found.slowness[j] <= high + width and family(found, j) == f]
                assert len(near) == 1
        assert (np.diff(found.pair) >= 0).all()
        assert (np.diff(found.travel_time)[np.diff(found.pair) == 0] >= 0).all()


def ends(rng: np.random.Generator, water: ray_solutions.Water, k: int) -> tuple[float, float]:
    """Two depths: at random, the same, on surface, bottom and nodes."""
    a, b = rng.uniform(0, 100, 2)
    choice: Floats = np.array([[a, b], [a, a], [0, b], [a, 100], [0, 100], [a, water.depth[len(water.depth) // 2]]])
    return float(choice[k % 6, 0]), float(choice[k % 6, 1])
