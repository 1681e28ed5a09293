"""Labels of targets, from meshes and poses by another way: rays cast by numpy, along circles in bent water."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import azimuth_elevation, direction
from sonarsynth.environment.sea import Environment, Isovelocity, Profile, Tabulated
from sonarsynth.geometry import Pose, quaternion, rotation_matrix
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels import label
from sonarsynth.labels.views.beam_cells import cells_of
from sonarsynth.labels.views.box_in_view import truncation
from sonarsynth.products import Truth, View
from sonarsynth.propagation import Refracted, Straight
from sonarsynth.receiver import BeamGrid, Romanis, Sonar, elements
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Sphere

BEAMS = BeamGrid(azimuth_span=np.deg2rad(50.0), azimuths=11, elevation_span=np.deg2rad(30.0), elevations=7)
SPANS = np.deg2rad([25.0, 15.0])
SONAR = Pose(np.array([3.0, -4.0, -50.0]), quaternion(np.deg2rad(60.0), np.deg2rad(4.0), np.deg2rad(-3.0)))
STILL = Profile(np.array([0.0]), np.array([1500.0]))
SLOPED = Profile(np.array([0.0, 100.0]), np.array([1540.0, 1460.0]))
SPEED_ZERO = -1925.0
"""m, up: where the speed of SLOPED would be 0. Rays are circles about points at that height (Jensen et al. 2011,
Computational Ocean Acoustics, section 3.3.1)."""
HUNDREDTH = np.deg2rad(0.01)
CHORDS = 3


def snap(place: tuple[float, float, float]) -> Emission:
    """At a place in the sonar frame."""
    return Emission(SONAR.to_world(place), 0.0, LogarithmicBubble(), None)


def truth(bodies: list[PlacedTarget], snaps: tuple[Emission, ...] = (), bent: bool = False) -> Truth:
    speed = Tabulated(depth=(0.0, 100.0), speed=(1540.0, 1460.0)) if bent else Isovelocity(speed=1500.0)
    water = Medium(Environment(depth=100.0, sound_speed=speed), SLOPED if bent else STILL)
    receiver = Receiver(SONAR, elements(Romanis()), Sonar(beams=BEAMS))
    context = FrameContext(0.0, tuple(bodies), snaps, water, receiver)
    return label(context, Refracted() if bent else Straight(), np.zeros(len(snaps)))


def placed(mesh: Mesh, place: np.ndarray, *turned: float) -> PlacedTarget:
    """A body at a place in the sonar frame, at a heading, pitch and roll in the world."""
    return PlacedTarget("body", mesh, Pose(SONAR.to_world(place), quaternion(*(turned or (0.3,)))), np.zeros(3))


def hits(start: np.ndarray, way: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Whether segments from start (ray, xyz) along way (ray, xyz), ends left out, meet triangles (facet, 3, xyz).
    Source: Moeller & Trumbore (1997), J. Graphics Tools 2, 21."""
    a, one, two = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    found = np.zeros(len(start), bool)
    for rows in np.array_split(np.arange(len(start)), max(1, len(start) * len(corners) // 1_000_000)):
        p = np.cross(way[rows, None], two)
        det = np.einsum("rfx,fx->rf", p, one)
        off = start[rows, None] - a
        q = np.cross(off, one)
        with np.errstate(divide="ignore", invalid="ignore"):
            u, v = np.einsum("rfx,rfx->rf", off, p) / det, np.einsum("rfx,rx->rf", q, way[rows]) / det
            t = np.einsum("rfx,fx->rf", q, two) / det
        found[rows] = ((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-5) & (t < 1 - 1e-5)).any(axis=1)
    return found


def blocked(start: np.ndarray, way: np.ndarray, bodies: list[np.ndarray]) -> np.ndarray:
    """Whether segments, as of `hits`, meet bodies, each of triangles (facet, 3, xyz)."""
    found = np.zeros(len(start), bool)
    for corners in bodies:
        middle = corners.reshape(-1, 3).mean(axis=0)
        radius = np.linalg.norm(corners - middle, axis=-1).max()
        part = np.einsum("ij,ij->i", middle - start, way) / np.einsum("ij,ij->i", way, way)
        nearest = start + np.clip(part, 0.0, 1.0)[:, None] * way
        near = np.flatnonzero((np.linalg.norm(nearest - middle, axis=1) <= radius) & ~found)
        found[near] = hits(start[near], way[near], corners)
    return found


def ways(start: np.ndarray, end: np.ndarray, bent: bool) -> np.ndarray:
    """Points (ray, chord + 1, xyz) along rays from start to end (ray, xyz), world."""
    part = np.linspace(0.0, 1.0, CHORDS + 1 if bent else 2)[:, None]
    if not bent:
        return start[:, None] + part * (end - start)[:, None]
    level = (end - start)[:, :2]
    far = np.linalg.norm(level, axis=1)
    low, high = start[:, 2] - SPEED_ZERO, end[:, 2] - SPEED_ZERO
    middle = (far**2 + high**2 - low**2) / (2.0 * far)
    radius = np.hypot(middle, low)
    first, last = np.arctan2(low, -middle), np.arctan2(high, far - middle)
    angle = first + part * (last - first)  # (part, ray)
    along, up = middle + radius * np.cos(angle), SPEED_ZERO + radius * np.sin(angle)
    flat = start[:, :2] + (along / far)[..., None] * level
    return np.moveaxis(np.concatenate([flat, up[..., None]], axis=-1), 0, 1)


def leaving(start: np.ndarray, end: np.ndarray, bent: bool) -> np.ndarray:
    """Unit directions (ray, xyz) in which rays leave start, world: of the tangent of the circle."""
    chord = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    if not bent:
        return chord
    level = (end - start)[:, :2]
    far = np.linalg.norm(level, axis=1)
    low, high = start[:, 2] - SPEED_ZERO, end[:, 2] - SPEED_ZERO
    middle = (far**2 + high**2 - low**2) / (2.0 * far)
    tangent = np.column_stack([level / far[:, None] * low[:, None], middle])
    return tangent / np.linalg.norm(tangent, axis=1, keepdims=True)


def in_world(body: PlacedTarget) -> np.ndarray:
    """(facet, 3, xyz)"""
    return body.pose.to_world(body.mesh.corners)


def reached(body: PlacedTarget, bodies: list[PlacedTarget], place: np.ndarray, bent: bool) -> tuple[np.ndarray, ...]:
    """Whether points spread over a body are turned to a place in the world, and whether rays join them; their areas."""
    corners = in_world(body)
    weight = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) / 6.0
    point = np.einsum("pw,fwx->fpx", weight, corners).reshape(-1, 3)
    normal = np.repeat(body.pose.turn_to_world(body.mesh.normal), 4, axis=0)
    end = np.broadcast_to(place, point.shape)
    faces = np.einsum("ij,ij->i", leaving(point, end, bent), normal) > 0.0
    clear = faces.copy()
    every = [in_world(other) for other in bodies]
    rows = np.flatnonzero(faces)
    rays = ways(point[rows] + 1e-6 * normal[rows], end[rows], bent)
    for one in range(rays.shape[1] - 1):
        left = np.flatnonzero(clear[rows])
        clear[rows[left]] = ~blocked(rays[left, one], rays[left, one + 1] - rays[left, one], every)
    return faces, clear, np.repeat(body.mesh.area, 4)


def bounds(azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    return np.array([azimuth.min(), azimuth.max(), elevation.min(), elevation.max()])


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("bearing", np.deg2rad(np.arange(-165.0, 181.0, 30.0)))
def test_boxes_at_any_bearing_are_those_of_the_corners_as_they_appear(bearing: float, bent: bool) -> None:
    there = 15.0 * direction(np.array(bearing), np.array(0.1 * np.sin(5.0 * bearing)))
    body = placed(mesh_of(Box(size=(2.0, 1.2, 0.7))), there, 7.0 * bearing, 0.4, 0.2)
    found = truth([body], bent=bent)
    world = body.pose.to_world(body.mesh.vertices)
    here = np.broadcast_to(SONAR.position, world.shape)
    far = np.linalg.norm(world - here, axis=1)[:, None]
    seen = far * SONAR.turn_to_body(leaving(here, world, bent))
    for place, name in ((seen, "full_box"), (SONAR.to_body(world), "true_image_box")):
        edges = np.concatenate([place[body.mesh.faces], np.roll(place[body.mesh.faces], -1, axis=1)]).reshape(2, -1, 3)
        part = np.linspace(0.0, 1.0, 4001)[:, None, None]
        along = (edges[0] + part * (edges[1] - edges[0])).reshape(-1, 3)
        along = along[along[:, 0] > 0.0]
        box = getattr(found, name)[0]
        if not len(along):
            assert np.isnan(box).all() and found.in_view[0] == 0
            continue
        angles = np.array(azimuth_elevation(along))
        inside = (np.abs(angles) <= SPANS[:, None]).all(axis=0)
        if name == "full_box":
            ahead = (place[:, 0] > 0.0).all()
            assert box == pytest.approx(bounds(*angles), abs=HUNDREDTH if ahead else 10 * HUNDREDTH)
            assert found.in_view[0] == inside.any()
        elif inside.all() and found.visible_fraction[0] == 1.0:
            assert box == pytest.approx(bounds(*angles), abs=HUNDREDTH)
            assert bent or found.image_box[0] == pytest.approx(found.full_box[0], abs=1e-12)
    assert bent or np.array_equal(found.image_box, found.true_image_box, equal_nan=True)


def test_bent_water_shows_a_target_elsewhere_than_it_is() -> None:
    """A ray of length L turns by L/R on its circle: where sound is faster above, it arrives half of that from above."""
    found = truth([placed(mesh_of(Sphere(radius=0.5, edge=0.05)), np.array([40.0, 0.0, 0.0]))], bent=True)
    off = found.image_box[0] - found.true_image_box[0]
    assert off[2:] == pytest.approx(np.full(2, 0.5 * 40.0 / abs(SPEED_ZERO + 50.0)), rel=0.03)
    assert np.abs(off[:2]).max() < 0.1 * np.abs(off[2:]).min()


def test_the_box_in_pixels_is_that_in_angles() -> None:
    found = truth([placed(mesh_of(Box(size=(0.5, 3.0, 1.0))), np.array([12.0, 4.5, -1.0]))])
    x0, y0, x1, y1 = found.pixel_box[0]
    assert 0.5 <= x0 < x1 <= BEAMS.azimuths - 0.5 and 0.5 <= y0 < y1 <= BEAMS.elevations - 0.5
    columns, rows = np.arange(BEAMS.azimuths) + 0.5, np.arange(BEAMS.elevations) + 0.5
    angles = np.interp([x0, x1], columns, BEAMS.azimuth), np.interp([y0, y1], rows, BEAMS.elevation)
    assert np.concatenate(angles) == pytest.approx(found.image_box[0], abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_what_a_view_cuts_off_is_a_solid_angle(seed: int) -> None:
    """Of triangles of any size, against directions spread evenly over the sphere."""
    rng = np.random.default_rng(seed)
    corners = direction(rng.uniform(-1.2, 1.2, 3), rng.uniform(-0.6, 0.6, 3)) * rng.uniform(1, 9, (3, 1))
    if seed == 0:
        corners = np.array([[1.0, -9.0, -9.0], [1.0, 9.0, -9.0], [1.0, 0.0, 20.0]])  # wider than the view
    if seed == 1:
        corners = np.array([[5.0, 3.0, 0.3], [-9.0, 4.0, 0.5], [2.0, 0.1, -1.0]])  # reaches behind
    azimuth = (np.arange(2400) + 0.5) * (2.0 * np.pi / 2400) - np.pi
    sine = (np.arange(1200) + 0.5) / 600 - 1.0
    ray = direction(azimuth[None, :], np.arcsin(sine)[:, None])
    planes = np.cross(corners, np.roll(corners, -1, axis=0))
    met = (ray @ (planes * np.sign(planes[0] @ corners[2])).T >= 0.0).all(axis=-1)
    within = (np.abs(azimuth) <= SPANS[0])[None, :] & (np.abs(np.arcsin(sine)) <= SPANS[1])[:, None]
    exact = 1.0 - (met & within).sum() / met.sum()
    found = truncation(corners, np.array([[0, 1, 2]]), View.PARTLY_IN_VIEW, BEAMS)
    assert found == pytest.approx(exact, abs=0.004)


def test_half_of_a_sphere_on_the_edge_of_the_view_is_cut_off() -> None:
    ball = mesh_of(Sphere(radius=0.8, edge=0.05))
    at = [12.0 * direction(np.array(azimuth), np.array(0.0)) for azimuth in (SPANS[0], 0.0, -2.0 * SPANS[0], np.pi)]
    found = truth([placed(ball, place) for place in at])
    assert found.truncation == pytest.approx([0.5, 0.0, 1.0, 1.0], abs=0.002)
    assert found.in_view.tolist() == [1, 1, 0, 0]


def test_the_oriented_box_has_the_corners_of_the_box() -> None:
    rng = np.random.default_rng(3)
    bodies = [placed(mesh_of(Box(size=(3.0, 1.0, 0.5))), rng.uniform(-9, 9, 3), *rng.uniform(-3, 3, 3)) for _ in "abcd"]
    found = truth(bodies)
    half = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    for n, body in enumerate(bodies):
        turn = rotation_matrix(found.box_orientation[n])
        assert found.box_orientation[n, 0] >= 0.0
        assert found.box_centre[n] + (half * found.box_size[n]) @ turn.T == pytest.approx(found.box[n], abs=1e-12)
        bow = SONAR.turn_to_body(body.pose.turn_to_world([1.0, 0.0, 0.0]))
        assert found.yaw[n] == pytest.approx(np.arctan2(bow[1], bow[0]), abs=1e-12)
    to_port = PlacedTarget("b", bodies[0].mesh, Pose(SONAR.to_world([9.0, 0.0, 0.0]), quaternion(0.0)), np.zeros(3))
    assert 0.0 < truth([to_port]).yaw[0] < 0.5 * np.pi  # its bow north, of a sonar that looks 60 degrees east of it


@pytest.mark.parametrize("bent", [False, True])
def test_visible_and_lit_shares_are_those_of_rays_to_points_all_over_the_bodies(bent: bool) -> None:
    ball, small = mesh_of(Sphere(radius=0.8, edge=0.15)), mesh_of(Sphere(radius=0.3, edge=0.1))
    bodies = [
        placed(ball, np.array([14.0, 0.5, 0.0])),
        placed(small, np.array([10.0, 0.6, 0.1])),
        placed(small, np.array([-6.0, 1.5, 0.5])),
    ]
    snaps = (snap((6.0, 1.0, -2.0)), snap((25.0, 3.0, 0.0)), snap((13.0, -9.0, 3.0)))
    found = truth(bodies, snaps, bent)
    for n, body in enumerate(bodies):
        faces, seen, area = reached(body, bodies, SONAR.position, bent)
        assert found.visible_fraction[n] == pytest.approx(area[seen].sum() / area[faces].sum(), abs=0.01)
        for m, one in enumerate(snaps):
            lit = reached(body, bodies, one.position, bent)[1]
            assert found.lit_fraction[m, n] == pytest.approx(area[seen & lit].sum() / area[seen].sum(), abs=0.01)


@pytest.mark.parametrize("below", [0.0, 0.2])
def test_of_a_body_that_reaches_into_a_shadow_of_bent_water_the_rest_is_seen_and_lit(below: float) -> None:
    """Facets as large as the shadow too: the box ends at the ray that touches the surface (Snell's law), shares are of
    facets by their middles. Of these 12 facets each has a corner in the shadow."""
    water = Medium(Environment(depth=100.0, sound_speed=Tabulated(depth=(0.0, 100.0), speed=(1540.0, 1460.0))), SLOPED)
    sonar = Pose(np.array([0.0, 0.0, -1.0]), quaternion(np.pi / 2))
    box = mesh_of(Box(size=(1.0, 2.0, 2.0)))
    body = PlacedTarget("body", box, Pose(np.array([120.0, 0.3, -1.11 - below]), quaternion(0.3)), np.zeros(3))
    light = Emission(np.array([112.0, 0.0, -3.0]), 0.0, LogarithmicBubble(), None)
    receiver = Receiver(sonar, elements(Romanis()), Sonar(beams=BEAMS))
    found = label(FrameContext(0.0, (body,), (light,), water, receiver), Refracted(), np.zeros(1))
    assert found.visible_fraction[0] >= 0.5 and found.lit_fraction[0, 0] == 1.0 and found.view[0] == View.IN_VIEW
    grazing = np.arccos((1540.0 - 0.8) / 1540.0)
    assert found.image_box[0, 3] == pytest.approx(grazing, abs=HUNDREDTH)


def test_what_is_lit_of_a_sphere_far_off_is_a_lune() -> None:
    """1 - t/pi of what is seen, for an angle t between snap and array as the sphere has them."""
    there = np.array([20.0, 0.0, 0.0])
    angles = np.deg2rad([0.1, 60.0, 120.0])
    snaps = tuple(snap(tuple(there - 20.0 * np.array([np.cos(t), np.sin(t), 0.0]))) for t in angles)
    found = truth([placed(mesh_of(Sphere(radius=0.02, edge=0.001)), there)], snaps)
    assert found.lit_fraction[:, 0] == pytest.approx(1.0 - angles / np.pi, abs=0.01)


def test_a_hidden_body_is_in_view_but_nothing_of_it_is_seen() -> None:
    wall, ball = mesh_of(Box(size=(0.1, 8.0, 8.0))), mesh_of(Sphere(radius=0.5, edge=0.1))
    turned = np.deg2rad(60.0), np.deg2rad(4.0), np.deg2rad(-3.0)
    bodies = [placed(wall, np.array([5.0, 0.0, 0.0]), *turned), placed(ball, np.array([10.0, 0.0, 0.0]))]
    found = truth(bodies, (snap((9.0, 2.0, 0.0)),))
    assert found.view[1] == View.HIDDEN and found.in_view.tolist() == [1, 1]
    assert np.isnan(found.truncation[1]) and np.isnan(found.lit_fraction[0, 1])
    assert np.isfinite(found.full_box).all() and np.isnan(found.pixel_box[1]).all()
    assert found.lit_fraction[0, 0] == 0.0  # the snap is behind the wall
    assert (found.beam_coverage == 1.0).all()


def test_coverage_is_the_share_of_rays_that_meet_bodies() -> None:
    """Against other directions in each cell: an additive recurrence by the plastic number (Roberts 2018)."""
    bodies = [
        placed(mesh_of(Box(size=(6.0, 1.2, 0.8))), np.array([11.0, 2.0, 0.9]), 0.5, 0.2, 0.3),
        placed(mesh_of(Sphere(radius=0.9, edge=0.4)), np.array([9.0, 0.9, -0.6])),
        placed(mesh_of(Sphere(radius=0.2, edge=0.1)), np.array([9.0, -1.15, 0.43])),  # between beams
        placed(mesh_of(Box(size=(9.0, 0.5, 0.5))), np.array([1.0, -3.0, -0.8]), np.deg2rad(60.0)),  # beside and behind
    ]
    found = truth(bodies).beam_coverage
    count, plastic = 2048, 1.324717957244746
    u, v = ((0.5 + np.arange(count) / plastic**n) % 1.0 - 0.5 for n in (1, 2))
    step = 2.0 * SPANS / (np.array([BEAMS.azimuths, BEAMS.elevations]) - 1)
    every = [SONAR.to_body(in_world(body)) for body in bodies]
    share = np.zeros(found.shape)
    for row, column in np.ndindex(found.shape):
        low, high = np.sin(BEAMS.elevation[row] + np.array([-0.5, 0.5]) * step[1])
        ray = direction(BEAMS.azimuth[column] + u * step[0], np.arcsin(0.5 * (low + high) + v * (high - low)))
        share[row, column] = blocked(np.zeros_like(ray), 50.0 * ray, every).mean()
    assert ((share > 0.05) & (share < 0.95)).sum() > 10
    assert found == pytest.approx(share, abs=0.012)  # 0.01, and 0.002 of this way
    assert ((found > 0.0) & (truth(bodies).beam_target < 0)).sum() > 3  # which no ray in the middle of a cell meets


def test_a_sphere_covers_its_solid_angle() -> None:
    found = truth([placed(mesh_of(Sphere(radius=0.6, edge=0.03)), np.array([9.0, 0.4, -0.3]))]).beam_coverage
    cells = cells_of(BEAMS)
    size = cells.step[0] * (
        np.sin(BEAMS.elevation + 0.5 * cells.step[1]) - np.sin(BEAMS.elevation - 0.5 * cells.step[1])
    )
    cone = np.arcsin(0.6 / np.linalg.norm([9.0, 0.4, -0.3]))
    assert (found * size[:, None]).sum() == pytest.approx(2.0 * np.pi * (1.0 - np.cos(cone)), rel=0.005)


@pytest.mark.parametrize("bent", [False, True])
def test_a_frame_without_targets_or_snaps_has_labels_of_none(bent: bool) -> None:
    found = truth([], (snap((9.0, 0.0, 0.0)),), bent)
    shapes = {
        name: np.shape(getattr(found, name)) for name in ("full_box", "pixel_box", "true_image_box", "box_centre")
    }
    assert shapes == {"full_box": (0, 4), "pixel_box": (0, 4), "true_image_box": (0, 4), "box_centre": (0, 3)}
    assert found.lit_fraction.shape == (1, 0) and found.truncation.shape == found.in_view.shape == (0,)
    assert not found.beam_coverage.any() and found.beam_coverage.shape == found.beam_target.shape
    dark = truth([placed(mesh_of(Sphere(radius=0.3, edge=0.2)), np.array([9.0, 0.0, 0.0]))], (), bent)
    assert dark.lit_fraction.shape == (0, 1) and dark.view[0] == View.IN_VIEW
