"""Ray casting against a search through all facets in float64, and against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from sonarsynth.casting import ray_casting
from sonarsynth.casting.horizons import UNKNOWN
from sonarsynth.casting.ray_casting import OFFSET, first_hit, occluded
from sonarsynth.casting.shadows import hide
from sonarsynth.conventions import NO_TARGET, Floats
from sonarsynth.geometry import Pose, quaternion, unit
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import ConstantVelocity
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Remus100
from sonarsynth.validation.references.frames.line_of_sight import Surface
from sonarsynth.validation.references.frames.moving_points import Mover
from sonarsynth.validation.references.frames.sound_paths import Solid, hidden
from sonarsynth.validation.references.rays.layered_rays import families, rays
from sonarsynth.validation.references.rays.layers_crossed import Water
from tests.bodies import mesh_from

SPHERE = mesh_from(trimesh.creation.icosphere(subdivisions=3), 0.5)
RING = mesh_from(trimesh.creation.torus(0.8, 0.3))  # concave
COPY = Mesh(RING.vertices + [0.1, 0.0, -0.2], RING.faces).scaled(0.37)


def search(mesh: Mesh, origin: Floats, direction: Floats) -> tuple[np.ndarray, Floats]:
    """Nearest facet and distance by Moeller and Trumbore's formulas over all facets."""
    facet, distance = np.full(len(origin), -1), np.full(len(origin), np.nan)
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    for i, (o, d) in enumerate(zip(origin, direction, strict=True)):
        q = np.cross(d, c - a)
        det = np.sum((b - a) * q, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.sum((o - a) * q, axis=1) / det
            r = np.cross(o - a, b - a)
            v, t = np.sum(d * r, axis=1) / det, np.sum((c - a) * r, axis=1) / det
            t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0), t, np.inf)
        if np.isfinite(t.min()):
            facet[i], distance[i] = int(np.argmin(t)), t.min()
    return facet, distance


def rays_at(size: float, away: float, count: int, seed: int) -> tuple[Floats, Floats]:
    """Rays from a sphere of radius `away` towards points within 1.05 of `size`."""
    rng = np.random.default_rng(seed)
    origin = away * unit(rng.normal(size=(count, 3)))
    aim = size * 1.05 * rng.uniform(size=(count, 1)) * unit(rng.normal(size=(count, 3)))
    return origin, unit(aim - origin)


@pytest.mark.parametrize("mesh", [SPHERE, RING, COPY])
@pytest.mark.parametrize("away", [0.1, 1.5, 20.0, 1000.0])
def test_the_first_facet_and_its_distance(mesh: Mesh, away: float) -> None:
    origin, direction = rays_at(mesh.radius, away, 400, 0)
    facet, distance = first_hit(mesh, origin, 3.0 * direction)
    expected, at = search(mesh, origin, direction)
    assert (facet == expected).mean() > 0.99  # on an edge either facet will do
    np.testing.assert_array_equal(facet < 0, expected < 0)
    np.testing.assert_allclose(distance, at, rtol=1e-13, atol=2e-9 * mesh.radius)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_the_size_of_the_body_does_not_matter(scale: float) -> None:
    origin, direction = rays_at(0.5, 3.0, 200, 1)
    facet, distance = first_hit(SPHERE, origin, direction)
    scaled = Mesh(SPHERE.vertices * scale, SPHERE.faces)
    facet2, distance2 = first_hit(scaled, origin * scale, direction)
    np.testing.assert_array_equal(facet, facet2)
    np.testing.assert_allclose(distance2, distance * scale, rtol=1e-12)


def test_rays_end_at_far_and_do_not_look_back() -> None:
    origin, ahead = np.array([[-2.0, 0.01, 0.02]]), np.array([[1.0, 0.0, 0.0]])
    facet, distance = first_hit(SPHERE, origin, ahead)
    assert facet[0] >= 0
    assert distance[0] == pytest.approx(1.5, abs=5e-3)
    assert first_hit(SPHERE, origin, -ahead)[0][0] == -1
    inside, out = first_hit(SPHERE, np.zeros((1, 3)), ahead)
    assert inside[0] >= 0
    assert out[0] == pytest.approx(0.5, abs=5e-3)


def place(mesh: Mesh, position: tuple[float, float, float], heading: float = 0.7) -> PlacedTarget:
    return PlacedTarget("body", mesh, Pose(np.array(position), quaternion(heading, 0.2, -0.4)), np.zeros(3))


def test_a_convex_body_hides_none_of_the_facets_that_face_away_from_it() -> None:
    body = place(SPHERE, (1000.0, -500.0, -30.0))
    centroid, normal = body.pose.to_world(SPHERE.centroid), body.pose.turn_to_world(SPHERE.normal)
    for eye in np.array([[1000.0, -480.0, -25.0], [1000.0, -499.4, -30.0], [2000.0, 500.0, -30.0]]):
        facing = np.sum(normal * (eye - centroid), axis=1) > 0
        start = centroid + OFFSET * SPHERE.radius * normal
        end = np.broadcast_to(eye, start.shape)
        hidden = occluded((body,), start, end)
        assert not hidden[facing].any()
        assert hidden[~facing].all()


def test_a_sphere_hides_what_is_in_its_shadow_and_no_more() -> None:
    body = place(SPHERE, (0.0, 0.0, -10.0))
    eye = np.array([5.0, 0.0, -10.0])
    rng = np.random.default_rng(3)
    end = np.stack([np.full(2000, -3.0), *rng.uniform(-1.5, 1.5, (2, 2000))], axis=1) + [0, 0, -10.0]
    start = np.broadcast_to(eye, end.shape)
    d = unit(end - start)
    off = np.linalg.norm(np.cross(body.pose.position - start, d), axis=1)  # of the ray from the centre
    hidden = occluded((body,), start, end)
    assert hidden[off < 0.49].all()
    assert not hidden[off > 0.5].any()
    before = occluded((body,), start, start + 0.9 * (4.5 - 0.0) * d)
    assert not before.any()
    assert np.array_equal(occluded((place(SPHERE, (50.0, 0.0, 0.0)), body), end, start), hidden)


def test_many_points_are_hidden_from_each_place_as_each_is_alone() -> None:
    bodies = place(RING, (0.0, 0.0, -10.0)), place(SPHERE, (0.9, 0.4, -9.8))
    rng = np.random.default_rng(5)
    near = np.concatenate([b.pose.to_world(b.mesh.centroid + 1e-6 * b.mesh.normal)[::9] for b in bodies])
    start = np.concatenate([near, rng.normal(0.0, 3.0, (40, 3)) + [0, 0, -10.0]])
    points = [6.0, 0.0, -10.0] + np.stack([np.zeros(400), *np.mgrid[-1.5:1.5:20j, -1.5:1.5:20j].reshape(2, -1)], 1)
    looked_at = rng.random((len(start), len(points))) < 0.7
    seen = looked_at.copy()
    hide(bodies, start, points, seen)
    row, point = np.nonzero(looked_at)
    alone = occluded(bodies, start[row], points[point])
    assert 0.2 < alone.mean() < 0.8
    assert np.array_equal(~seen[row, point], alone)
    assert not seen[~looked_at].any()


def test_what_cannot_be_cast_at_is_refused() -> None:
    bad = Mesh(np.full((3, 3), np.nan), np.array([[0, 1, 2]], np.int32))
    ray = np.ones((1, 3))
    with pytest.raises(ValueError, match="not finite"):
        first_hit(bad, ray, ray)
    with pytest.raises(ValueError, match="without extent"):
        first_hit(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], np.int32)), ray, ray)
    with pytest.raises(ValueError, match="finite origin and a direction"):
        first_hit(SPHERE, ray, 0 * ray)
    with pytest.raises(ValueError, match="finite ends"):
        occluded((place(SPHERE, (0, 0, 0)),), ray, np.nan * ray)


def test_a_mesh_is_made_ready_for_casting_once() -> None:
    again = Mesh(SPHERE.vertices.copy(), SPHERE.faces.copy())
    assert ray_casting.casting_mesh(SPHERE) is ray_casting.casting_mesh(again)


def test_copies_of_other_sizes_share_what_is_known_of_their_original() -> None:
    twice, half = (ray_casting.casting_mesh(SPHERE.scaled(factor)) for factor in (2.0, 0.5))
    assert twice.size == pytest.approx(4.0 * half.size)
    assert twice.caster is half.caster and twice.tree is half.tree
    assert twice is ray_casting.casting_mesh(SPHERE.scaled(2.0))


def test_a_wrong_proposal_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    ready = ray_casting.casting_mesh(RING)

    class Liar:
        """Proposes facet 0 too early, for three rounds."""

        rounds = 0

        def nearest(self, origin: Floats, direction: Floats, far: Floats) -> tuple[np.ndarray, Floats]:
            self.rounds += 1
            if self.rounds <= 3:
                return np.zeros(len(origin), int), np.full(len(origin), 1e-9)
            return ready.caster.nearest(origin, direction, far)

    lying = ray_casting.CastingMesh(ready.centre, ready.size, ready.vertices, ready.faces, Liar())  # type: ignore[arg-type]
    rays = rays_at(RING.radius, 3.0 * RING.radius, 300, 5)
    honest, at = first_hit(RING, *rays)
    assert (honest >= 0).sum() > 50
    monkeypatch.setattr(ray_casting, "casting_mesh", lambda _: lying)
    facet, distance = first_hit(RING, *rays)
    assert lying.caster.rounds > 3
    np.testing.assert_array_equal(facet, honest)
    np.testing.assert_allclose(distance, at, rtol=1e-12)


def test_a_moving_body_hides_where_it_is_when_the_ray_passes_it() -> None:
    """In the independent computation: a box that crosses a ray at 100 m/s is 1 m farther on after 10 ms, and 27 mm
    farther where the ray leaves it than where that enters."""
    box = mesh_of(Box(size=(0.4, 0.4, 0.4)))
    north = ConstantVelocity(start=(15.0, 0.0, -5.0), speed=100.0)  # towards y
    crossing = Solid(Mover(north, 0.0), Surface.of(box.vertices[box.faces]))
    beside, front, back = np.linspace(-3.0, 3.0, 399), 100.0 * 14.8 / 1500.0, 100.0 * 15.2 / 1500.0
    start, end = (np.column_stack([np.full(399, x), beside, np.full(399, -5.0)]) for x in (0.0, 30.0))
    for slower in (0.0, 1e-6):  # rays in one piece, and bent ones in several
        water = Water(np.array([0.0, 10.0]), np.array([1500.0, 1500.0 - slower]), 10.0)
        ray = rays(water, start, end, families(0)[0])
        found = hidden([crossing], water, start, end, ray, np.zeros(399), ray.time)
        np.testing.assert_array_equal(found, (beside > front - 0.2) & (beside < back + 0.2))


def off_facets(mesh: Mesh, count: int, seed: int) -> tuple[np.ndarray, Floats, Floats]:
    """Rays from the middles of facets, moved off them, to all sides: facet, origin and direction."""
    rng = np.random.default_rng(seed)
    facet, direction = rng.integers(0, len(mesh.faces), count), unit(rng.normal(size=(count, 3)))
    direction *= np.sign(np.sum(direction * mesh.normal[facet], axis=1))[:, None]
    return facet, mesh.centroid[facet] + OFFSET * mesh.radius * mesh.normal[facet], direction


@pytest.mark.parametrize("mesh", [RING, COPY, mesh_of(Remus100(edge=0.06))])
def test_rays_above_the_horizon_of_their_facet_meet_nothing(mesh: Mesh) -> None:
    facet, origin, direction = off_facets(mesh, 300, 7)
    sine, horizon = np.sum(direction * mesh.normal[facet], axis=1), ray_casting.casting_mesh(mesh).horizon(facet)[facet]
    octant = (direction < 0.0) @ [1, 2, 4]
    above = sine > horizon[np.arange(len(facet)), octant]
    assert (search(mesh, origin[above], direction[above])[0] < 0).all()
    assert 0.2 < (sine > horizon.max(axis=1)).mean() < above.mean() < 0.98  # fewer than above all that stands round it


def test_nothing_stands_over_the_facets_of_convex_bodies() -> None:
    for mesh in (SPHERE, mesh_of(Box(size=(0.4, 0.3, 0.2)))):
        assert not ray_casting.casting_mesh(mesh).horizon(np.arange(len(mesh.faces))).any()


def test_the_horizon_of_a_floor_is_the_edge_of_the_wall_on_it() -> None:
    floor = [[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [-1.0, 2.0, 0.0]]  # about the origin
    wall = [[0.6, -0.1, 0.0], [0.6, 0.1, 0.0], [0.6, 0.0, 0.8]]
    mesh = Mesh(np.array(floor + wall), np.arange(6, dtype=np.int32).reshape(2, 3))
    east = [[True, False] * 4]  # octants in which the wall stands: x is not below 0 there
    np.testing.assert_allclose(
        ray_casting.casting_mesh(mesh).horizon(np.array([0]))[:1], east
    )  # 0.8 m up at most, 0.6 m away
    low = Mesh(mesh.vertices * [1.0, 1.0, 0.5], mesh.faces)
    np.testing.assert_allclose(ray_casting.casting_mesh(low).horizon(np.array([0]))[:1], np.multiply(east, 0.4 / 0.6))


def test_a_horizon_is_the_same_whichever_facets_were_asked_for_before() -> None:
    one, other = (ray_casting.casting_mesh(RING.scaled(factor)) for factor in (1.1, 1.0))
    some, every = np.array([7, 3, 7, NO_TARGET]), np.arange(len(RING.faces))
    one, other = (replace(ready) for ready in (one, other))  # that know nothing yet
    few = one.horizon(some).copy()
    np.testing.assert_array_equal(np.flatnonzero((few != UNKNOWN).any(axis=1)), [3, 7])
    np.testing.assert_array_equal(one.horizon(every), other.horizon(every[::-1]))
    np.testing.assert_array_equal(one.horizon(every)[[3, 7]], few[[3, 7]])


def test_what_hides_a_facet_is_the_same_where_its_number_is_known() -> None:
    bodies = place(RING, (0.0, 0.0, -10.0)), place(SPHERE, (0.9, 0.4, -9.8))
    for number, body in enumerate(bodies):
        facet, origin, direction = off_facets(body.mesh, 2000, 11)
        start = body.pose.to_world(origin)
        end = start + 5.0 * body.pose.turn_to_world(direction)
        hidden = occluded(bodies, start, end)
        np.testing.assert_array_equal(occluded(bodies, start, end, np.full(2000, number), facet), hidden)
        assert 0.02 < hidden.mean() < 0.6


@pytest.mark.parametrize("mesh", [RING, mesh_of(Remus100(edge=0.06))])
def test_facets_that_face_a_place_are_hidden_from_it_as_rays_say(mesh: Mesh) -> None:
    body, rows, offset = place(mesh, (0.0, 0.0, -10.0)), np.arange(len(mesh.faces)), OFFSET * mesh.radius
    hidden = []
    for eye in unit(np.random.default_rng(5).normal(size=(6, 3))) * [4.0, 4.0, 1.0]:
        facet, met = ray_casting.faced_from(mesh, rows, offset, eye)
        np.testing.assert_array_equal(facet, np.flatnonzero(np.sum((eye - mesh.centroid) * mesh.normal, axis=1) > 0.0))
        start = body.pose.to_world(mesh.centroid[facet] + offset * mesh.normal[facet])
        np.testing.assert_array_equal(met, occluded((body,), start, np.tile(body.pose.to_world(eye), (len(facet), 1))))
        hidden.append(met.mean())
    assert 0.02 < np.mean(hidden) < 0.6
