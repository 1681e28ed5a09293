"""The rule for how fine a mesh must be, against the exact Kirchhoff integral over a sphere."""

import numpy as np
import pytest

from sonarsynth.acoustics.facets import kirchhoff_edge, kirchhoff_error
from sonarsynth.world.generation import sphere
from sonarsynth.world.meshes import mesh_of
from sonarsynth.world.shapes import Cylinder


def triangle_integral(corners: np.ndarray, w: np.ndarray) -> np.ndarray:
    """int exp(i w.x) dS over triangles, by a 36-point rule: exact enough for facets under half a wavelength."""
    x, weight = np.polynomial.legendre.leggauss(6)
    u, v = np.meshgrid(0.5 * (x + 1), 0.5 * (x + 1), indexing="ij")
    jacobian = np.outer(weight, weight) * 0.25 * u
    a, b, c = np.moveaxis(corners, 1, 0)
    points = a[:, None] + (b - a)[:, None] * u.ravel()[:, None] + (c - b)[:, None] * (u * v).ravel()[:, None]
    double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return double_area * (np.exp(1j * points @ w) @ jacobian.ravel())


@pytest.mark.parametrize("frequency", [25e3, 85e3])
@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
def test_the_error_of_a_sphere_of_flat_facets_is_as_predicted(frequency, share):
    """Back-scatter of the lit half sphere: int n.k exp(2 i k x) dS = 2 pi a^2 int_0^1 u exp(2 i k a u) du exactly."""
    radius, wavelength = 0.25, 1500.0 / frequency
    k = 2 * np.pi / wavelength
    z = 2j * k * radius
    exact = 2 * np.pi * radius**2 * (np.exp(z) * (z - 1) + 1) / z**2
    edge = share * np.sqrt(wavelength * radius)
    vertices, faces = sphere(radius, 1.15 * edge)
    corners = vertices[faces]
    mean_edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    lit = corners.mean(axis=1)[:, 0] > 0
    got = np.sum(normal[lit, 0] * triangle_integral(corners[lit], np.array([2 * k, 0, 0])))
    error = abs(got / exact - 1)
    assert 0.4 < error / kirchhoff_error(mean_edge, wavelength, radius) < 2.0


def test_edge_and_error_are_each_other_s_inverse():
    wavelength, radius = np.array([0.06, 0.018, 0.0136])[:, None], np.array([1e-3, 0.095, 5.0, 1e6])
    for error in (0.01, 0.05, 0.2):
        edge = kirchhoff_edge(wavelength, radius, error)
        np.testing.assert_allclose(kirchhoff_error(edge, wavelength, radius), error, rtol=1e-12)


def test_the_rule_of_thumb():
    assert kirchhoff_edge(1.0, 1.0) == pytest.approx(0.18, abs=2e-3)
    assert kirchhoff_edge(1500 / 85e3, 0.0955) == pytest.approx(7.3e-3, abs=1e-4)


def test_a_flat_surface_needs_no_facets_and_has_no_error():
    assert kirchhoff_edge(0.02, np.inf) == np.inf
    assert kirchhoff_error(3.0, 0.02, np.inf) == 0.0


@pytest.mark.parametrize("tilt", [0.0, 10.0])
@pytest.mark.parametrize("share", [0.1, 0.18])
def test_the_staggered_mesh_of_a_cylinder_scatters_like_the_cylinder(share, tilt):
    """Back-scatter near broadside: L sinc(k L sin t) a cos t int cos p exp(2 i k a cos t cos p) dp, |p| < pi/2."""
    radius, length, wavelength = 0.0955, 0.4, 1500.0 / 85e3
    k, t = 2 * np.pi / wavelength, np.radians(tilt)
    p, weight = np.polynomial.legendre.leggauss(200)
    p, weight = 0.5 * np.pi * p, 0.5 * np.pi * weight
    girth = weight @ (np.cos(p) * np.exp(2j * k * radius * np.cos(t) * np.cos(p)))
    exact = length * np.sinc(2 * length * np.sin(t) / wavelength) * radius * np.cos(t) * girth
    mesh = mesh_of(Cylinder(radius=radius, length=length, edge=share * np.sqrt(wavelength * radius)))
    lit = (mesh.centroid[:, 1] > 0) & (np.abs(mesh.normal[:, 0]) < 0.9)
    towards = np.array([np.sin(t), np.cos(t), 0.0])
    got = np.sum((mesh.normal[lit] @ towards) * triangle_integral(mesh.corners[lit], 2 * k * towards))
    mean_edge = np.linalg.norm(mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2).mean()
    assert 0.3 < abs(got / exact - 1) / kirchhoff_error(mean_edge, wavelength, radius) < 1.0
