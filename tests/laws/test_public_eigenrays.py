"""Laws of the rays that anyone can ask for: images, symmetry, Snell, broadcasting, directions in space."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from sonarsynth import (
    Isovelocity,
    Linear,
    Munk,
    RayArrivals,
    Tabulated,
    eigenrays,
    eigenrays_between,
)
from sonarsynth.environment.sea import SoundSpeed
from tests.ray_paths import images

WATER = Isovelocity(speed=1540.0)
LAYERS = Tabulated(depth=(0.0, 5.0, 6.5, 20.0), speed=(1540.0, 1540.0, 1533.55, 1533.8))
FIELDS = [field.name for field in dataclasses.fields(RayArrivals)]


@pytest.mark.parametrize("most", [0, 1, 2, 5])
def test_isovelocity_rays_come_from_image_sources(most: int) -> None:
    bottom_depth, start, end, distance = 20.0, 3.0, 11.0, 60.0
    rays = eigenrays(WATER, bottom_depth, start, end, distance, vertices=most)
    up, surface, bottom, _, climb = np.array(images(bottom_depth, start, end, most)).T
    length = np.hypot(distance, climb)
    assert len(rays) == len(length) == 2 * most + 1
    np.testing.assert_allclose(rays.travel_time, length / 1540.0, rtol=1e-14)
    np.testing.assert_allclose(rays.launch_angle, np.arctan2(-up * climb, distance), rtol=1e-13)
    np.testing.assert_array_equal([rays.surface, rays.bottom], [surface, bottom])
    np.testing.assert_allclose(rays.length, length, rtol=1e-14)
    np.testing.assert_allclose(rays.amplitude, 1 / rays.length, rtol=1e-13)
    flips = np.where((rays.surface + rays.bottom) % 2 == 0, 1.0, -1.0)
    np.testing.assert_allclose(rays.arrival_angle, flips * rays.launch_angle, rtol=1e-13)
    assert (rays.turning == 0).all() and (rays.flag == 0).all()


def test_angles_of_travel_are_positive_going_down() -> None:
    down = eigenrays(WATER, 20.0, 5.0, 15.0, 10.0, vertices=0)
    up = eigenrays(WATER, 20.0, 15.0, 5.0, 10.0, vertices=0)
    assert down.launch_angle[0] == pytest.approx(np.pi / 4) and up.launch_angle[0] == pytest.approx(-np.pi / 4)
    assert down.departure[0, 2] < 0 < up.departure[0, 2]
    straight_down = eigenrays(LAYERS, 20.0, 2.0, 15.0, 0.0, vertices=0)
    assert straight_down.launch_angle[0] == straight_down.arrival_angle[0] == np.pi / 2
    assert straight_down.departure.tolist() == straight_down.arrival.tolist() == [[0.0, 0.0, -1.0]]
    level = eigenrays(WATER, 20.0, 5.0, 5.0, 10.0, vertices=0)
    assert level.launch_angle[0] == 0.0 and not np.signbit(level.launch_angle[0])


def test_arguments_broadcast_and_pairs_number_them() -> None:
    source = np.array([[2.0], [9.0], [17.0]])
    receiver, r = np.array([4.0, 12.0]), 50.0
    rays = eigenrays(LAYERS, 20.0, source, receiver, r, vertices=2)
    assert (np.diff(rays.pair) >= 0).all()
    for pair in range(6):
        i, j = np.unravel_index(pair, (3, 2))
        alone = eigenrays(LAYERS, 20.0, source[i, 0], receiver[j], r, vertices=2)
        mine = rays.select(rays.pair == pair)
        assert (np.diff(mine.travel_time) >= 0).all()
        for name in FIELDS[1:]:
            np.testing.assert_array_equal(getattr(mine, name), getattr(alone, name), err_msg=name)


@pytest.mark.parametrize("water", [WATER, LAYERS], ids=lambda w: w.kind)
def test_rays_in_space_agree_with_those_in_a_section_and_turn_with_the_ends(water: SoundSpeed) -> None:
    rng = np.random.default_rng(3)
    source = np.concatenate([rng.uniform(-50, 50, (12, 2)), rng.uniform(-20, 0, (12, 1))], axis=1)
    receiver = np.concatenate([rng.uniform(-50, 50, (12, 2)), rng.uniform(-20, 0, (12, 1))], axis=1)
    span = receiver[:, :2] - source[:, :2]
    flat = eigenrays(water, 20.0, -source[:, 2], -receiver[:, 2], np.hypot(*span.T))
    rays = eigenrays_between(water, 20.0, source, receiver)
    for name in set(FIELDS) - {"departure", "arrival"}:
        np.testing.assert_array_equal(getattr(rays, name), getattr(flat, name), err_msg=name)
    azimuth = np.arctan2(span[:, 1], span[:, 0])[rays.pair]
    for vector, angle in ((rays.departure, rays.launch_angle), (rays.arrival, rays.arrival_angle)):
        np.testing.assert_allclose(np.linalg.norm(vector, axis=1), 1.0, rtol=1e-14)
        np.testing.assert_allclose(vector[:, 2], -np.sin(angle), atol=1e-14)
        np.testing.assert_allclose(np.arctan2(vector[:, 1], vector[:, 0]), azimuth, atol=1e-12)
    turn = np.array([[np.cos(1.0), -np.sin(1.0), 0.0], [np.sin(1.0), np.cos(1.0), 0.0], [0.0, 0.0, 1.0]])
    shift = np.array([7.0, -3.0, 0.0])
    turned = eigenrays_between(water, 20.0, source @ turn.T + shift, receiver @ turn.T + shift)
    np.testing.assert_allclose(turned.travel_time, rays.travel_time, rtol=1e-13)
    np.testing.assert_allclose(turned.departure, rays.departure @ turn.T, atol=1e-12)
    np.testing.assert_allclose(turned.arrival, rays.arrival @ turn.T, atol=1e-12)


def test_vertical_rays_and_coincident_ends_in_space() -> None:
    rays = eigenrays_between(LAYERS, 20.0, (1.0, 2.0, -3.0), (1.0, 2.0, -16.0), vertices=1)
    assert rays.departure.tolist() == [[0, 0, -1], [0, 0, 1], [0, 0, -1]]
    assert rays.arrival.tolist() == [[0, 0, -1], [0, 0, -1], [0, 0, 1]]
    assert (rays.ray_parameter == 0).all()
    same = eigenrays_between(LAYERS, 20.0, (1.0, 2.0, -3.0), (1.0, 2.0, -3.0), vertices=0)
    assert same.travel_time[0] == same.length[0] == 0.0
    assert np.isnan(same.departure).all() and np.isnan(same.launch_angle).all()
    assert same.reason[0].startswith("the ends coincide")


def test_no_rays_is_an_answer() -> None:
    nothing = eigenrays(WATER, 20.0, [], 5.0, 10.0)
    assert len(nothing) == 0 and nothing.departure.shape == (0, 3) and repr(nothing) == "0 rays"
    shadow = eigenrays(Linear(surface_speed=1500.0, gradient=-1.0), 500.0, 100.0, 10.0, 900.0, vertices=0)
    assert len(shadow) == 0


def test_the_product_is_frozen_and_prints_a_short_table() -> None:
    rays = eigenrays(Munk(), 5000.0, np.full(20, 1000.0), 800.0, 50e3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        rays.pair = rays.pair  # type: ignore[misc]
    lines = str(rays).splitlines()
    assert len(lines) == 23 and lines[0] == f"{len(rays)} rays" and lines[-1] == f"... and {len(rays) - 20} more"
    assert max(map(len, lines)) <= 120
    row = lines[2].split()
    assert float(row[1]) == pytest.approx(rays.travel_time[0], rel=1e-6)
    assert float(row[2]) == pytest.approx(np.rad2deg(rays.launch_angle[0]), abs=1e-4)
    assert float(row[8]) == pytest.approx(rays.transmission_loss[0], abs=0.01)
    assert repr(rays.select(np.array([0]))).splitlines()[0] == "1 ray"
    passed = rays.select(rays.flag == 3)
    assert len(passed) and "passed a caustic" in str(passed)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("isovelocity", 20.0, 5.0, 5.0, 1.0), "sound_speed must be one of Isovelocity, .*, not str"),
        ((WATER, 20.0, [5.0, 50.0], 5.0, 1.0), "source_depth of pair 1 at 50 m depth is not in the water.* 20 m deep"),
        ((WATER, 20.0, 5.0, -1.0, 1.0), "receiver_depth at -1 m depth is not in the water"),
        ((WATER, 20.0, 5.0, 1.0, -1.0), "horizontal_range must not be negative, but is -1 m"),
        ((WATER, 20.0, 5.0, 1.0, np.inf), "horizontal_range must be finite, but is inf m"),
        ((WATER, [20.0, 0.0], 0.0, 0.0, 1.0), "bottom_depth of pair 1 must be positive, but is 0 m"),
        ((WATER, 20.0, np.nan, 1.0, 1.0), "source_depth must be finite"),
        ((WATER, 20.0, "deep", 1.0, 1.0), "source_depth must be numbers"),
        ((WATER, 20.0, [1.0, 2.0], [1.0, 2.0, 3.0], 1.0), r"do not broadcast: .* source_depth \(2,\), receiver_depth"),
    ],
)
def test_bad_input_is_told_in_one_line(arguments: tuple[Any, ...], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint) as told:
        eigenrays(*arguments)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (((0.0, 0.0), (0.0, 0.0, -1.0)), r"source must be positions \(..., xyz\), but its shape is \(2,\)"),
        (((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), "source at -1 m depth is not in the water"),
        (
            ((0.0, 0.0, -1.0), ((0.0, 0.0, -1.0), (0.0, 0.0, -21.0))),
            "receiver of pair 1 at 21 m depth is not in the wat",
        ),
        (((0.0, np.inf, -1.0), (0.0, 0.0, -1.0)), "source must be finite"),
    ],
)
def test_bad_positions_are_told_in_one_line(arguments: tuple[Any, ...], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        eigenrays_between(WATER, 20.0, *arguments)


@pytest.mark.parametrize("vertices", [-1, 1.5, "2"])
def test_vertices_are_counted(vertices: Any) -> None:
    with pytest.raises(ValueError, match="vertices must"):
        eigenrays(WATER, 20.0, 5.0, 5.0, 10.0, vertices=vertices)
