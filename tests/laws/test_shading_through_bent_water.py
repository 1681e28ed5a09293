"""Through bending water, off surface and bottom: the array sees what each hydrophone, traced by itself, sees."""

import numpy as np
import pytest

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation import Propagation, Refracted
from sonarsynth.receiver import Elements
from sonarsynth.scattering import FacetLaw, Scatterers
from sonarsynth.state import Medium, Receiver, Tolerances
from sonarsynth.targets.shapes import Box, Sphere
from sonarsynth.tracing.occlusion.ray_cones import hidden
from sonarsynth.tracing.occlusion.sensor_occlusion import Occlusion
from sonarsynth.tracing.receive_paths import Facets, ReceivePaths, facets_of, may_face_receiver, receive_paths
from tests.laws.test_shading_by_cones import SONAR, WATER, array_of, body, some_bodies

DEPTHS = np.array([0.0, 8.0, 12.0, 17.0, 22.0, 30.0])
PROFILES = {
    "a steep gradient": Profile(DEPTHS[[0, -1]], np.array([1560.0, 1480.0])),
    "over the array": Profile(DEPTHS, np.array([1550.0, 1549.0, 1520.0, 1519.0, 1518.0, 1517.0])),
    "at the array and under it": Profile(DEPTHS, np.array([1540.0, 1539.0, 1538.0, 1528.0, 1500.0, 1501.0])),
}
BENT = pytest.mark.parametrize("profile", PROFILES.values(), ids=PROFILES.keys())
ARRAY = array_of(61)


def names(legs: ReceivePaths) -> Ints:
    """(leg,) facet and family; which side direct ones leave on may differ over the array."""
    up = (legs.departure[:, 2] > 0.0) & (legs.bounces > 0)
    return np.asarray(9 * (2 * legs.row + up) + 3 * legs.surface + legs.bottom)


def seen_by(
    bodies: tuple[PlacedTarget, ...], facets: Facets, rays: Propagation, profile: Profile, place: Floats
) -> Ints:
    """Names of the legs to one place that no body hides."""
    pose = Pose(place, SONAR.orientation)
    water, receiver = Medium(WATER, profile), Receiver(pose, ARRAY)
    legs = receive_paths(facets, water, receiver, rays)
    view = Occlusion(bodies, water, receiver, rays, Tolerances())
    return names(view.visible(legs, facets.starts(legs.row, legs.departure)))


def seen_by_all(
    bodies: tuple[PlacedTarget, ...], facets: Facets, rays: Propagation, profile: Profile, array: Elements
) -> tuple[Ints, Bools]:
    """Names of the legs that any hydrophone sees, and from which they are hidden (leg, sensor)."""
    water, receiver = Medium(WATER, profile), Receiver(SONAR, array)
    legs = receive_paths(facets, water, receiver, rays, array.aperture)
    view = Occlusion(bodies, water, receiver, rays, Tolerances(occlusion="sensors"))
    legs = view.visible(legs, facets.starts(legs.row, legs.departure))
    legs = view.settled(legs, facets.starts(legs.row, legs.departure))
    hidden = np.unpackbits(legs.occluded, axis=1, count=1 + array.count)[:, 1:]
    return names(legs), hidden.astype(bool)


def some_facets(seed: int) -> tuple[tuple[PlacedTarget, ...], Facets]:
    """Bodies, some before others, and some of their facets; of a ball many near its limb."""
    ball = body(Sphere(radius=0.5, edge=0.05), (12.0, 0.9, -14.5), 0.0)
    bodies = (*some_bodies(seed), ball)
    count = [len(b.mesh.faces) for b in bodies]
    every = facets_of(tuple(Scatterers.of_body(b, FacetLaw()) for b in bodies), slice(0, sum(count)))
    return bodies, every.select(np.unique(np.linspace(0, sum(count) - 1, 1500).astype(int)))


@BENT
@pytest.mark.parametrize(("bounces", "seed"), [(0, 0), (0, 1), (2, 1), (2, 2)])
def test_the_array_sees_what_each_hydrophone_sees(profile: Profile, bounces: int, seed: int) -> None:
    """But for facets at the very limb: rays are taken to leave for the images of hydrophones, millimetres beside."""
    bodies, facets = some_facets(seed)
    rays = Refracted(bounces=bounces)
    found, hidden = seen_by_all(bodies, facets, rays, profile, ARRAY)
    assert (hidden.any(axis=1) & ~hidden.all(axis=1)).sum() > 100
    odd = seen = 0
    for sensor in range(0, ARRAY.count, 4):
        place = SONAR.to_world(ARRAY.position[[sensor]])[0]
        alone = seen_by(bodies, facets, rays, profile, place)
        odd += len(np.setxor1d(found[~hidden[:, sensor]], alone))
        seen += len(alone)
    assert odd <= 1e-3 * seen


@BENT
def test_facets_that_rays_can_leave_for_the_array_are_found_and_few_others(profile: Profile) -> None:
    _, facets = some_facets(1)
    end = np.broadcast_to(SONAR.position, facets.point.shape)
    rays = Refracted().connect(profile, WATER.depth, facets.point, end)
    ahead = np.einsum("ij,ij->i", facets.normal[rays.pair], rays.departure) > 0.0
    found = may_face_receiver(facets, SONAR.position, 0, Medium(WATER, profile))
    assert set(rays.pair[ahead]) <= set(found)
    assert len(found) < 1.05 * len(set(rays.pair[ahead]))


@pytest.mark.parametrize("far", [4.5, 20.0])  # 0.8 and 17 mm off the straight line in the middle
def test_a_bent_ray_passes_an_edge_by_hundredths_of_a_millimetre(far: float) -> None:
    """Arcs of circles about the depth at which the speed would be 0: 0.02 mm over the edge of a post, and under."""
    fast, slope, z, half = 1500.0, -0.5, -15.0, 0.5 * far
    water = Medium(WATER, Profile(DEPTHS[[0, -1]], fast + slope * DEPTHS[[0, -1]]))
    up = -fast / slope + z  # from the centre of the circle
    radius = np.hypot(up, half)
    ray = np.array([[0.0, 0.0, z]]), np.array([[far, 0.0, z]]), np.array([[up, 0.0, half]]) / radius
    for x in np.linspace(0.05, 0.95, 19) * far:
        top = z + np.sqrt(radius**2 - (x - half) ** 2) - up
        for over in (-2e-5, 2e-5):
            post = body(Box(size=(1e-3, 1e-3, 0.1), edge=0.1), (x, 0.0, top + over - 0.05), 0.0)
            length = np.array([2.0 * radius * np.arcsin(half / radius)])
            assert hidden((post,), water, *ray, length)[0] == (over > 0.0), (x, over)
