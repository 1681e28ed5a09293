"""Fock's field on convex surfaces, and echoes by it, against exact series and what must hold whatever the body."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from scipy.special import ai_zeros, airy, hankel2, jv

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.scattering.convex_bodies import curvature_along, shape_operators, surface_field
from sonarsynth.equations.scattering.convex_kernels import convex_amplitude
from sonarsynth.equations.scattering.kirchhoff_integral import facet_amplitude
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.equations.scattering.modal_series import sphere_amplitude
from sonarsynth.geometry import unit
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere

C = 1500.0
Surface = Literal["rigid", "soft"]
SIGN = {"rigid": 1.0, "soft": -1.0}
Body = tuple[Floats, Floats, Floats]


def body(vertices: Floats, faces: Ints) -> Body:
    """Corners, normals and shape operators."""
    corners = vertices[faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners, unit(doubled), shape_operators(vertices, faces)


def ball(radius: float, edge: float) -> Body:
    mesh = mesh_of(Sphere(radius=radius, edge=edge))
    return body(mesh.vertices, mesh.faces.astype(np.int64))


def ellipsoid(axes: Floats, edge: float) -> Body:
    mesh = mesh_of(Sphere(radius=1.0, edge=edge))
    return body(mesh.vertices * axes, mesh.faces.astype(np.int64))


def tube(radius: float, length: float, around: int, along: int) -> Body:
    """The side of a cylinder about the x axis."""
    angle, at = 2 * np.pi * np.arange(around) / around, np.linspace(-length / 2, length / 2, along + 1)
    ring = np.stack([0 * angle, radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    vertices = (ring + at[:, None, None] * np.array([1.0, 0, 0])).reshape(-1, 3)
    start, i = np.arange(along)[:, None] * around, np.arange(around)
    p, q = (start + i).ravel(), (start + (i + 1) % around).ravel()
    faces = np.concatenate([np.stack([p, q, p + around], 1), np.stack([q, q + around, p + around], 1)])
    return body(vertices, faces)


def round_in_plane(degrees: Floats) -> tuple[Floats, Floats]:
    """A way in, and ways out at angles off backscatter."""
    into, across = np.array([0.48, 0.6, 0.64]), np.array([0.8, 0.0, -0.6])
    angle = np.radians(degrees)[:, None]
    return into, np.sin(angle) * across - np.cos(angle) * into


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_the_field_in_the_dark_is_the_sum_of_the_waves_that_creep(boundary: Surface) -> None:
    """Residues of Fock's integrals at the zeros of w2' or w2; at the edge itself, Logan's values."""
    xi = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 12.0])
    zeros, extremes = ai_zeros(60)[:2]
    pole = -(extremes if boundary == "rigid" else zeros) * np.exp(-1j * np.pi / 3)
    waves = np.exp(-1j * np.multiply.outer(xi, pole))
    if boundary == "rigid":
        exact = -0.5j * np.exp(1j * np.pi / 6) * np.sum(waves / (pole * airy(extremes)[0]), axis=1)
        assert surface_field(0.0, boundary) == pytest.approx(1.39937 / 2, abs=1e-5)
    else:
        exact = -0.5 * np.exp(5j * np.pi / 6) * np.sum(waves / airy(zeros)[1], axis=1)
        assert surface_field(0.0, boundary) == pytest.approx(0.77582 * np.exp(1j * np.pi / 3) / 2j, abs=1e-5)
    np.testing.assert_allclose(surface_field(xi, boundary), exact, atol=1e-6)


def test_the_field_far_in_the_light_is_that_on_a_plane() -> None:
    xi = -(10.0 ** np.arange(1.0, 7.0))
    assert (abs(surface_field(xi, "rigid") - 1.0) < 0.3 / abs(xi) ** 3).all()
    assert (abs(surface_field(xi, "soft") / -xi - 1.0) < 0.3 / abs(xi) ** 3).all()
    beside = np.array([-6.0 - 1e-9, -6.0 + 1e-9, -1e-9, 1e-9])
    for boundary in ("rigid", "soft"):
        steps = np.diff(surface_field(beside, boundary))[[0, 2]]
        assert abs(steps).max() < 2e-6


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_spheres_scatter_all_round_as_the_exact_series_says(boundary: Surface) -> None:
    radius, frequency, off = 0.25, np.linspace(25e3, 110e3, 10), np.arange(0.0, 181.0, 12.0)
    into, out = round_in_plane(off)
    parts, k = ball(radius, 0.0085), 2 * np.pi * frequency / C
    got = np.array([convex_amplitude(*parts, into, o, k, SIGN[boundary]) for o in out])
    exact = sphere_amplitude(frequency, np.pi - np.radians(off)[:, None], radius=radius, boundary=boundary)
    error = abs(20 * np.log10(abs(got / exact)))
    assert error[0].max() < 0.15
    assert error[off <= 120].max() < 0.3
    assert error.max() < (0.5 if boundary == "rigid" else 0.95)
    assert abs(np.angle(got / exact)).max() < 0.12


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
def test_small_spheres_are_not_far_off(boundary: Surface) -> None:
    """k a from 5 to 20: in a range where the lit and seen part alone is 2 to 20 dB off."""
    ka, off = np.linspace(5.0, 20.0, 12), np.arange(0.0, 181.0, 15.0)
    into, out = round_in_plane(off)
    parts = ball(1.0, 0.1)
    got = np.array([convex_amplitude(*parts, into, o, ka, SIGN[boundary]) for o in out])
    angle = np.pi - np.radians(off)[:, None]
    exact = sphere_amplitude(ka, angle, radius=1.0, sound_speed=2 * np.pi, boundary=boundary)
    mean = np.sqrt(np.mean(abs(exact) ** 2, axis=1))[:, None]
    assert (abs(abs(got) - abs(exact)) / mean).max() < 0.13


@pytest.mark.parametrize("boundary", ["rigid", "soft"])
@pytest.mark.parametrize(("aspect", "allowed"), [(90.0, 0.4), (60.0, 0.6)])
def test_cylinders_scatter_round_their_axis_as_the_exact_series_says(
    aspect: float, allowed: float, boundary: Surface
) -> None:
    """k a from 26 to 115, broadside and oblique, where the curvature along the wave is that of an ellipse."""
    radius, length = 0.25, 0.3
    k, off = 2 * np.pi * np.linspace(25e3, 110e3, 8) / C, np.arange(0.0, 121.0, 15.0)
    along, across = np.cos(np.radians(aspect)), np.sin(np.radians(aspect))
    angle, x, order = np.pi - np.radians(off), k * radius * across, np.arange(170)[:, None]
    j, h = jv(order - 1, x) - jv(order + 1, x), hankel2(order - 1, x) - hankel2(order + 1, x)
    if boundary == "soft":
        j, h = jv(order, x), hankel2(order, x)
    modes = np.where(order == 0, 1.0, 2.0) * np.nan_to_num(j / h)
    exact = -length / np.pi * np.cos(angle[:, None, None] * order) * modes
    parts = tube(radius, length, 320, 12)
    into = np.array([along, across, 0.0])
    out = np.stack([np.full_like(angle, along), across * np.cos(angle), across * np.sin(angle)], axis=1)
    got = np.array([convex_amplitude(*parts, into, o, k, SIGN[boundary]) for o in out])
    assert abs(20 * np.log10(abs(got / exact.sum(axis=1)))).max() < allowed


def test_curvatures_of_an_ellipsoid() -> None:
    axes = np.array([3.0, 2.0, 1.0])
    corners, normal, shape = ellipsoid(axes, 0.03)
    at = corners.mean(axis=1)
    assert np.allclose(np.einsum("fij,fj->fi", shape, normal), 0.0, atol=1e-9)
    for i, j in ((0, 1), (1, 2), (2, 0)):
        tip = at[:, i] > 0.999 * axes[i]
        assert np.count_nonzero(tip) > 2
        along = curvature_along(np.eye(3)[j], normal[tip], shape[tip])
        assert along == pytest.approx(axes[i] / axes[j] ** 2, rel=0.03)
    assert curvature_along(normal[0], normal[:1], shape[:1])[0] == 0.0


def test_an_ellipsoid_mirrors_as_its_curvature_says() -> None:
    """Half the geometric mean of the radii of curvature where it mirrors, at high frequency, up to 110 degrees."""
    axes = np.array([0.7, 0.5, 0.4])
    parts, k = ellipsoid(axes, 0.012), np.linspace(250.0, 350.0, 5)
    for seed in range(4):
        into, out = round_in_plane(np.random.default_rng(seed).uniform(0.0, 110.0, 1))
        turned = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
        a, b = turned @ into, turned @ out[0]
        half = unit(b - a)
        at = axes**2 * half / np.linalg.norm(axes * half)
        gauss = 1.0 / (np.prod(axes) * np.sum(at**2 / axes**4)) ** 2
        got = abs(convex_amplitude(*parts, a, b, k))
        assert abs(20 * np.log10(got * 2 * np.sqrt(gauss))).max() < 0.3


def test_source_and_receiver_may_change_places() -> None:
    parts, k = ellipsoid(np.array([0.3, 0.2, 0.1]), 0.1), np.array([20.0, 100.0, 300.0])
    ways = unit(np.random.default_rng(1).normal(size=(5, 2, 3)))
    for a, b in ways:
        for v in (1.0, -1.0, 0.3 - 0.2j):
            there, back = (convex_amplitude(*parts, *w, k, v, 0.002) for w in ((a, b), (-b, -a)))
            np.testing.assert_allclose(there, back, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("reflection", [1.0, -1.0, 0.0, 0.4 - 0.3j])
def test_straight_ahead_every_body_sends_the_wave_that_makes_its_shadow(reflection: complex) -> None:
    """-i k/2 pi times the area of the outline, whatever the surface."""
    axes, into = np.array([0.5, 0.3, 0.4]), np.array([0.0, 0.0, 1.0])
    k = np.array([400.0, 800.0])
    got = convex_amplitude(*ellipsoid(axes, 0.03), into, into, k, reflection)
    error = abs(got / (-0.5j * k * 0.5 * 0.3) - 1)  # falls as k^(-2/3)
    assert error[0] < 0.08
    assert error[1] < 0.05


def test_a_rigid_body_scatters_what_it_takes_from_the_wave() -> None:
    """Optical theorem: the power in all directions is -(4 pi/k) Im f straight ahead."""
    ka = np.array([16.0, 32.0])
    parts, into = ball(1.0, 0.12), np.array([0.0, 0.0, 1.0])
    cosine, weight = np.polynomial.legendre.leggauss(48)
    out = np.stack([np.sqrt(1 - cosine**2), 0 * cosine, cosine], axis=1)
    for sign in SIGN.values():
        power = np.array([abs(convex_amplitude(*parts, into, o, ka, sign)) ** 2 for o in out])
        taken = -4 * np.pi / ka * convex_amplitude(*parts, into, into, ka, sign).imag
        np.testing.assert_allclose(2 * np.pi * weight @ power, taken, rtol=0.04)


def test_flat_facets_are_those_of_kirchhoff_where_lit_and_seen() -> None:
    rng = np.random.default_rng(2)
    corners = rng.normal(size=(400, 3, 3)) * 0.01
    normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    a, b = unit(rng.normal(size=(2, 3)))
    on = lit_and_seen(a, b, normal) & (normal @ a < -0.05) & (normal @ b > 0.05)
    assert 40 < np.count_nonzero(on) < 300
    k, v = np.array([50.0, 400.0]), 0.5 - 0.3j
    flat = facet_amplitude(corners[on][:, None], a, b, k, v).sum(axis=0)
    got = convex_amplitude(corners[on], normal[on], np.zeros((np.count_nonzero(on), 3, 3)), a, b, k, v)
    np.testing.assert_allclose(got, flat, rtol=1e-9)


def test_waves_of_no_length_or_no_end_and_facets_of_no_area() -> None:
    into, out = round_in_plane(np.array([50.0]))
    parts = ball(1.0, 0.2)
    got = np.stack([convex_amplitude(*parts, into, out[0], [0.0, 1e-300, 1e-9, 1e9], v) for v in (1.0, -1.0)])
    assert np.isfinite(got).all()
    assert abs(got[:, :3]).max() < 1e-6
    empty = np.zeros((2, 3, 3))
    empty[1, :, 0] = [0.0, 1.0, 2.0]
    normal = np.tile([1.0, 0.0, 0.0], (2, 1))
    needles = shape_operators(empty.reshape(-1, 3), np.arange(6).reshape(2, 3))
    assert abs(needles).max() == 0.0
    assert abs(convex_amplitude(empty, normal, needles, into, out[0], [100.0])).max() == 0.0
