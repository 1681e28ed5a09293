"""Formulas of sound speed against published values, closed forms, and rays integrated through the formulas."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth import Cast, Catenary, Environment, Linear, Munk, Thermocline, eigenrays
from sonarsynth.conventions import Floats
from sonarsynth.environment.casts import profile_of, smoothed
from sonarsynth.environment.profiles import munk, munk_nodes, nearest
from sonarsynth.environment.sea import Profile

MUNK = munk(1300.0, 1300.0, 0.00737, 1500.0)


def test_munk_has_the_published_values() -> None:
    depth = np.array([0, 200, 400, 600, 800, 1000, 1200, 1400, 1600, 1800, 2000, 2400, 3000, 5000.0])
    table = [1548.52, 1530.29, 1517.78, 1509.49, 1504.30, 1501.38, 1500.14, 1500.12, 1501.02, 1502.57, 1504.62]
    table += [1509.69, 1518.67, 1551.91]  # the Munk case of the Acoustics Toolbox
    np.testing.assert_allclose(MUNK.speed(depth), table, atol=0.006)
    np.testing.assert_allclose(profile_of(Munk()).at(depth), table, atol=0.02)


def test_the_slopes_of_munk_are_those_of_its_speed() -> None:
    z, step = np.linspace(100.0, 6000.0, 60), 1.0
    rise = (MUNK.speed(z + step) - MUNK.speed(z - step)) / (2 * step)
    bend = (MUNK.speed(z + step) - 2 * MUNK.speed(z) + MUNK.speed(z - step)) / step**2
    np.testing.assert_allclose(MUNK.gradient(z), rise, rtol=1e-4, atol=1e-8)
    np.testing.assert_allclose(MUNK.curvature(z), bend, rtol=1e-3, atol=1e-8)


def great_circle(g: float, c: float, axis: float, start: Floats, end: Floats, distance: Floats) -> Floats:
    """Angles (rad) from source to receiver on the sphere that c cosh((z - axis)/g) is a Mercator chart of."""
    first, second = (np.arctan(np.sinh((z - axis) / g)) for z in (start, end))
    hav = np.sin((first - second) / 2) ** 2 + np.cos(first) * np.cos(second) * np.sin(distance / g / 2) ** 2
    return 2 * np.arctan2(np.sqrt(hav), np.sqrt(1 - hav))


def test_rays_of_the_catenary_are_great_circles() -> None:
    """With metric ds/c the profile c1 cosh((z - z1)/g) is a sphere: times are arcs, tubes open like sin(arc)."""
    g, c, axis = 4000.0, 1500.0, 2000.0
    rng = np.random.default_rng(8)
    start, end = rng.uniform(1200.0, 2800.0, (2, 60))
    distance = rng.uniform(2e3, 11e3, 60)
    found = eigenrays(Catenary(axis_depth=axis, scale=g, axis_speed=c, tolerance=1e-7), 8e3, start, end, distance)
    direct = found.select(found.surface + found.bottom == 0)
    arc = great_circle(g, c, axis, start, end, distance)
    np.testing.assert_allclose(direct.travel_time, g / c * arc[direct.pair], rtol=0, atol=2e-7)
    assert (np.bincount(direct.pair, minlength=60)[distance < 2.5 * g] == 1).all()  # the focus lies at pi g
    clear = distance[direct.pair] < 2.0 * g
    pair = direct.pair[clear]
    spread = np.sqrt(direct.ray_parameter[clear] * c / (g * np.sin(arc[pair]) * distance[pair]))
    wrong = np.abs(direct.amplitude[clear] / spread - 1)
    assert np.median(wrong) < 1e-3
    assert wrong.max() < 0.1


def test_linear_water_has_the_closed_form() -> None:
    rng = np.random.default_rng(9)
    start, end, distance = rng.uniform(0, 3000, 50), rng.uniform(0, 3000, 50), rng.uniform(10, 9e3, 50)
    found = eigenrays(Linear(surface_speed=1480.0, gradient=0.0163), 20e3, start, end, distance, vertices=1)
    direct = found.select((found.surface + found.bottom) == 0)
    c1, c2 = 1480.0 + 0.0163 * start, 1480.0 + 0.0163 * end
    chord = np.hypot(distance, start - end)
    time = 2 / 0.0163 * np.arcsinh(0.5 * 0.0163 * chord / np.sqrt(c1 * c2))
    np.testing.assert_allclose(direct.travel_time, time[direct.pair], rtol=1e-12)
    assert set(range(50)) == set(direct.pair.tolist())


def test_the_thermocline_is_three_straight_pieces() -> None:
    profile = profile_of(Thermocline(surface_speed=1540.0, mixed_depth=5.0, thickness=1.5, drop=6.45, gradient=0.0))
    assert len(profile.depth) == 4
    np.testing.assert_allclose(profile.at(np.array([0, 5, 5.75, 6.5, 30])), [1540, 1540, 1536.775, 1533.55, 1533.55])
    steepest = np.diff(profile_of(Thermocline()).speed)[1] / 1.5
    assert steepest == pytest.approx(-4.3)
    jump = profile_of(Thermocline(thickness=0.0))
    assert jump.depth[1] == jump.depth[2]


@pytest.mark.parametrize("gradient", [0.0, 1e-13, -1e-13, 0.0163, -0.1, 1e4, -1e4])
def test_linear_keeps_its_gradient_until_no_water_is_like_it(gradient: float) -> None:
    profile = profile_of(Linear(surface_speed=1500.0, gradient=gradient))
    end = profile.depth[-1]
    assert profile.at(0.0) == 1500.0
    assert profile.at(end / 3) == pytest.approx(1500.0 + gradient * end / 3, rel=1e-14)
    assert 100.0 <= profile.speed.min() <= profile.speed.max() <= 10e3
    assert profile.uniform == (gradient == 0.0)


def test_formulas_that_no_water_follows_are_refused() -> None:
    for wrong in (
        lambda: Munk(scale=100.0),
        lambda: Munk(scale=1e-300),
        lambda: Catenary(axis_depth=10.0, scale=1e-3),
        lambda: Thermocline(drop=1500.0),
        lambda: Thermocline(drop=-9000.0),
    ):
        with pytest.raises(ValueError, match=r"the sound speed at .* m is .* m/s; it must be 100 to 10000 m/s"):
            wrong()
    with pytest.raises(
        ValueError, match="linear, goes down to 1400 m, where it is 100 m/s: not to the bottom at 1500 m"
    ):
        Environment(depth=1500.0, sound_speed=Linear(surface_speed=1500.0, gradient=-1.0))
    assert Environment(depth=1300.0, sound_speed=Linear(surface_speed=1500.0, gradient=-1.0)).depth == 1300.0
    with pytest.raises(ValueError, match="not to the bottom at 20000 m"):
        eigenrays(Munk(), 20e3, 10.0, 10.0, 10.0)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
def test_layers_are_orderly_at_the_ends_of_the_tolerance(tolerance: float) -> None:
    depth, speed = munk_nodes(1300.0, 1300.0, 0.00737, 1500.0, tolerance)
    assert depth[0] == 0.0 and depth[-1] == 12e3 and (np.diff(depth) > 0).all()
    assert len(depth) < 3000
    assert np.abs(speed - MUNK.speed(depth)).max() < {1e-3: 3.0, 1e-9: 1e-4}[tolerance]
    assert profile_of(Munk(epsilon=0.0)).uniform


def test_the_nearest_profile_keeps_mean_and_moment_of_what_it_stands_for() -> None:
    node = np.array([0.0, 300.0, 1500.0, 1800.0, 5000.0])
    speed = nearest(node, node, MUNK.speed)
    z = np.linspace(0.0, 5000.0, 500_001)
    left = np.interp(z, node, speed) - MUNK.speed(z)
    for hat in np.eye(5):
        assert abs(np.trapezoid(left * np.interp(z, node, hat), z)) < 1e-4  # m2/s: of 1e6
    assert np.abs(left).max() > 1.0


def noisy_cast(folder, smoothing=None):
    rng = np.random.default_rng(3)
    depth = np.arange(0.0, 40.01, 0.1)
    speed = 1540.0 - 0.05 * depth + rng.normal(0, 0.1, len(depth))
    path = folder / "cast.csv"
    path.write_text("Depth (m),Sound speed (m/s)\n" + "".join(f"{z},{c}\n" for z, c in zip(depth, speed, strict=True)))
    return depth, speed, profile_of(Cast(path=str(path), smoothing=smoothing))


def test_a_cast_is_smoothed_only_if_asked(tmp_path):
    depth, speed, kept = noisy_cast(tmp_path)
    np.testing.assert_array_equal(kept.depth, depth)
    np.testing.assert_array_equal(kept.speed, speed)
    _, _, smooth = noisy_cast(tmp_path, smoothing=4.0)
    np.testing.assert_allclose(smooth.depth, np.arange(0.0, 40.1, 4.0), atol=1e-12)
    true = 1540.0 - 0.05 * smooth.depth
    assert np.std(smooth.speed - true) < 0.5 * np.std(speed - (1540.0 - 0.05 * depth))
    assert not smooth.speed.flags.writeable


@pytest.mark.parametrize("thickness", [0.03, 0.7, 4.0, 1e3])
def test_smoothing_keeps_straight_profiles_and_means(thickness: float) -> None:
    rng = np.random.default_rng(4)
    depth = np.sort(rng.uniform(1.0, 30.0, 50))
    depth[20] = depth[21]  # a jump
    line = Profile(depth, 1500.0 + 0.3 * depth)
    still = smoothed(line, thickness)
    np.testing.assert_allclose(still.speed, 1500.0 + 0.3 * still.depth, rtol=1e-13)
    rough = Profile(depth, 1500.0 + rng.normal(size=50))
    smooth = smoothed(rough, thickness)
    assert (smooth.depth[0], smooth.depth[-1]) == (depth[0], depth[-1])
    assert np.diff(smooth.depth).max() <= thickness * (1 + 1e-9)
    means = [np.trapezoid(p.speed, p.depth) / (depth[-1] - depth[0]) for p in (rough, smooth)]
    assert means[0] == pytest.approx(means[1], rel=1e-13)
    assert np.std(smooth.speed) < 1.2 * np.std(rough.speed)


def test_smoothing_has_limits() -> None:
    with pytest.raises(ValueError, match="more than 100000"):
        smoothed(Profile(np.array([0.0, 40.0]), np.array([1500.0, 1501.0])), 1e-6)
    one = Profile(np.array([3.0]), np.array([1500.0]))
    assert smoothed(one, 1.0) is one
    with pytest.raises(ValueError, match="greater than 0"):
        Cast(path="cast.csv", smoothing=0.0)
