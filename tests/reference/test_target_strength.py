"""Target strength against exact series, plates, cylinders, and what it must obey whatever the body."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth.equations.scattering.kirchhoff_integral import rectangular_plate
from sonarsynth.geometry.curvature import curvature_radius
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.targets.mesh_resolution import CoarseMesh, expected_error, fine_mesh
from sonarsynth.targets.meshes import mesh_of

BAND = np.arange(25e3, 110.1e3, 2.5e3)
FLAT = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def directions(count: int, seed: int = 1) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(count, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def test_behind_a_body_there_is_no_echo() -> None:
    """The wave that makes the shadow is left out, of round bodies as of those with edges."""
    ahead = ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0))
    for body in (ss.Sphere(radius=0.25), ss.Box(size=(0.5, 0.5, 0.5)), ss.Cylinder(radius=0.2, length=0.5)):
        assert ss.target_strength(body, 30e3, *ahead) == -np.inf


def test_the_example_of_the_documentation() -> None:
    got = ss.target_strength(
        ss.Sphere(radius=0.25),
        frequency=50e3,
        incident=(1, 0, 0),
        scattered=(-1, 0, 0),
        sound_speed=1500.0,
        scattering=ss.Kirchhoff(surface="rigid"),
    )
    assert got.shape == ()
    assert got == pytest.approx(-18.07, abs=0.3)


def test_a_face_of_a_box_is_a_plate_with_its_lobes_and_nulls() -> None:
    """Area over wavelength straight on; nulls where 2 L sin a is a whole number of wavelengths; between them, sinc."""
    box, side, frequency = ss.Box(size=(0.2, 0.6, 0.4)), 0.6, 60e3
    wavelength = 1500.0 / frequency
    assert ss.target_strength(box, frequency, (-1, 0, 0), (1, 0, 0)) == pytest.approx(
        20 * np.log10(0.6 * 0.4 / wavelength), abs=1e-9
    )
    # The face y > 0 is lit as well but for ways out that it cannot be seen from: one in, one out on either side.
    sine = np.arange(1, 6) * wavelength / (2 * side)
    way_in = np.stack([-np.sqrt(1 - sine**2), -sine, 0 * sine], axis=-1)
    way_out = np.stack([np.sqrt(1 - sine**2), -sine, 0 * sine], axis=-1)
    np.testing.assert_allclose(
        ss.target_strength(box, frequency, way_in, way_out), 20 * np.log10(0.24 / wavelength * way_out[:, 0]), atol=1e-9
    )
    normal_in, lobe = np.array([-1.0, 0.0, 0.0]), (np.arange(1, 6) + 0.5) * wavelength / side
    for places, null in ((np.arange(1, 6) * wavelength / side, True), (lobe, False)):
        out = np.stack([np.sqrt(1 - places**2), places, 0 * places], axis=-1)
        got = ss.target_strength(box, frequency, normal_in, out)
        k = 2 * np.pi / wavelength
        plate = np.abs(rectangular_plate((side, 0.4), (0, 0, -1.0), out[:, [1, 2, 0]], k))
        if null:
            assert (got < -200).all()
        else:
            np.testing.assert_allclose(got, 20 * np.log10(plate), atol=1e-9)


def test_a_cylinder_seen_end_on_is_a_disc() -> None:
    got = ss.target_strength(ss.Cylinder(radius=0.1, length=0.4), 50e3, (-1, 0, 0), (1, 0, 0), 1500.0)
    assert got == pytest.approx(20 * np.log10(np.pi * 0.01 / 0.03), abs=0.02)


@pytest.mark.parametrize(
    "law",
    [
        ss.Kirchhoff(),
        ss.Kirchhoff(surface="soft"),
        ss.Kirchhoff(surface=ss.PartlyReflecting(density_ratio=1.5, speed_ratio=1.2)),
        ss.Kirchhoff(roughness=0.003),
        ss.MirrorLobe(),
        ss.Isotropic(),
    ],
)
@pytest.mark.parametrize(
    "shape", [ss.Remus100(edge=0.03), ss.LShape(height=0.4, length=0.5, width=0.3, thickness=0.05)]
)
def test_source_and_receiver_may_be_exchanged(shape: ss.Remus100 | ss.LShape, law: ss.Kirchhoff) -> None:
    mesh = mesh_of(shape)
    one, other = directions(6, 3), directions(6, 4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseMesh)
        there = ss.target_strength(mesh, 30e3, one, other, 1500.0, law)
        back = ss.target_strength(mesh, 30e3, -other, -one, 1500.0, law)
    np.testing.assert_allclose(there, back, rtol=1e-9, atol=1e-6)


def test_a_half_space_of_known_contrast_reflects_its_share() -> None:
    sphere, sand = ss.Sphere(radius=0.25), ss.PartlyReflecting(density_ratio=2.0, speed_ratio=1.5)
    rigid, partly = (
        ss.target_strength(sphere, BAND, (1, 0, 0), (-1, 0, 0), 1500.0, ss.Kirchhoff(surface=surface))
        for surface in ("rigid", sand)
    )
    np.testing.assert_allclose(partly - rigid, 20 * np.log10((2.0 * 1.5 - 1) / (2.0 * 1.5 + 1)), atol=1e-9)


@pytest.mark.parametrize("density", [1e-9, 1e9])
@pytest.mark.parametrize("speed", [1e-9, 1e9])
def test_a_body_of_any_contrast_has_an_echo_and_none_without_digits(density: float, speed: float) -> None:
    box, along = ss.Box(size=(0.5, 0.3, 0.2)), ((1, 0, 0), (-1, 0, 0))
    law = ss.Kirchhoff(surface=ss.PartlyReflecting(density_ratio=density, speed_ratio=speed, loss_tangent=1.0))
    assert ss.target_strength(box, 60e3, *along, scattering=law) <= ss.target_strength(box, 60e3, *along) + 1e-9
    with pytest.raises(ValueError, match="speed_ratio"):  # it had NaN
        ss.PartlyReflecting(density_ratio=density, speed_ratio=1e-200)


def test_a_rough_plate_loses_its_coherent_echo_and_keeps_a_lobe() -> None:
    """Straight on: A/lambda exp(-g^2/2) with g = 2 k h, and (1 - exp(-g^2)) A/(8 pi s^2) of power besides."""
    box, frequency, height, slope = ss.Box(size=(0.1, 1.0, 1.0)), np.array([20e3, 50e3, 200e3]), 0.002, 0.15
    g = 2 * (2 * np.pi * frequency / 1500.0) * height
    power = (frequency / 1500.0) ** 2 * np.exp(-(g**2)) - np.expm1(-(g**2)) / (8 * np.pi * slope**2)
    got = ss.target_strength(box, frequency, (-1, 0, 0), (1, 0, 0), 1500.0, ss.Kirchhoff(roughness=height, slope=slope))
    np.testing.assert_allclose(got, 10 * np.log10(power), atol=1e-9)


def test_shadow_of_a_body_on_itself() -> None:
    """Two plates: the nearer hides all of the farther, and half of it where it is moved aside by half."""
    near, far = plate(2.0, 0.0), plate(0.0, 0.0)
    alone = ss.target_strength(far, 50e3, (-1, 0, 0), (1, 0, 0))
    assert ss.target_strength(joined(near, far), 50e3, (-1, 0, 0), (1, 0, 0)) == pytest.approx(alone, abs=1e-9)
    wavelength = 0.03
    aside = joined(plate(100 * wavelength, 1.0), far)  # in phase: 1.5 times one plate where half is seen
    both = ss.target_strength(aside, 50e3, (-1, 0, 0), (1, 0, 0))
    assert both - alone == pytest.approx(20 * np.log10(1.5), abs=1e-6)


def plate(x: float, y: float, cuts: int = 20) -> Mesh:
    """A square of 2 m in the plane x, facing +x, its middle at y."""
    at = np.linspace(-1.0, 1.0, cuts + 1)
    p, q = np.meshgrid(at, at, indexing="ij")
    vertices = np.stack([np.full(p.size, x), p.ravel() + y, q.ravel()], axis=-1)
    i, j = (n.ravel() for n in np.meshgrid(np.arange(cuts), np.arange(cuts), indexing="ij"))
    a, step = i * (cuts + 1) + j, cuts + 1
    faces = np.concatenate([np.stack([a, a + step, a + step + 1], 1), np.stack([a, a + step + 1, a + 1], 1)])
    return Mesh(vertices, faces.astype(np.int32))


def joined(one: Mesh, other: Mesh) -> Mesh:
    faces = np.concatenate([one.faces, other.faces + len(one.vertices)]).astype(np.int32)
    return Mesh(np.concatenate([one.vertices, other.vertices]), faces)


@pytest.mark.filterwarnings("ignore::sonarsynth.scattering.law_notes.SmallBody")
def test_powers_of_a_lobe_are_summed_and_do_not_depend_on_frequency() -> None:
    box = ss.Box(size=(1.0, 1.0, 1.0))
    coarse = ss.target_strength(box, [1e3, 1e5], (-1, 0, 0), (1, 0, 0), 1500.0, ss.MirrorLobe())
    fine = ss.target_strength(replace(box, edge=0.1), [1e3, 1e5], (-1, 0, 0), (1, 0, 0), 1500.0, ss.MirrorLobe())
    np.testing.assert_allclose(coarse, fine, atol=1e-9)
    assert coarse[0] == coarse[1]


def test_nothing_comes_back_from_a_plate_edge_on() -> None:
    square = plate(0.0, 0.0)
    assert ss.target_strength(square, 50e3, FLAT[1], (0.0, 0.0, -1.0)) == -np.inf
    assert ss.target_strength(square, 50e3, (1, 0, 0), (-1, 0, 0)) == -np.inf  # its back


@pytest.mark.parametrize(
    "shape", [ss.Sphere(radius=0.3), ss.Cylinder(radius=0.2, length=0.5), ss.Remus100(edge=0.05, fins=False)]
)
def test_shapes_are_refined_until_the_error_is_as_asked(shape: ss.Sphere) -> None:
    wavelength = 1500.0 / 40e3
    facets = [0]
    for error in (0.08, 0.04, 0.02):
        mesh = fine_mesh(shape, wavelength, error)
        assert expected_error(mesh, wavelength) < 1.1 * error
        facets.append(len(mesh.faces))
    assert facets == sorted(facets)


def test_a_mesh_that_is_too_coarse_is_reported_with_its_error() -> None:
    with pytest.warns(CoarseMesh, match=r"facets of .* mm are too coarse for waves of 13.6 mm: expect an error of"):
        ss.target_strength(mesh_of(ss.Sphere(radius=0.25, edge=0.06)), 110e3, (1, 0, 0), (-1, 0, 0))


def test_the_curvature_is_that_of_the_surface() -> None:
    assert np.isinf(curvature_radius(mesh_of(ss.Box(size=(1.0, 2.0, 3.0), edge=0.4)))).all()
    ball = curvature_radius(mesh_of(ss.Sphere(radius=2.0)))
    assert 1.7 < ball.min() <= ball.max() < 2.05
    drum = mesh_of(ss.Cylinder(radius=2.0, length=5.0))
    round_side = np.abs(drum.normal[:, 0]) < 0.5
    assert np.abs(curvature_radius(drum)[round_side] / 2.0 - 1).max() < 0.1
    assert np.isinf(curvature_radius(drum)[~round_side]).all()


def test_arrays_broadcast_and_a_target_is_its_shape() -> None:
    shape = ss.Box(size=(0.4, 0.3, 0.2))
    incident, speed = directions(4)[:, None, None], np.array([1450.0, 1550.0])[:, None]
    got = ss.target_strength(shape, BAND[:3], incident, -incident, speed)
    assert got.shape == (4, 2, 3)
    target = ss.Target(name="box", shape=shape, motion=ss.Still(position=(0.0, 0.0, -5.0)))
    for i, j, f in ((0, 0, 0), (3, 1, 2), (2, 0, 1)):
        way = incident[i, 0, 0]
        assert ss.target_strength(target, BAND[f], way, -way, speed[j, 0]) == pytest.approx(got[i, j, f], abs=1e-9)
    assert ss.target_strength(shape, [], (1, 0, 0), (-1, 0, 0)).shape == (0,)


@pytest.mark.parametrize("scale", [0.5, 3.0])
def test_a_target_is_as_large_as_its_scale_and_scatters_by_its_own_law(scale: float) -> None:
    """At a wavelength so many times as long a body so many times as large is 20 lg of that stronger."""
    shape, rough = ss.Myring(nose=0.2, middle=0.3, tail=0.3, diameter=0.2), ss.MirrorLobe(width=0.3)
    target = ss.Target(name="hull", shape=shape, motion=ss.Still(position=(0.0, 0.0, -5.0)), scale=scale)
    incident, larger = directions(6)[:, None], 20.0 * np.log10(scale)
    of_shape = ss.target_strength(shape, BAND[::8], incident, -incident)
    assert ss.target_strength(target, BAND[::8] / scale, incident, -incident) == pytest.approx(of_shape + larger)
    lobes = ss.target_strength(shape, 60e3, incident, -incident, scattering=rough)
    own = replace(target, scattering=rough)
    assert ss.target_strength(own, 60e3, incident, -incident) == pytest.approx(lobes + larger)
    soft = ss.target_strength(own, 60e3, incident, -incident, scattering=ss.Kirchhoff(surface="soft"))
    assert soft == pytest.approx(ss.target_strength(target, 60e3, incident, -incident))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"frequency": 0.0}, r"frequency \(Hz\) must be a number above 0"),
        ({"frequency": np.nan}, "frequency"),
        ({"frequency": "fast"}, "must be numbers"),
        ({"incident": (1.0, 1.0, 0.0)}, "incident must be unit vectors of propagation; one is 1.41421 long"),
        ({"scattered": (np.nan, 0.0, 1.0)}, "scattered must be unit vectors"),
        ({"incident": (1.0, 0.0)}, r"not of shape \(2,\)"),
        ({"sound_speed": 1.5}, "sound_speed"),
        ({"frequency": [1e3, 2e3], "incident": np.tile([1.0, 0.0, 0.0], (3, 1))}, "do not broadcast"),
        ({"target": "sphere"}, "target must be a Mesh, a shape"),
        ({"target": ss.MeshFile(path="nowhere.stl")}, r"nowhere\.stl: no such file"),
    ],
)
def test_bad_input_is_refused_in_one_line(change: dict[str, object], message: str) -> None:
    good = {"target": ss.Box(size=(1.0, 1.0, 1.0)), "frequency": 1e3, "incident": FLAT[0], "scattered": FLAT[1]}
    with pytest.raises(ValueError, match=message) as caught:
        ss.target_strength(**(good | change))
    assert "\n" not in str(caught.value)


def test_no_edge_of_a_curved_shape_is_longer_than_the_rows_of_a_grating() -> None:
    mesh = fine_mesh(ss.Sphere(radius=1.0), 0.06)
    corners = mesh.corners
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= 0.56 * 0.06
