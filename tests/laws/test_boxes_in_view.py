"""Boxes bound what is seen of a body within the beams, whatever its bearing; where there is none, a flag says why."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels import label
from sonarsynth.labels.views import box_in_view
from sonarsynth.products import VIEWS, Truth, View
from sonarsynth.propagation import Straight
from sonarsynth.receiver import BeamGrid, Romanis, Sonar, elements
from sonarsynth.state import FrameContext, Medium, Receiver
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Sphere

BEAMS = BeamGrid(azimuth_span=np.deg2rad(50.0), azimuths=11, elevation_span=np.deg2rad(30.0), elevations=11)
HALF = np.deg2rad([25.0, 25.0, 15.0, 15.0]) * [-1, 1, -1, 1]
SONAR = Pose(np.array([0.0, 0.0, -50.0]), np.array([1.0, 0.0, 0.0, 0.0]))
STRAIGHT = np.array([1.0, 0.0, 0.0, 0.0])
WATER = Environment(depth=100.0, sound_speed=Isovelocity(speed=1500.0))
STILL = Profile(np.array([0.0]), np.array([1500.0]))


def truth(*bodies: tuple[Mesh, np.ndarray]) -> Truth:
    placed = tuple(
        PlacedTarget(f"body{n}", mesh, Pose(SONAR.position + place, STRAIGHT), np.zeros(3))
        for n, (mesh, place) in enumerate(bodies)
    )
    receiver, water = Receiver(SONAR, elements(Romanis()), Sonar(beams=BEAMS)), Medium(WATER, STILL)
    return label(FrameContext(0.0, placed, (), water, receiver), Straight(), np.zeros(0))


def sampled(corners: np.ndarray, rng: np.random.Generator, count: int) -> np.ndarray:
    """Directions (azimuth and elevation, point) of points spread over triangles (facet, 3, xyz), their edges too."""
    weight = rng.dirichlet([1.0, 1.0, 1.0], (count, len(corners)))
    weight[::2, :, 0] = 0.0
    weight[::2] = rng.permuted(weight[::2], axis=2)
    points = np.einsum("pfc,fcx->pfx", weight / weight.sum(axis=2, keepdims=True), corners)
    return np.array(azimuth_elevation(points.reshape(-1, 3)))


@pytest.mark.parametrize("seed", range(12))
def test_triangles_of_any_size_are_bounded_by_what_of_them_is_in_view(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = direction(rng.uniform(-1.2, 1.2, (1, 3)), rng.uniform(-0.6, 0.6, (1, 3))) * rng.uniform(1, 9, (1, 3, 1))
    if seed == 0:
        corners = np.array([[[1.0, -9.0, -9.0], [1.0, 9.0, -9.0], [1.0, 0.0, 20.0]]])  # wider than the view
    box = box_in_view(corners[0], np.array([[0, 1, 2]]), BEAMS)
    azimuth, elevation = sampled(corners, rng, 60_000)
    within = (np.abs(azimuth) <= HALF[1]) & (np.abs(elevation) <= HALF[3])
    assert box.view == (View.IN_VIEW if within.all() else View.PARTLY_IN_VIEW if within.any() else View.OUTSIDE_VIEW)
    if not within.any():
        assert np.isnan(box.bounds).all()
        return
    inside = azimuth[within], elevation[within]
    exact = np.array([f(x) for x in inside for f in (np.min, np.max)])
    outward = np.array([-1, 1, -1, 1]) * (box.bounds - exact)
    assert (outward >= -1e-9).all() and (outward < 0.03).all()


@pytest.mark.parametrize("bearing", np.deg2rad(np.arange(-180.0, 180.0, 15.0)))
def test_a_sphere_at_any_bearing_has_its_own_box_or_none(bearing: float) -> None:
    """Its cap of visible directions is a cone of half angle asin(a/R) about the bearing."""
    far, radius = 10.0, 0.8
    found = truth((mesh_of(Sphere(radius=radius, edge=0.04)), far * direction(np.array(bearing), np.array(0.0))))
    cone = np.arcsin(radius / far)
    assert found.visible_fraction[0] == pytest.approx(1.0)
    away = abs(bearing) - HALF[1]
    wanted = View.OUTSIDE_VIEW if away > cone else View.IN_VIEW if away < -cone else View.PARTLY_IN_VIEW
    wanted = View.BEHIND if abs(bearing) - 0.5 * np.pi > cone else wanted
    assert found.view[0] == wanted
    if wanted in (View.OUTSIDE_VIEW, View.BEHIND):
        assert np.isnan(found.image_box[0]).all()
        return
    sides = np.clip([bearing - cone, bearing + cone], HALF[0], HALF[1])
    # of a circle of directions, the height at the azimuth in view that is nearest to the middle
    low = np.clip(bearing, *sides)
    top = np.arcsin(np.sqrt(max(0.0, 1.0 - (np.cos(cone) / np.cos(low - bearing)) ** 2)))
    assert found.image_box[0] == pytest.approx([*sides, -top, top], abs=0.006)


def test_a_wall_round_the_view_fills_it() -> None:
    found = truth((mesh_of(Box(size=(0.1, 80.0, 40.0))), np.array([5.0, 0.0, 0.0])))
    assert found.view[0] == View.PARTLY_IN_VIEW
    assert found.image_box[0] == pytest.approx(HALF, abs=1e-9)


def test_a_long_box_beside_the_sonar_is_cut_where_the_view_ends() -> None:
    """A hull of 12 facets along the right side: its near end is out of view, its bow 40 m ahead is in view."""
    found = truth((mesh_of(Box(size=(60.0, 2.0, 2.0))), np.array([10.0, -5.0, 0.0])))  # x from -20 to 40
    assert found.view[0] == View.PARTLY_IN_VIEW
    edge = 4.0 / np.tan(HALF[1])  # where the near side enters the view
    top = np.arctan(1.0 / np.hypot(edge, 4.0))
    assert found.image_box[0] == pytest.approx([HALF[0], -np.arctan(4.0 / 40.0), -top, top], abs=1e-9)


def test_what_hides_a_body_is_another_reason_than_where_it_is() -> None:
    wall = mesh_of(Box(size=(0.1, 8.0, 8.0)))
    ball = mesh_of(Sphere(radius=0.5, edge=0.1))
    found = truth((wall, np.array([5.0, 0.0, 0.0])), (ball, np.array([10.0, 0.0, 0.0])))
    assert found.view.tolist() == [View.PARTLY_IN_VIEW, View.HIDDEN]
    assert np.isnan(found.image_box[1]).all() and found.visible_fraction[1] == 0.0
    assert VIEWS.split()[found.view[1]] == "hidden"
