"""Targets before, behind, upon and inside each other, and at the surface and the bottom: nothing is counted twice."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import Bools, Floats
from sonarsynth.description import FieldError
from sonarsynth.environment.sea import Environment, Isovelocity, Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Still
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.planning import plan
from sonarsynth.products import Arrivals
from sonarsynth.propagation import AutoTracing
from sonarsynth.receiver import PlanarLattice, Sonar
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.scene import Scene, World
from sonarsynth.scattering import Isotropic, Kirchhoff, MirrorLobe
from sonarsynth.scattering.law_notes import concave_note, facing_share
from sonarsynth.sources.shrimp import LogarithmicBubble, SnappingShrimp
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box, Cylinder, LShape, Remus100, Sphere
from sonarsynth.targets.target import Target
from sonarsynth.tracing.arrivals import trace
from tests.echoes import ARRAY, BOTTOM_DEPTH, EAST, PROFILE, ROMANIS, SCATTERED, C, transfer
from tests.echoes import heard as every_path

SOURCE = ARRAY + [3.0, 5.0, 1.3]
COHERENT = Kirchhoff()


def placed(mesh: Mesh, *place: float, turned: float = 1.1, name: str = "body") -> PlacedTarget:
    return PlacedTarget(name, mesh, Pose(np.array(place), quaternion(turned)), np.zeros(3))


def heard(
    bodies: tuple[PlacedTarget, ...],
    laws: tuple[object, ...],
    *,
    source: Floats = SOURCE,
    bounces: int = 0,
    bent: bool = False,
) -> Arrivals:
    """Every path; all of them finite."""
    bends = Profile(np.array([0.0, BOTTOM_DEPTH]), np.array([C + 8.0, C - 7.0]))
    found = every_path(bodies, source, laws, bounces=bounces, profile=bends if bent else PROFILE)
    for name, value in found.columns.items():
        assert np.isfinite(value).all(), name
    return found


def echoes(*args: object, **kwargs: object) -> Arrivals:
    found = heard(*args, **kwargs)
    return found.select(~found.direct)


def unhidden(bodies: tuple[PlacedTarget, ...], own: int, towards: Floats) -> tuple[Bools, Bools]:
    """Which facets (facet,) of a body face a point with no triangle before it, and of which this is in no doubt.

    Every triangle of every body is met by every ray, Moller and Trumbore (1997).
    """
    body = bodies[own]
    start, normal = body.pose.to_world(body.mesh.centroid), body.pose.turn_to_world(body.mesh.normal)
    ray = (towards - start)[:, None]
    hidden, sure = np.zeros(len(start), bool), np.ones(len(start), bool)
    for number, other in enumerate(bodies):
        corner = other.pose.to_world(other.mesh.corners.reshape(-1, 3)).reshape(-1, 3, 3)
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        across = np.cross(ray, two)
        determinant = (across * one).sum(-1)
        determinant[np.abs(determinant) < 1e-14] = 1e-14
        span = start[:, None] - corner[:, 0]
        turned = np.cross(span, one)
        u, v = (span * across).sum(-1) / determinant, (turned * ray).sum(-1) / determinant
        t = (turned * two).sum(-1) / determinant
        within = np.minimum(np.minimum(u, v), 1.0 - u - v)
        between = (t > 0) & (t < 1)
        if number == own:
            np.fill_diagonal(between, False)
        hidden |= (between & (within > 0)).any(axis=1)
        sure &= ~(between & (np.abs(within) < 1e-6)).any(axis=1)
    return (((towards - start) * normal).sum(axis=1) > 0) & ~hidden, sure


def ball(radius: float, edge: float) -> Mesh:
    return mesh_of(Sphere(radius=radius, edge=edge))


def cube(size: tuple[float, float, float], edge: float) -> Mesh:
    return mesh_of(Box(size=size, edge=edge))


BALL, HALF = Sphere(radius=0.5, edge=0.16), Box(size=(0.5, 0.5, 0.5), edge=0.13)
SMALL, ELL = Sphere(radius=0.4, edge=0.13), LShape(height=1.0, length=1.0, width=0.6, thickness=0.15, edge=0.18)
CROWDS = {
    "partly before another": (
        1.1,
        (SMALL, (8.0, 0.3, -14.9)),
        (Box(size=(0.8, 0.9, 1.0), edge=0.3), (10.0, 0.0, -15.0)),
    ),
    "an L shades itself": (5.0, (ELL, (7.0, 0.0, -7.0))),
    "one reaches into another": (1.1, (SMALL, (8.0, 0.3, -14.9)), (BALL, (8.3, 0.0, -15.0))),
    "one inside another": (1.1, (Sphere(radius=0.2, edge=0.1), (8.0, 0.3, -14.9)), (BALL, (8.05, 0.3, -14.9))),
    "side by side": (0.5 * np.pi, (HALF, (8.0, 0.25, -15.0)), (HALF, (8.0, -0.25, -15.0))),
    "one upon another": (1.1, (HALF, (8.0, 0.0, -14.75)), (HALF, (8.0, 0.1, -15.25))),
}
"""Headings, and shapes where they are."""


@pytest.mark.parametrize("crowd", CROWDS)
def test_facets_that_echo_are_those_that_no_triangle_hides(crowd: str) -> None:
    turned, *parts = CROWDS[crowd]
    bodies = tuple(placed(mesh_of(shape), *place, turned=turned) for shape, place in parts)
    laws = (COHERENT, MirrorLobe(width=1.0), Isotropic(strength=1e-3))
    shaded = 0
    for chosen in ((COHERENT,) * len(bodies), laws[1::-1][: len(bodies)]):
        found = echoes(bodies, chosen)
        pairs = list(zip(found.target.tolist(), found.facet.tolist(), strict=True))
        assert len(pairs) == len(set(pairs))
        for number, body in enumerate(bodies):
            (lit, sure), (seen, certain) = (unhidden(bodies, number, point) for point in (SOURCE, ARRAY))
            expected, sure = lit & seen, sure & certain
            got = np.zeros(len(expected), bool)
            got[found.facet[found.target == number]] = True
            if isinstance(chosen[number], Kirchhoff):  # a lobe may leave facets out that are too faint
                np.testing.assert_array_equal(got[sure], expected[sure])
            assert not (got & ~expected & sure).any()
            normal, middle = body.pose.turn_to_world(body.mesh.normal), body.pose.to_world(body.mesh.centroid)
            facing = [((point - middle) * normal).sum(axis=1) > 0 for point in (SOURCE, ARRAY)]
            shaded += int((facing[0] & facing[1] & ~expected).sum())
    assert shaded > 0 or crowd == "side by side"


def test_what_is_inside_another_body_is_not_heard() -> None:
    inner, outer = placed(ball(0.2, 0.05), 8, 0.3, -14.9), placed(ball(0.5, 0.05), 8, 0.3, -14.9)
    alone = transfer(echoes((outer,), (Kirchhoff(),)))
    for bodies in ((inner, outer), (outer, inner)):
        found = echoes(bodies, (Kirchhoff(),) * 2)
        assert set(found.target.tolist()) == {bodies.index(outer)}
        np.testing.assert_allclose(transfer(found), alone, rtol=1e-12)


@pytest.mark.parametrize("law", [Kirchhoff(), SCATTERED, Kirchhoff(roughness=0.003)])
@pytest.mark.parametrize("other", [Kirchhoff(), SCATTERED, MirrorLobe()])
@pytest.mark.parametrize("bent", [False, True])
def test_of_two_bodies_in_one_place_the_first_is_heard(law: object, other: object, bent: bool) -> None:
    one = placed(ball(0.4, 0.07), 8, 0.3, -14.9)
    alone, both = echoes((one,), (law,), bent=bent), echoes((one, one), (law, other), bent=bent)
    if other != law and law == SCATTERED:  # what the second blocks is not scattered forward by the first
        assert set(both.target.tolist()) == {0} and len(both.delay) < len(alone.delay)
        return
    assert set(both.target.tolist()) == {0}
    np.testing.assert_array_equal(both.facet, alone.facet)
    np.testing.assert_allclose(both.amplitude, alone.amplitude, rtol=1e-9)


def test_a_box_flush_in_the_face_of_another_adds_nothing_to_it() -> None:
    large, small = placed(cube((1.0, 1.0, 1.0), 0.06), 9, 0, -15), placed(cube((1.0, 0.5, 0.5), 0.04), 9, 0, -15)
    alone = transfer(echoes((large,), (COHERENT,)))
    np.testing.assert_allclose(transfer(echoes((large, small), (COHERENT,) * 2)), alone, rtol=1e-12)
    swapped = transfer(echoes((small, large), (COHERENT,) * 2))  # but for the facets that its edge cuts
    assert np.abs(swapped - alone).max() < 0.1 * np.abs(alone).max()


@pytest.mark.parametrize("law", [Kirchhoff(), SCATTERED])
def test_two_halves_are_heard_as_one_body(law: Kirchhoff) -> None:
    whole = cube((0.4, 0.8, 0.5), 0.03)
    half = cube((0.4, 0.4, 0.5), 0.03)
    source = ARRAY + [16.0, 0.5, 0.2] if law is SCATTERED else SOURCE
    sides = tuple(placed(half, 8, y, -15, turned=0.5 * np.pi) for y in (0.2, -0.2))
    one = transfer(heard((placed(whole, 8, 0, -15, turned=0.5 * np.pi),), (law,), source=source))
    two = transfer(heard(sides, (law,) * 2, source=source))
    assert np.abs(two - one).max() < 0.02 * np.abs(one).max()


@pytest.mark.parametrize("law", [Kirchhoff(), SCATTERED])
@pytest.mark.parametrize(("bounces", "bent"), [(0, False), (2, False), (1, True)])
@pytest.mark.parametrize("level", [-0.5, -BOTTOM_DEPTH + 0.5])
def test_a_box_with_a_face_in_the_surface_or_the_bed_echoes_as_one_just_off_it(
    law: Kirchhoff, bounces: int, bent: bool, level: float
) -> None:
    box, off = cube((0.8, 1.0, 1.0), 0.12), 1e-4 * np.sign(-15.0 - level)
    there = {"bounces": bounces, "bent": bent}
    found, near = (echoes((placed(box, 10, 0, level + up),), (law,), **there) for up in (0.0, off))
    assert (box.normal[found.facet, 2] * np.sign(level + 15.0) < 0.9).all()  # nothing from under it
    one, two = transfer(found), transfer(near)
    np.testing.assert_allclose(one, two, atol=0.1 * np.abs(two).max())  # 0.1 mm is up to 0.07 rad at 85 kHz
    assert len(found.delay) > 100


def scene(target: Target, depth: float) -> Recipe:
    environment = Environment(depth=depth, sound_speed=Isovelocity(speed=C))
    sonar = Sonar(array=PlanarLattice(columns=6, rows=6, pitch=0.05))
    return Recipe(
        scene=Scene(
            world=World(environment=environment, targets=(target,), sources=(SnappingShrimp(position=(14.0, -4.0)),)),
            sonar=sonar,
        )
    )


@pytest.mark.parametrize("z", [-0.2, 0.3, -11.8, -13.0])
def test_a_body_that_goes_through_a_boundary_is_refused_in_one_line(z: float) -> None:
    shape = Sphere(radius=0.5, edge=0.2)
    where = "above the surface" if z > -6 else "below the bottom"
    with pytest.raises(FieldError, match=f"targets.0.motion: target 'ball' is .* m {where}") as refused:
        plan(scene(Target(name="ball", shape=shape, motion=Still(position=(10.0, 0.0, z))), 12.0), {"cloud"})
    assert "\n" not in str(refused.value)
    up = z if z > -6 else z + 12.0 - BOTTOM_DEPTH
    with pytest.raises(ValueError, match=f"target 'body' reaches {where}"):
        heard((placed(mesh_of(shape), 10, 0, up),), (Kirchhoff(),))


def test_a_body_that_pokes_out_by_less_than_a_facet_is_refused() -> None:
    mesh = ball(0.5, 0.2)
    for z, where in ((-0.495, "above the surface"), (-BOTTOM_DEPTH + 0.495, "below the bottom")):
        with pytest.raises(ValueError, match=f"target 'body' reaches {where}"):
            heard((placed(mesh, 10, 0, z),), (Kirchhoff(),))


@pytest.mark.parametrize(("depth", "radius"), [(25.4, 0.1), (23.9, 0.55), (28.2, 0.97), (28.9, 0.23), (12.3, 0.7)])
def test_a_body_that_touches_a_boundary_within_rounding_is_in_the_water(depth: float, radius: float) -> None:
    for z in (-radius, round(radius - depth, 2)):
        for shape in (Sphere(radius=radius, edge=0.5 * radius), Box(size=(1.0, 1.0, 2.0 * radius))):
            still = Still(position=(10.0, 0.0, z), heading=0.7)
            made = plan(scene(Target(name="body", shape=shape, motion=still), depth), {"cloud"})
            body = made.recipe.frame(0)[1].moment.bodies[0]
            surface = Environment(depth=depth, sound_speed=Isovelocity(speed=C))
            snap = Emission(np.array([14.0, -4.0, -5.0]), 0.0, LogarithmicBubble(), None)
            water, receiver = Medium(surface, made.profile), Receiver(Pose(np.array([0.0, 0.0, -5.0]), EAST), ROMANIS)
            found = trace(FrameContext(0.0, (body,), (snap,), water, receiver, (Kirchhoff(),)), AutoTracing(bounces=1))
            assert np.isfinite(found.amplitude).all() and (found.target == 0).any()


@pytest.mark.parametrize("law", [Kirchhoff(), SCATTERED, MirrorLobe()])
def test_a_snap_inside_a_body_is_not_heard(law: object) -> None:
    assert not len(heard((placed(ball(0.5, 0.1), 10, 0, -15),), (law,), source=ARRAY + [10.1, 0.0, 0.1]).delay)


def test_a_dozen_bodies_of_all_laws_in_one_heap_stay_finite() -> None:
    rng = np.random.default_rng(5)
    shapes = (ball(0.4, 0.15), cube((0.5, 0.7, 0.4), 0.2), mesh_of(Cylinder(radius=0.2, length=1.0, edge=0.2)))
    laws = (Kirchhoff(), SCATTERED, Kirchhoff(roughness=0.005), MirrorLobe(), Isotropic(strength=1e-3), Kirchhoff())
    bodies = tuple(
        placed(shapes[n % 3], *(np.array([9.0, 0.0, -15.0]) + rng.uniform(-0.7, 0.7, 3)), turned=n) for n in range(12)
    )
    for source in (SOURCE, ARRAY + [18.0, 0.3, 0.2]):
        for bounces, bent in ((0, False), (1, True)):
            found = echoes(bodies, laws * 2, source=source, bounces=bounces, bent=bent)
            assert len(set(found.target.tolist())) > 3
            assert np.abs(transfer(found)).max() < 1.0 / 9.0  # no more than falls on them


def test_facets_that_face_each_other_are_noted_by_what_they_send_each_other() -> None:
    """Two squares at right angles: a fifth of what leaves one meets the other, 0.20004 (Hottel)."""
    corner = mesh_of(LShape(height=1.0, length=1.0, width=0.98, thickness=0.02, edge=0.3))
    expected = 2.0 * 0.98**2 * 0.20004 / corner.area.sum()
    assert facing_share(corner) == pytest.approx(expected, rel=0.03)
    assert "not simulated" in concave_note(corner)


@pytest.mark.parametrize(
    ("shape", "noted"),
    [
        (Sphere(radius=0.5, edge=0.05), False),
        (Box(size=(1.0, 0.2, 0.01)), False),
        (Cylinder(radius=0.2, length=1.0, edge=0.05), False),
        (Remus100(edge=0.03, fins=False), False),
        (Remus100(edge=0.03), True),
    ],
)
def test_convex_bodies_are_not_noted(shape: object, noted: bool) -> None:
    note = concave_note(mesh_of(shape))
    assert (note is not None) == noted
    assert note is None or "\n" not in note
