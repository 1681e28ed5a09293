"""Degenerate geometry and stiff profiles: an answer or a reason, never a wrong number."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.rays import ray_solutions

UNIFORM = ray_solutions.water(np.array([0.0]), np.array([1500.0]), 50.0)


def one(water: ray_solutions.Water, start: float, end: float, distance: float) -> ray_solutions.Eigenrays:
    return ray_solutions.eigenrays(water, np.array([start]), np.array([end]), np.array([distance]))


@pytest.mark.parametrize("gap", [0.0, 5e-324, 1e-300, 1e-200, 1e-150, 1e-120, 1e-30, 1e-16])
def test_ends_at_nearly_one_depth(gap: float) -> None:
    found = one(UNIFORM, 0.0, gap, 7.0)
    assert found.travel_time[0] == pytest.approx(7.0 / 1500.0, rel=1e-15)
    assert found.amplitude[0] == pytest.approx(1 / 7.0, rel=1e-14)
    assert found.start_sine[0] == pytest.approx(-gap / 7.0, rel=1e-9, abs=1e-140)


def test_layers_without_thickness_that_jump_there_and_back_are_not_there() -> None:
    plain = ray_solutions.water(np.array([0.0, 30.0]), np.array([1500.0, 1503.0]), 30.0)
    spiked = ray_solutions.water(
        np.array([0.0, 10.0, 10.0, 10.0, 30.0]), np.array([1500.0, 1501.0, 1400.0, 1501.0, 1503.0]), 30.0
    )
    a, b = one(plain, 2.0, 25.0, 60.0), one(spiked, 2.0, 25.0, 60.0)
    np.testing.assert_allclose(a.travel_time, b.travel_time, rtol=1e-14)
    np.testing.assert_allclose(a.amplitude, b.amplitude, rtol=1e-10)


def test_a_fast_sheet_without_thickness_turns_flat_rays_back_and_lets_steep_ones_through() -> None:
    water = ray_solutions.water(
        np.array([0.0, 10.0, 10.0, 10.0, 30.0]), np.array([1500.0, 1500.0, 1600.0, 1500.0, 1500.0]), 30.0
    )
    assert len(one(water, 5.0, 15.0, 5.0).pair) == 1
    assert len(one(water, 5.0, 15.0, 500.0).pair) == 0
    returned = one(water, 5.0, 5.0, 500.0)
    assert sorted(np.fmax(returned.upper, returned.lower), key=str) == [10.0, pytest.approx(np.nan, nan_ok=True)]


@pytest.mark.parametrize(
    ("start", "end", "distance", "message"),
    [
        (-0.1, 1.0, 1.0, "start 0 at depth -0.1 m is not in the water"),
        (1.0, 51.0, 1.0, "end 0 at depth 51 m is not in the water, which is 50 m deep"),
        (np.nan, 1.0, 1.0, "start 0 at depth nan"),
        (1.0, 1.0, np.inf, "must be finite"),
        (1.0, 1.0, -1.0, "not negative"),
    ],
)
def test_what_cannot_be_is_refused(start: float, end: float, distance: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        one(UNIFORM, start, end, distance)


@pytest.mark.parametrize(
    ("depth", "speed", "bottom_depth"),
    [
        ([0.0, 1.0], [1500.0], 9.0),
        ([1.0, 0.0], [1.0, 1.0], 9.0),
        ([0.0], [-1.0], 9.0),
        ([0.0], [np.nan], 9.0),
        ([0.0], [1.0], 0.0),
    ],
)
def test_profiles_that_cannot_be_are_refused(depth: list[float], speed: list[float], bottom_depth: float) -> None:
    with pytest.raises(ValueError, match="profile"):
        ray_solutions.water(np.array(depth), np.array(speed), bottom_depth)
