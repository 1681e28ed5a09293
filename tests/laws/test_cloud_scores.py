"""Clouds against surfaces: a wall ahead, whose clouds are known."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from sonarsynth.evaluation.cloud_scores import cloud_scores, figures_of

AZIMUTH, ELEVATION = np.linspace(-10.0, 10.0, 21), np.linspace(-5.0, 5.0, 11)
WALL = 10.0
"""m ahead."""


def places() -> np.ndarray:
    """Where beams meet the wall (row, xyz)."""
    azimuth, elevation = np.meshgrid(np.deg2rad(AZIMUTH), np.deg2rad(ELEVATION))
    return np.stack(
        [np.full(azimuth.shape, WALL), WALL * np.tan(azimuth), WALL * np.tan(elevation) / np.cos(azimuth)], -1
    ).reshape(-1, 3)


def tree(points: np.ndarray, distance: np.ndarray | float, wall: bool = True) -> xr.DataTree:
    """A frame of a wall, and a cloud; the distance of each point from its target, NaN where it is of none."""
    away = np.linalg.norm(places(), axis=1).reshape(1, len(ELEVATION), len(AZIMUTH))
    beams = {
        "target": (("frame", "elevation", "azimuth"), np.zeros(away.shape, int) if wall else np.full(away.shape, -1)),
        "range": (("frame", "elevation", "azimuth"), away if wall else np.full(away.shape, np.nan)),
    }
    room = len(points) + 3
    padded = np.full((1, room, 3), np.nan)
    padded[0, : len(points)] = points
    known = np.full((1, room), np.nan)
    known[0, : len(points)] = distance
    cloud = {axis: (("frame", "point"), padded[..., n]) for n, axis in enumerate("xyz")}
    cloud |= {"count": (("frame",), np.array([len(points)])), "distance": (("frame", "point"), known)}
    axes = {"azimuth": AZIMUTH, "elevation": ELEVATION}
    return xr.DataTree.from_dict({"/cloud": xr.Dataset(cloud), "/truth/beams": xr.Dataset(beams, coords=axes)})


ONE = np.array([0])


def test_the_surface_itself_is_perfect() -> None:
    found = cloud_scores(tree(places(), 0.0), ONE)
    assert found["chamfer"] == pytest.approx(0.0, abs=1e-9)
    assert all(row == {"precision": 1.0, "recall": 1.0, "f_score": 1.0} for row in found["by_tolerance"].values())


def test_a_cloud_that_is_off_by_a_little_is_right_where_as_much_is_allowed() -> None:
    """Every point 0.15 m behind the wall, and so every place of the wall from its point: Chamfer 0.3 m."""
    moved = places() + [0.15, 0.0, 0.0]
    found = cloud_scores(tree(moved, 0.15), ONE)
    assert found["chamfer"] == pytest.approx(0.3, abs=1e-3)
    assert [row["f_score"] for row in found["by_tolerance"].values()] == [0.0, 1.0, 1.0]


def test_half_of_a_cloud_is_as_exact_and_half_as_complete() -> None:
    left = places()[:, 1] > 0.01
    found = cloud_scores(tree(places()[left], 0.0), ONE)["by_tolerance"]["0.1 m"]
    assert found["precision"] == 1.0 and found["recall"] == pytest.approx(left.mean())
    assert found["f_score"] == pytest.approx(2 * left.mean() / (1 + left.mean()))


def test_ghosts_are_as_far_as_the_nearest_place() -> None:
    ghosts = np.array([[WALL - 3.0, 0.0, 0.0], [WALL, 0.0, 0.0]])
    found = cloud_scores(tree(ghosts, np.nan), ONE)
    assert found["by_tolerance"]["0.5 m"]["precision"] == 0.5
    assert found["points"] == 2 and found["samples"] == len(places())


def test_frames_without_points_or_without_a_target_are_counted() -> None:
    assert cloud_scores(tree(np.zeros((0, 3)), np.zeros(0)), ONE)["by_tolerance"] == {}
    nothing = cloud_scores(tree(places()[:4], np.nan, wall=False), ONE)
    assert nothing["points"] == 4 and nothing["samples"] == 0
    missed = figures_of(np.zeros(5), np.concatenate([np.zeros(5), np.full(5, np.inf)]))
    assert missed["by_tolerance"]["0.1 m"]["recall"] == 0.5 and missed["chamfer"] == 0.0
