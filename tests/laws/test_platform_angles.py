"""Where ships say that they are, and how they lie: as an attitude, a beam and the ellipsoid of the Earth have it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sonarsynth.export.platform_angles import beam_rotation, heading_pitch_roll, latitude_longitude


def test_turns_of_ships_are_those_of_the_attitude() -> None:
    """Against rotation matrices: axes north, east, down of the world, forward, starboard, down of the ship. With
    the bow upright, where heading and roll are turns about one axis, what they add up to."""
    random = np.random.default_rng(3)
    pitch = np.concatenate([random.uniform(-80, 80, 44), [90, -90, 90, -90, 90 - 1e-4, 1e-4 - 90]])
    angles = np.column_stack([random.uniform(0, 360, 50), pitch, random.uniform(-170, 170, 50)])
    ship = Rotation.from_euler("ZYX", angles, degrees=True).as_matrix()
    flip = np.diag([1.0, -1.0, -1.0])
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    ours = Rotation.from_matrix(swap @ ship @ flip).as_quat(scalar_first=True)
    found = np.column_stack(heading_pitch_roll(ours))
    np.testing.assert_allclose(found[:44], angles[:44], atol=1e-9)
    np.testing.assert_allclose(Rotation.from_euler("ZYX", found, degrees=True).as_matrix(), ship, atol=1e-7)


def test_places_on_the_ellipsoid_are_as_far_east_and_north() -> None:
    """By the geocentric coordinates of WGS 84: to the eighth part of a metre in 10 km."""
    place = np.random.default_rng(1).uniform(-1e4, 1e4, (50, 3))
    latitude, longitude = np.deg2rad(latitude_longitude(place))
    squared = 6.69437999014e-3
    normal = 6378137.0 / np.sqrt(1.0 - squared * np.sin(latitude) ** 2)
    east, north = normal * np.cos(latitude) * np.sin(longitude), normal * (1.0 - squared) * np.sin(latitude)
    np.testing.assert_allclose(np.stack([east, north], axis=1), place[:, :2], atol=0.125)


def test_every_beam_has_turns_within_their_limits() -> None:
    azimuth, elevation = np.meshgrid(np.deg2rad(np.linspace(-179, 179, 30)), np.deg2rad(np.linspace(-89, 89, 31)))
    phi, theta = beam_rotation(azimuth, elevation)
    assert np.abs(phi).max() <= 180.0 and np.abs(theta).max() <= 90.0
    turns = np.column_stack([theta.ravel(), phi.ravel()])
    axes = Rotation.from_euler("YX", turns, degrees=True).apply([0.0, 0.0, 1.0])
    expected = [np.cos(elevation) * np.cos(azimuth), -np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)]
    np.testing.assert_allclose(axes, np.stack(expected, axis=-1).reshape(-1, 3), atol=1e-9)
