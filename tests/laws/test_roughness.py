"""Rough facets: where the power goes, reciprocity, splitting, and the limits that they join."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_integral import rectangular_plate
from sonarsynth.equations.scattering.lobes import lambert, slope_lobe
from sonarsynth.equations.scattering.roughness import coherent_factor, incoherent_power, roughness_parameter
from sonarsynth.geometry import unit

UP = np.array([0.0, 0.0, 1.0])


def hemisphere(points: int) -> tuple[Floats, Floats]:
    """Directions over the upper half space and their solid angles (Gauss in the cosine, even in azimuth)."""
    node, weight = np.polynomial.legendre.leggauss(points)
    z, azimuth = 0.5 * (node + 1), (np.arange(2 * points) + 0.5) * np.pi / points
    s = np.sqrt(1 - z * z)
    d = np.stack(np.broadcast_arrays(s[:, None] * np.cos(azimuth), s[:, None] * np.sin(azimuth), z[:, None]), axis=-1)
    return d.reshape(-1, 3), np.repeat(0.5 * weight * np.pi / points, 2 * points)


def incoming(angle: float) -> Floats:
    return np.array([np.sin(angle), 0.0, -np.cos(angle)])


@pytest.mark.parametrize("angle", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("kh", [0.0, 0.1, 0.5, 1.0, 20.0])
def test_coherent_and_scattered_power_add_up_to_what_arrives(kh: float, angle: float) -> None:
    """The coherent part mirrors exp(-g^2) of the power; the lobe is narrow, so that g hardly changes over it."""
    out, solid = hemisphere(400)
    a = incoming(angle)
    g = roughness_parameter(kh, 1.0, a, out, UP)
    scattered = np.sum(incoherent_power(g, a, out, UP, 0.05) * solid) / np.cos(angle)
    mirrored = coherent_factor(roughness_parameter(kh, 1.0, a, a * [1, 1, -1], UP)) ** 2
    assert scattered + mirrored == pytest.approx(1.0, abs=0.012)


@pytest.mark.parametrize("kh", [0.0, 0.5, 20.0])
def test_reflection_and_albedo_share_the_power(kh: float) -> None:
    out, solid = hemisphere(300)
    a, v = incoming(0.6), 0.8 * np.exp(0.7j)
    g = roughness_parameter(kh, 1.0, a, out, UP)
    scattered = np.sum(incoherent_power(g, a, out, UP, 0.1, v, 1 - abs(v) ** 2) * solid) / np.cos(0.6)
    mirrored = abs(v * coherent_factor(roughness_parameter(kh, 1.0, a, a * [1, 1, -1], UP))) ** 2
    assert scattered + mirrored == pytest.approx(1.0, abs=0.02)


def test_a_large_plate_mirrors_its_coherent_share() -> None:
    """int |f|^2 dOmega of a plate of many wavelengths is its area (times the cosine) times exp(-g^2)."""
    k, side = 400.0, 1.0
    tangent = np.linspace(-0.5, 0.5, 1401)  # of directions around the mirror direction, where k side t >> 1 at the ends
    x, y = np.meshgrid(tangent, tangent)
    z = np.sqrt(1 - x * x - y * y)
    out = np.stack([x, y, z], axis=-1)
    f = rectangular_plate((side, side), -UP, out, k) * coherent_factor(roughness_parameter(k, 1e-3, -UP, out, UP))
    power = np.sum(abs(f) ** 2 / z) * (tangent[1] - tangent[0]) ** 2
    assert power == pytest.approx(np.exp(-(0.8**2)), rel=0.02)


def test_source_and_receiver_may_change_places() -> None:
    a, b, n = unit(np.random.default_rng(0).normal(size=(3, 1000, 3)))
    there, back = roughness_parameter(300.0, 1e-3, a, b, n), roughness_parameter(300.0, 1e-3, -b, -a, n)
    np.testing.assert_allclose(there, back, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(
        incoherent_power(there, a, b, n, 0.3, 0.7j, 0.4), incoherent_power(back, -b, -a, n, 0.3, 0.7j, 0.4), rtol=1e-9
    )


def test_smooth_is_coherent_and_rough_is_the_lobe() -> None:
    out, _ = hemisphere(20)
    a = incoming(0.4)
    smooth, rough = (roughness_parameter(1.0, h, a, out, UP) for h in (0.0, 100.0))
    assert (coherent_factor(smooth) == 1).all()
    assert (incoherent_power(smooth, a, out, UP, 0.2) == 0).all()
    assert coherent_factor(rough).max() < 1e-100
    np.testing.assert_array_equal(incoherent_power(rough, a, out, UP, 0.2, 1.0), slope_lobe(a, out, UP, 0.2))
    np.testing.assert_array_equal(incoherent_power(rough, a, out, UP, 0.2, 0.0, 0.5), lambert(a, out, UP, 0.5))


def test_the_mirror_of_a_rough_facet_is_that_of_a_rough_boundary() -> None:
    grazing = np.array([0.1, 0.7, 1.5])
    a = np.stack([np.cos(grazing), 0 * grazing, -np.sin(grazing)], axis=-1)
    g = roughness_parameter(250.0, 2e-3, a, a * [1, 1, -1], UP)
    np.testing.assert_allclose(coherent_factor(g), np.exp(-0.5 * (2 * 250.0 * 2e-3 * np.sin(grazing)) ** 2), rtol=1e-13)
