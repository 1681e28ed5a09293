"""Laws of eigenrays of all families in any water: reciprocity, mirrors, scales, Snell, slopes of their times."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.references.rays.followed_rays import families, follow, nodes
from tests.ray_paths import family, images

BOTTOM_DEPTH = 100.0
nodes_of_water = st.lists(
    st.tuples(st.integers(0, 1000), st.integers(14900, 15100) | st.sampled_from([15000, 15010])), min_size=1, max_size=8
)
ends = st.integers(0, 999).map(lambda k: k / 10 + 0.05)  # never on a node
distances = st.floats(-1, 4).map(lambda x: 10.0**x)
pairs = st.lists(st.tuples(ends, ends, distances), min_size=1, max_size=4)
few = settings(max_examples=60)


@st.composite
def waters(draw: st.DrawFn) -> ray_solutions.Water:
    """Up to eight nodes on a grid of 0.1 m and 0.1 m/s: jumps and layers of one speed are common."""
    rows = sorted(draw(nodes_of_water), key=lambda row: row[0])
    return ray_solutions.water(np.array([z / 10 for z, _ in rows]), np.array([c / 10 for _, c in rows]), BOTTOM_DEPTH)


def trace(
    water: ray_solutions.Water, ends_and_distances: list[tuple[float, float, float]], vertices: int = 4
) -> ray_solutions.Eigenrays:
    start, end, distance = np.array(ends_and_distances).T
    return ray_solutions.eigenrays(water, start, end, distance, vertices, 3)


def key(found: ray_solutions.Eigenrays) -> Ints:
    """Order by pair, family and time: the same for rays that differ by rounding."""
    sign = np.sign(found.start_sine)
    return np.lexsort([found.travel_time, sign, found.turning, found.bottom, found.surface, found.pair])


def same(one: ray_solutions.Eigenrays, two: ray_solutions.Eigenrays, rtol: float = 1e-13) -> None:
    """Two sets of rays are the same to rounding; angles and amplitudes where a caustic does not blow rounding up."""
    a, b = key(one), key(two)
    for name in ("pair", "surface", "bottom", "turning"):
        np.testing.assert_array_equal(getattr(one, name)[a], getattr(two, name)[b], err_msg=name)
    np.testing.assert_allclose(one.travel_time[a], two.travel_time[b], rtol=rtol)
    sharp = (one.flag[a] != ray_solutions.CAUSTIC) & (two.flag[b] != ray_solutions.CAUSTIC)
    np.testing.assert_array_equal(one.caustics[a][sharp], two.caustics[b][sharp])
    for name in ("start_sine", "end_sine"):
        np.testing.assert_allclose(getattr(one, name)[a][sharp], getattr(two, name)[b][sharp], atol=1e-9)
    for name in ("length", "slowness", "start_speed", "end_speed"):
        np.testing.assert_allclose(getattr(one, name)[a][sharp], getattr(two, name)[b][sharp], rtol=1e-10)
    np.testing.assert_allclose(one.amplitude[a][sharp], two.amplitude[b][sharp], rtol=1e-8)
    for name in ("upper", "lower"):
        np.testing.assert_allclose(getattr(one, name)[a][sharp], getattr(two, name)[b][sharp], atol=1e-7)


def altered(found: ray_solutions.Eigenrays, **changes: Floats | Ints) -> ray_solutions.Eigenrays:
    return ray_solutions.Eigenrays(**(vars(found) | changes))


@few
@given(waters(), pairs)
def test_there_and_back(water: ray_solutions.Water, rows: list[tuple[float, float, float]]) -> None:
    there, back = trace(water, rows), trace(water, [(b, a, r) for a, b, r in rows])
    turned = altered(
        back,
        start_sine=-back.end_sine,
        end_sine=-back.start_sine,
        start_speed=back.end_speed,
        end_speed=back.start_speed,
    )
    same(there, turned)


@few
@given(waters(), pairs)
def test_upside_down(water: ray_solutions.Water, rows: list[tuple[float, float, float]]) -> None:
    mirrored = ray_solutions.Water(BOTTOM_DEPTH - water.depth[::-1], water.speed[::-1].copy())
    above, below = trace(water, rows), trace(mirrored, [(BOTTOM_DEPTH - a, BOTTOM_DEPTH - b, r) for a, b, r in rows])
    turned = altered(
        below,
        start_sine=-below.start_sine,
        end_sine=-below.end_sine,
        surface=below.bottom,
        bottom=below.surface,
        upper=BOTTOM_DEPTH - below.lower,
        lower=BOTTOM_DEPTH - below.upper,
    )
    same(above, turned)


@few
@given(waters(), pairs, st.lists(st.integers(0, 1000), min_size=1, max_size=6))
def test_splitting_layers_changes_nothing(
    water: ray_solutions.Water, rows: list[tuple[float, float, float]], cuts: list[int]
) -> None:
    extra = np.array([z for z in sorted({k / 10 + 0.03 for k in cuts}) if z < BOTTOM_DEPTH])
    depth = np.concatenate([water.depth, extra])
    speed = np.concatenate([water.speed, np.interp(extra, water.depth, water.speed)])
    order = np.argsort(depth, kind="stable")
    same(trace(water, rows), trace(ray_solutions.Water(depth[order], speed[order]), rows))


@few
@given(waters(), pairs, st.integers(-20, 20), st.integers(-6, 6))
def test_scales_of_depth_and_of_speed(
    water: ray_solutions.Water, rows: list[tuple[float, float, float]], k: int, m: int
) -> None:
    size, fast = 2.0**k, 2.0**m
    scaled = trace(
        ray_solutions.Water(water.depth * size, water.speed * fast),
        [(a * size, b * size, r * size) for a, b, r in rows],
    )
    back = altered(
        scaled,
        travel_time=scaled.travel_time * fast / size,
        length=scaled.length / size,
        slowness=scaled.slowness * fast,
        start_speed=scaled.start_speed / fast,
        end_speed=scaled.end_speed / fast,
        amplitude=scaled.amplitude * size,
        upper=scaled.upper / size,
        lower=scaled.lower / size,
    )
    same(trace(water, rows), back)


@few
@given(waters(), pairs)
def test_other_pairs_change_no_bit(water: ray_solutions.Water, rows: list[tuple[float, float, float]]) -> None:
    together = trace(water, rows)
    alone = [trace(water, [row]) for row in rows]
    for name, values in vars(together).items():
        if name != "pair":
            np.testing.assert_array_equal(values, np.concatenate([getattr(one, name) for one in alone]), err_msg=name)
    assert np.array_equal(together.pair, np.repeat(np.arange(len(rows)), [len(one.pair) for one in alone]))


@few
@given(waters(), pairs)
def test_fewer_vertices_give_the_rays_with_fewer_vertices(
    water: ray_solutions.Water, rows: list[tuple[float, float, float]]
) -> None:
    start, end, distance = np.array(rows).T
    every = ray_solutions.eigenrays(water, start, end, distance, 5, 5)
    for vertices, reflections in ((3, 3), (5, 2), (1, 0), (0, 0), (2, 1)):
        some = ray_solutions.eigenrays(water, start, end, distance, vertices, reflections)
        hits = every.surface + every.bottom
        keep = (hits + every.turning <= vertices) & (hits <= reflections)
        for name, values in vars(some).items():
            np.testing.assert_array_equal(values, getattr(every, name)[keep], err_msg=name)


@few
@given(waters(), pairs)
def test_snell_along_the_whole_ray(water: ray_solutions.Water, rows: list[tuple[float, float, float]]) -> None:
    found = trace(water, rows)
    for sine, speed in ((found.start_sine, found.start_speed), (found.end_sine, found.end_speed)):
        np.testing.assert_allclose(np.hypot(sine, found.slowness * speed), 1.0, rtol=1e-14)
    slowest = np.array([np.min(water.speed)])
    assert (found.slowness * slowest <= 1 + 1e-14).all()
    for vertex in (found.upper, found.lower):
        inside = np.isfinite(vertex) & (vertex > 0) & (vertex < BOTTOM_DEPTH)
        off = np.min(np.abs(vertex[:, None] - water.depth), axis=1)
        smooth = inside & (off > 1e-9)
        level = np.interp(vertex[smooth], water.depth, water.speed)
        np.testing.assert_allclose(1 / found.slowness[smooth], level, rtol=1e-13)
        at = np.abs(vertex[:, None] - water.depth) <= 1e-9  # on a jump, or by chance on a node
        reached = np.where(at, water.speed, 0.0).max(axis=1)
        assert (1 / found.slowness <= reached * (1 + 1e-13))[inside & ~smooth].all()


@few
@given(waters(), ends, ends, st.floats(0.5, 3.5))
def test_slopes_of_the_travel_time_are_the_slownesses_of_the_ray(
    water: ray_solutions.Water, start: float, end: float, power: float
) -> None:
    """A slope by differences is the mean of the slowness between the two neighbours."""
    r = 10.0**power
    moves = ((0, 0, 1e-5 * r), (1e-5, 0, 0), (0, 1e-5, 0))
    slowness = (
        lambda f: f.slowness,
        lambda f: f.start_sine / f.start_speed,
        lambda f: -f.end_sine / f.end_speed,
    )
    for move, of in zip(moves, slowness, strict=True):
        here = np.array([start, end, r])
        found = [trace(water, [tuple(here + k * np.array(move))]) for k in (-1, 0, 1)]
        names = [[family(f, i) for i in range(len(f.pair))] for f in found]
        for i, name in enumerate(names[1]):
            if all(n.count(name) == 1 for n in names):
                before, after = names[0].index(name), names[2].index(name)
                step = 2 * max(move)
                slope = (found[2].travel_time[after] - found[0].travel_time[before]) / step
                values = [of(found[0])[before], of(found[1])[i], of(found[2])[after]]
                rounding = 2e-15 * found[1].travel_time[i] / step
                assert min(values) - rounding <= slope <= max(values) + rounding


@few
@given(waters(), ends, ends, st.floats(0.5, 3.5))
def test_amplitudes_are_those_of_a_ray_tube(water: ray_solutions.Water, start: float, end: float, power: float) -> None:
    """Range of two neighbouring rays, followed in long doubles."""
    found = trace(water, [(start, end, 10.0**power)])
    z, c = nodes(water, (start, end))
    for i in np.flatnonzero((found.start_sine != 0) & (found.flag != ray_solutions.CAUSTIC)):
        up, surface, bottom, turning, _ = family(found, i)
        p = np.longdouble(found.slowness[i])
        x = []
        for q in (p * (1 - np.longdouble(1e-11)), p * (1 + np.longdouble(1e-11))):
            visits = follow(z, c, (np.longdouble(start), np.longdouble(end)), q, up, 4, 3)
            x += [v.range for v in visits if (v.surface, v.bottom, v.turning) == (surface, bottom, turning)]
        sines = abs(found.start_sine[i] * found.end_sine[i])
        if len(x) < 2 or sines < 1e-4:
            continue  # one of the two turns elsewhere
        slope = float((x[1] - x[0]) / (2e-11 * p))
        area = 10.0**power * abs(slope) * sines / found.slowness[i]
        expected = np.sqrt(found.start_speed[i] * found.end_speed[i] / area)
        assert abs(found.amplitude[i] / expected - 1) < 1e-5


@few
@given(waters(), ends, ends, distances.filter(lambda r: r > 2))
def test_a_fan_of_rays_finds_the_same_families(
    water: ray_solutions.Water, start: float, end: float, distance: float
) -> None:
    found = trace(water, [(start, end, distance)], 3)
    fan = families(water, start, end, np.array([distance]), 3, 3)[0]
    assert sorted(family(found, i) for i in range(len(found.pair))) == sorted(row[0] for row in fan)


@few
@given(st.floats(-13, -9), st.sampled_from([-1, 1]), ends, ends, st.floats(-1, 3))
def test_a_vanishing_gradient_goes_over_into_image_sources(
    power: float, sign: int, start: float, end: float, distance: float
) -> None:
    r, g = 10.0**distance, sign * 10.0**power
    water = ray_solutions.water(
        np.array([0.0, BOTTOM_DEPTH]), np.array([1500.0 - 50 * g, 1500.0 + 50 * g]), BOTTOM_DEPTH
    )
    found = ray_solutions.eigenrays(water, np.array([start]), np.array([end]), np.array([r]), 4, 4)
    rows = images(BOTTOM_DEPTH, start, end, 4)
    bend = abs(g) * (r + 5 * BOTTOM_DEPTH) / 1500.0
    assert len(found.pair) == len(rows)
    order = np.lexsort([np.sign(found.start_sine), found.bottom, found.surface])
    for i, (up, surface, bottom, arrives, height) in zip(
        order, sorted(rows, key=lambda row: (*row[1:3], row[0])), strict=True
    ):
        d = np.hypot(r, height)
        assert (found.surface[i], found.bottom[i]) == (surface, bottom)
        assert found.turning[i] == (start == end and surface + bottom == 0)
        assert abs(found.travel_time[i] * 1500 / d - 1) < bend + 1e-12
        assert abs(found.amplitude[i] * d - 1) < bend + 1e-7
        assert abs(found.start_sine[i] - up * height / d) < bend + 1e-12
        assert abs(found.end_sine[i] - arrives * height / d) < bend + 1e-12
        assert found.caustics[i] == 0
