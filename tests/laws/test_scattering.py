"""Laws of the scattering laws and of rough facets: energy, reciprocity, splitting, the mirror direction, the limits."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_integral import rectangular_plate
from sonarsynth.equations.scattering.lobes import lambert, slope_lobe
from sonarsynth.equations.scattering.roughness import coherent_factor, incoherent_power, roughness_parameter
from sonarsynth.geometry import unit
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.scattering import Isotropic, MirrorLobe, Scattering
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Sphere

UP = np.array([0.0, 0.0, 1.0])


def hemisphere(points: int = 500) -> tuple[Floats, Floats]:
    """Directions over the upper half space and their solid angles (Gauss in the cosine, even in azimuth)."""
    node, weight = np.polynomial.legendre.leggauss(points)
    z, w = 0.5 * (node + 1), 0.5 * weight
    azimuth = (np.arange(2 * points) + 0.5) * np.pi / points
    s = np.sqrt(1 - z * z)
    d = np.stack(np.broadcast_arrays(s[:, None] * np.cos(azimuth), s[:, None] * np.sin(azimuth), z[:, None]), axis=-1)
    return d.reshape(-1, 3), np.repeat(w * np.pi / points, 2 * points)


def incoming(angle: float) -> Floats:
    return np.array([np.sin(angle), 0.0, -np.cos(angle)])


@pytest.mark.parametrize(("slope", "low", "high"), [(0.05, 0.9995, 1.0005), (0.1, 0.9985, 1.0005), (0.2, 0.96, 1.005)])
@pytest.mark.parametrize("angle", [0.0, 0.4, 0.9])
def test_the_lobe_gives_back_the_power_that_arrives(slope: float, low: float, high: float, angle: float) -> None:
    out, solid = hemisphere()
    power = np.sum(slope_lobe(incoming(angle), out, UP, slope) * solid) / np.cos(angle)
    assert low < power < high


@pytest.mark.parametrize("angle", [0.0, 0.7, 1.4])
def test_the_diffuse_floor_gives_back_its_albedo(angle: float) -> None:
    out, solid = hemisphere(60)
    assert np.sum(lambert(incoming(angle), out, UP, 0.3) * solid) / np.cos(angle) == pytest.approx(0.3, rel=1e-12)


LAWS = [MirrorLobe(), MirrorLobe(width=0.05), MirrorLobe(reflectivity=0.6, diffuse=0.3), Isotropic(strength=0.2)]


@pytest.mark.parametrize("law", LAWS)
def test_source_and_receiver_may_change_places(law: MirrorLobe | Isotropic) -> None:
    rng = np.random.default_rng(0)
    a, b, n = unit(rng.normal(size=(3, 2000, 3)))
    there, back = law.amplitude(a, b, n, np.ones(2000)), law.amplitude(-b, -a, n, np.ones(2000))
    np.testing.assert_allclose(there, back, rtol=1e-9)
    assert (there > 0).sum() > 100


@pytest.mark.parametrize("law", LAWS)
def test_nothing_comes_from_a_facet_that_is_dark_or_turned_away(law: MirrorLobe | Isotropic) -> None:
    rng = np.random.default_rng(1)
    a, b, n = unit(rng.normal(size=(3, 2000, 3)))
    f = law.amplitude(a, b, n, np.ones(2000))
    dark = (np.sum(a * n, axis=1) >= 0) | (np.sum(b * n, axis=1) <= 0)
    assert (f[dark] == 0).all()
    assert (f[~dark] >= 0).all()
    assert np.isfinite(f).all()


def test_powers_of_the_parts_of_a_facet_add_up_to_that_of_the_whole() -> None:
    law, rng = MirrorLobe(reflectivity=0.8, diffuse=0.2), np.random.default_rng(2)
    parts = rng.dirichlet(np.ones(7)) * 0.3
    a, b = incoming(0.3), unit(np.array([0.2, 0.1, 1.0]))
    whole = law.amplitude(a, b, UP, np.array(0.3)) ** 2
    assert np.sum(law.amplitude(a, b, UP, parts) ** 2) == pytest.approx(float(whole), rel=1e-14)


@pytest.mark.parametrize("width", [1e-6, 0.01, 0.1, 0.35])
def test_the_lobe_stands_on_the_mirror_direction_and_has_its_width(width: float) -> None:
    law = MirrorLobe(width=width)
    delta = np.array([0.0, 0.5, 1.0, 1.5]) * width
    mirror = np.array([0.0, 0.0, 1.0])
    out = np.stack([np.sin(delta), np.zeros(4), np.cos(delta)], axis=-1)
    f = law.amplitude(-mirror, out, UP, np.ones(4))
    assert (np.diff(f) < 0).all()
    beta = delta / 2  # the half vector tilts by half the angle
    exact = np.exp(-(np.tan(beta) ** 2) / (0.5 * width**2)) / np.cos(beta) ** 2
    np.testing.assert_allclose(f / f[0], exact, rtol=1e-12)
    np.testing.assert_allclose(f / f[0], np.exp(-(delta**2) / (2 * width**2)), rtol=3 * width**2 + 1e-12)
    assert f[0] == pytest.approx(1 / np.sqrt(np.pi) / width, rel=1e-12)  # sqrt(1/(8 pi s^2)), s = width/sqrt 8


def test_reflectivity_scales_the_lobe() -> None:
    a, b, area = incoming(0.2), unit(np.array([0.25, 0.0, 1.0])), np.array(2.0)
    full, part = (MirrorLobe(reflectivity=r).amplitude(a, b, UP, area) for r in (1.0, 0.25))
    assert part == pytest.approx(0.25 * full, rel=1e-14)


def test_more_power_out_than_in_is_refused() -> None:
    with pytest.raises(ValueError, match="scatters more power than arrives"):
        MirrorLobe(reflectivity=0.9, diffuse=0.2)


def test_the_registry_tells_laws_apart_by_kind() -> None:
    adapter = TypeAdapter(Scattering)
    assert adapter.validate_python({"kind": "mirror_lobe", "width": "5 deg"}) == MirrorLobe(width=np.deg2rad(5.0))
    assert adapter.validate_python({"kind": "isotropic", "strength": 0.1}) == Isotropic(strength=0.1)


def test_signs_of_facets_are_fixed_and_random() -> None:
    """As many of one as of the other, the same for the same mesh, others for another; alike where asked."""
    ball = mesh_of(Sphere(radius=1.0, edge=0.05))
    signs = MirrorLobe().polarity(ball)
    assert set(signs) == {-1.0, 1.0} and abs(signs.sum()) < 4 * np.sqrt(len(signs))
    assert (signs == MirrorLobe(width=0.2).polarity(Mesh(ball.vertices, ball.faces))).all()
    assert (signs != MirrorLobe().polarity(Mesh(2 * ball.vertices, ball.faces))).any()
    assert (MirrorLobe(phases="alike").polarity(ball) == 1).all()


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


def test_source_and_receiver_of_a_rough_facet_may_change_places() -> None:
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
