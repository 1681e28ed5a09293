"""What is certain of cones of rays is so for each ray: all hydrophones see what each would see alone, to the last."""

from dataclasses import replace

import numpy as np
import pytest

from sonarsynth.casting.cones import CLOSED, EMPTY, UNKNOWN, classify_cones
from sonarsynth.casting.folded_rays import ray_cones
from sonarsynth.casting.ray_casting import occluded
from sonarsynth.conventions import Bools, Floats
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.environment.sound_speed import Isovelocity
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation import Propagation, Refracted, Straight
from sonarsynth.receiver import Elements, Romanis, elements
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.scattering import FacetLaw, Scatterers
from sonarsynth.state import Medium, Receiver, Tolerances
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Cylinder, LShape, Remus100, Shape, Sphere
from sonarsynth.tracing.facet_paths import bending
from sonarsynth.tracing.occlusion.ray_cones import SAGITTA_TOLERANCE, chords, hidden, layer_curvatures, spheres
from sonarsynth.tracing.occlusion.sensor_occlusion import Occlusion, cells, rim
from sonarsynth.tracing.receive_paths import ReceivePaths, facets_of, receive_paths

BOTTOM_DEPTH = 30.0
WATER = Environment(depth=BOTTOM_DEPTH, sound_speed=Isovelocity(speed=1500.0))
UNIFORM = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([1500.0, 1500.0]))
THERMOCLINE = Profile(
    np.array([0.0, 12.0, 14.0, 16.0, BOTTOM_DEPTH]), np.array([1540.0, 1539.0, 1533.0, 1529.0, 1528.0])
)
SONAR = Pose(np.array([0.0, 0.0, -15.0]), quaternion(0.5 * np.pi, 0.05, 0.02))


def array_of(count: int) -> Elements:
    """Some hydrophones of the whole array, in a wild order."""
    whole = elements(Romanis())
    return subarray(whole, np.random.default_rng(count).permutation(whole.count)[:count]).elements


def body(shape: Shape, place: tuple[float, float, float], *turned: float) -> PlacedTarget:
    return PlacedTarget("body", mesh_of(shape), Pose(np.array(place), quaternion(*turned)), np.zeros(3))


def seen_alone(view: Occlusion, legs: ReceivePaths, start: Floats, normal: Floats, sensor: int) -> Bools:
    """(leg,) whether a hydrophone does not see a leg, by the one ray to it."""
    array = view.receiver.elements.position
    offset = view.receiver.pose.turn_to_world(array[sensor])
    image = np.where((legs.bounces % 2 == 1)[:, None], offset * [1.0, 1.0, -1.0], offset)
    ahead = legs.length[:, None] * legs.departure + image
    length = np.linalg.norm(ahead, axis=1)
    ahead /= length[:, None]
    end = np.broadcast_to(view.receiver.pose.position + offset, start.shape)
    ray = start, end, ahead, length
    how = {"bounces": legs.bounces, "turning": legs.turning}
    blocked = hidden(view.bodies, view.bending, *ray, **how)
    return np.asarray(blocked | (np.einsum("ij,ij->i", ahead, normal) <= 0.0))


def shaded(bodies: tuple[PlacedTarget, ...], array: Elements, rays: Propagation, profile: Profile) -> Bools:
    """Hold every leg against each hydrophone by itself: (leg, sensor) which do not see it."""
    facets = facets_of(
        tuple(Scatterers.of_body(b, FacetLaw()) for b in bodies), slice(0, sum(len(b.mesh.faces) for b in bodies))
    )
    water, receiver = Medium(WATER, profile), Receiver(SONAR, array)
    legs = receive_paths(facets, water, receiver, rays, array.aperture)
    view = Occlusion(bodies, bending(water, rays, receiver), receiver, rays, Tolerances(occlusion="sensors"))
    side = facets.clear[legs.row], facets.normal[legs.row]
    alone = np.stack([seen_alone(view, legs, *side, sensor) for sensor in range(array.count)], axis=1)
    numbered = replace(legs, caustics=np.arange(len(legs.row)))
    seen = view.visible(numbered, facets.starts(legs.row, legs.departure))
    seen = view.settled(seen, facets.starts(seen.row, seen.departure))
    assert not seen.open.any()
    found = np.ones_like(alone)
    found[seen.caustics] = np.unpackbits(seen.occluded, axis=1, count=1 + array.count)[:, 1:]
    np.testing.assert_array_equal(found, alone)
    return alone


def mixed(dark: Bools) -> Bools:
    """(leg,) which some hydrophones see and others do not."""
    return np.asarray(dark.any(axis=1) & ~dark.all(axis=1))


def some_bodies(seed: int) -> tuple[PlacedTarget, ...]:
    """Bodies of every kind, some before others."""
    rng = np.random.default_rng(seed)
    plates = LShape(height=0.8, length=0.6, width=0.5, thickness=0.05, edge=0.3)
    round_ones: list[Shape] = [Sphere(radius=0.4, edge=0.15), Cylinder(length=1.2, radius=0.15, edge=0.1)]
    shapes: list[Shape] = [Box(size=(0.8, 0.5, 0.4), edge=0.2), plates, *round_ones, Remus100(edge=0.12)]
    picked = rng.permutation(len(shapes))[:3]
    place = np.column_stack([rng.uniform(7.0, 16.0, 3), rng.uniform(-0.7, 0.7, 3), rng.uniform(-15.6, -14.4, 3)])
    return tuple(body(shapes[n], tuple(p), *rng.uniform(-3.0, 3.0, 3)) for n, p in zip(picked, place, strict=True))


@pytest.mark.parametrize("seed", [2, 3])
@pytest.mark.parametrize("rays", [Straight(), Straight(bounces=1), Refracted(bounces=1)])
def test_verdicts_are_those_of_each_hydrophone_alone(seed: int, rays: Propagation) -> None:
    few = array_of(61)
    dark = shaded(some_bodies(seed), few, rays, THERMOCLINE if rays.bends else UNIFORM)
    assert mixed(dark).sum() > 5
    assert mixed(dark).mean() < 0.8


def one_in_the_middle(array: Elements) -> Floats:
    """(xyz) in the world: of a hydrophone far from the rim and the centre of the array."""
    wanted = 0.4 * array.aperture * np.array([0.0, 0.7, 0.7])
    sensor = int(np.argmin(np.linalg.norm(array.position - wanted, axis=1)))
    return np.asarray(SONAR.to_world(array.position[sensor][None])[0])


def test_a_rod_that_hides_from_few_in_the_middle_is_found() -> None:
    """Thinner than the spaces between hydrophones."""
    array = array_of(121)
    ball = body(Box(size=(0.05, 0.05, 0.05)), (20.0, 0.0, -15.0), 0.0)
    place = 0.9 * one_in_the_middle(array) + 0.1 * ball.pose.position
    dark = shaded((ball, body(Cylinder(length=0.02, radius=0.004), tuple(place), 0.0)), array, Straight(), UNIFORM)
    assert (mixed(dark) & ~dark[:, rim(array)].any(axis=1)).any()


def test_a_hole_that_few_in_the_middle_see_through_is_found() -> None:
    """Two slits, one behind the other and across it."""
    array = array_of(121)
    ball = body(Box(size=(0.01, 0.01, 0.01)), (20.0, 0.0, -15.0), 0.0)
    _, y, z = 0.5 * (one_in_the_middle(array) + ball.pose.position)
    plate = Box(size=(0.02, 2.0, 2.0))
    lying = [body(plate, (10.0, y, z + off), 0.5 * np.pi) for off in (1.004, -1.004)]
    upright = [body(plate, (10.1, y + off, z), 0.5 * np.pi) for off in (1.004, -1.004)]
    dark = shaded((ball, *lying, *upright), array, Straight(), UNIFORM)
    assert (mixed(dark) & dark[:, rim(array)].all(axis=1)).any()


@pytest.mark.parametrize("seed", range(3))
def test_cones_that_are_certain_are_so_for_any_ray_in_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bodies = some_bodies(seed)
    count = 3000
    apex = rng.uniform([5.0, -2.0, -17.0], [18.0, 2.0, -13.0], (count, 3))
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    slope, reach = 10.0 ** rng.uniform(-3.0, -1.0, count), rng.uniform(1.0, 15.0, count)
    found = classify_cones(bodies, apex, axis, slope, reach, reach)
    blocked = np.zeros((40, count), bool)
    for ray in blocked:
        across = np.cross(axis, rng.normal(size=(count, 3)))
        across *= (rng.uniform(size=count) ** 0.5 * slope / np.linalg.norm(across, axis=1))[:, None]
        ray[:] = occluded(bodies, apex, apex + reach[:, None] * (axis + across))
    assert not blocked[:, found == EMPTY].any()
    assert blocked[:, found == CLOSED].all()
    alike = blocked.all(axis=0) | ~blocked.any(axis=0)
    assert (found == CLOSED).sum() > 20
    assert (found[alike] == UNKNOWN).mean() < 0.2  # and little else is uncertain


@pytest.mark.parametrize("seed", range(2))
def test_cones_above_the_horizon_of_their_facet_are_empty_of_its_body(seed: int) -> None:
    rng, bodies = np.random.default_rng(seed), some_bodies(seed)
    facets = facets_of(tuple(Scatterers.of_body(body, FacetLaw()) for body in bodies), slice(0, 10**9))
    facets = facets.select(rng.choice(len(facets.facet), 3000))
    axis = rng.normal(size=(3000, 3)) + 2.0 * facets.normal
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    cones = facets.clear, axis, 10.0 ** rng.uniform(-4.0, -0.5, 3000), *np.full((2, 3000), 9.0)
    known, unknown = (classify_cones(bodies, *cones, of) for of in ((facets.owner, facets.facet), (None, None)))
    assert ((known == unknown) | (known == EMPTY)).all()
    for angle in np.linspace(0.0, 2.0 * np.pi, 7):
        one, other = np.cross(axis, facets.normal), np.cross(axis, np.cross(axis, facets.normal))
        across = np.cos(angle) * one + np.sin(angle) * other
        across *= (cones[2] / np.linalg.norm(across, axis=1))[:, None]
        blocked = occluded(bodies, facets.clear, facets.clear + 9.0 * (axis + across))
        assert not blocked[known == EMPTY].any()
    assert (known == EMPTY).sum() > 500


@pytest.mark.parametrize("water", [UNIFORM, THERMOCLINE])
def test_rays_are_hidden_where_their_chords_meet_a_body(water: Profile) -> None:
    medium, bodies = Medium(WATER, water), some_bodies(1)
    facets = facets_of(tuple(Scatterers.of_body(body, FacetLaw()) for body in bodies), slice(0, 10**9))
    receiver = Receiver(SONAR, array_of(61))
    legs = receive_paths(facets, medium, receiver, Refracted(bounces=2))
    own = facets.owner[legs.row], facets.facet[legs.row]
    ray = facets.clear[legs.row], np.broadcast_to(SONAR.position, legs.point.shape), legs.departure, legs.length
    blocked = hidden(bodies, medium, *ray, bounces=legs.bounces, turning=legs.turning, facets=own)
    ray_of, points = chords(medium, ray[0], legs.departure, legs.length)
    piece = np.flatnonzero(np.diff(ray_of) == 0)
    met = np.zeros(len(legs.row), bool)
    met[ray_of[piece[occluded(bodies, points[piece], points[piece + 1])]]] = True
    assert (met != blocked).mean() < 1e-3  # chords are beside rays by a little
    assert 0.05 < met.mean() < 0.95


def cones_of(profile: Profile, legs: ReceivePaths, clear: Floats) -> tuple[Floats, Floats]:
    """Slopes and reach (leg,) of the cones of rays among some bodies."""
    ray = clear, np.broadcast_to(SONAR.position, clear.shape), legs.departure, legs.length, np.zeros(len(clear))
    limits = layer_curvatures(profile), SAGITTA_TOLERANCE, BOTTOM_DEPTH
    slope, reach, _ = ray_cones(*ray, legs.bounces, legs.turning, *limits, *spheres(some_bodies(1)))
    return slope, reach


@pytest.mark.parametrize("gradient", [-0.05, -3.0])  # 1/s, of the layers that the rays begin in
def test_cones_hold_their_rays_and_are_no_wider_for_a_steep_layer_elsewhere(gradient: float) -> None:
    depth, bodies = np.array([0.0, 24.0, 26.0, BOTTOM_DEPTH]), some_bodies(1)
    above = 1540.0 + gradient * depth[:2]
    plain, layered = (Profile(depth, np.array([*above, c, c])) for c in (above[1] - 0.01, above[1] - 40.0))
    facets = facets_of(tuple(Scatterers.of_body(body, FacetLaw()) for body in bodies), slice(0, 10**9))
    medium = Medium(WATER, layered)
    legs = receive_paths(facets, medium, Receiver(SONAR, array_of(61)), Refracted(bounces=2))
    clear = facets.clear[legs.row]
    slope, reach = cones_of(layered, legs, clear)
    ray, points = chords(medium, clear, legs.departure, legs.length)
    away = points - clear[ray]
    along = np.einsum("ij,ij->i", away, legs.departure[ray])
    aside = np.linalg.norm(away - along[:, None] * legs.departure[ray], axis=1)
    same = np.diff(ray, prepend=-1) == 0
    gone = np.cumsum(np.where(same, np.linalg.norm(np.diff(points, axis=0, prepend=0.0), axis=1), 0.0))
    gone -= gone[np.searchsorted(ray, ray)]
    held = np.isfinite(slope[ray]) & (gone > 0.0) & (gone <= reach[ray])
    assert (aside <= slope[ray] * along + 2.0 * SAGITTA_TOLERANCE)[held].all()
    assert held.sum() > 100
    sure = np.isfinite(slope) & (legs.bounces == 0)
    assert np.median(slope[sure]) < 1.5 * np.median(cones_of(plain, legs, clear)[0][sure])


def test_parts_of_an_array_hold_all_of_it() -> None:
    for count in (2, 3, 7, 61, 508):
        array = array_of(count)
        parts = cells(array)
        points = np.concatenate([np.zeros((1, 3)), array.position])
        away = np.linalg.norm(points - parts.centre[parts.cell], axis=1)
        assert (away <= parts.radius[parts.cell]).all()
        assert set(parts.cell) == set(range(len(parts.radius)))
