"""The Kirchhoff integral over facets against exact arithmetic, plates, closed bodies and exact series."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.kirchhoff_integral import (
    circular_plate,
    divided_exponential,
    local_grazing,
    rectangular_plate,
    shadow_taper,
)
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude, spacing
from sonarsynth.equations.scattering.lobes import lit_and_seen
from sonarsynth.equations.scattering.roughness import coherent_factor, roughness_parameter
from sonarsynth.equations.water.boundary_reflection import rayleigh
from sonarsynth.geometry import unit
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Box
from sonarsynth.validation.bodies.facet_integral import triangle_rows


def exact_difference(phases: Floats) -> complex:
    """exp[i a, i b, i c] in 120 digits, nodes that are equal moved apart by 1e-40."""
    with mp.workdps(120):
        z = [mp.mpc(0, mp.mpf(float(p)) + mp.mpf(10) ** -40 * i) for i, p in enumerate(phases)]
        return complex(sum(mp.exp(z[i]) / ((z[i] - z[i - 1]) * (z[i] - z[i - 2])) for i in range(3)))


@pytest.mark.parametrize("size", 10.0 ** np.arange(-12, 5))
def test_the_divided_difference_agrees_with_exact_arithmetic(size: float) -> None:
    rng = np.random.default_rng(int(50 + np.log10(size)))
    phases = rng.normal(size=(20, 3)) * size
    phases[::4, 1] = phases[::4, 0]
    phases[1::4, 2] = phases[1::4, 0] * (1 + 1e-9)
    phases[2::4] = phases[2::4, :1]
    exact = np.array([exact_difference(p) for p in phases])
    assert abs(divided_exponential(phases) - exact).max() < 3e-16


@pytest.mark.parametrize("gap", [1.999999, 2.0, 2.000001])
def test_series_and_differences_meet(gap: float) -> None:
    for middle in (0.0, 0.3 * gap, gap):
        phases = np.array([0.0, middle, gap])
        assert abs(divided_exponential(phases) - exact_difference(phases)) < 2e-16


def test_triangles_are_those_of_many_digits() -> None:
    assert [row for row in triangle_rows(True) if not row.ok] == []


def test_a_closed_body_gives_the_transform_of_its_volume() -> None:
    """Divergence theorem: the sum over all facets of (n.w) int exp(-i w.x) dS is -i |w|^2 int exp(-i w.x) dV."""
    sides, k = np.array([0.4, 0.7, 0.2]), np.array([0.01, 3.0, 60.0, 400.0])
    mesh = mesh_of(Box(size=tuple(sides)))
    for a, b in unit(np.random.default_rng(5).normal(size=(20, 2, 3))):
        w = k[:, None] * (a - b)
        volume = np.prod(sides * np.sinc(w * sides / (2 * np.pi)), axis=-1)
        exact = -0.25j / np.pi * (1j * np.sum(w * w, axis=-1)) * volume
        assert (abs(mesh_amplitude(mesh.corners, a, b, k) + exact) < 1e-12 * k).all()


DOWN, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
CORNERS = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]]) * [0.6, 0.25, 1.0]
PLATE = CORNERS[[[0, 1, 2], [0, 2, 3]]]


def test_two_triangles_are_a_rectangle_and_many_a_disc() -> None:
    rng = np.random.default_rng(6)
    k, sides = 10.0 ** rng.uniform(-2, 3, 40), 2000
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    radius = 0.3 * np.sqrt(2 * np.pi / sides / np.sin(2 * np.pi / sides))  # of the same area
    rim = radius * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    fan = np.stack([0 * rim[1:], rim[:-1], rim[1:]], axis=1)
    for a, b in unit(rng.normal(size=(40, 2, 3))):
        two = mesh_amplitude(PLATE, a, b, k, 0.3 - 0.4j)
        np.testing.assert_allclose(two, rectangular_plate((0.6, 0.25), a, b, k, 0.3 - 0.4j), atol=1e-14 * k.max())
        many = mesh_amplitude(fan, a, b, 100.0)
        np.testing.assert_allclose(many, circular_plate(0.3, a, b, 100.0), atol=1e-5 * 0.09 * 50)


def test_source_and_receiver_may_change_places() -> None:
    rng = np.random.default_rng(7)
    a, b = unit(rng.normal(size=(2, 200, 3)))
    corners, k = rng.normal(size=(200, 3, 3)), 10.0 ** rng.uniform(-3, 3, 200)

    def facets(i: Floats, s: Floats) -> np.ndarray:
        local = rayleigh(local_grazing(i, s), 1.8, 1.1, 0.02)
        rows = zip(corners, i, s, k, local, strict=True)
        return np.array([mesh_amplitude(corner[None], *ways, factor)[0] for corner, *ways, factor in rows])

    np.testing.assert_allclose(facets(a, b), facets(-b, -a), rtol=1e-11, atol=1e-15)
    normal = unit(rng.normal(size=(200, 3)))
    np.testing.assert_allclose(shadow_taper(a, b, normal), shadow_taper(-b, -a, normal), rtol=1e-13)
    mirror = a - 2 * np.sum(a * normal, axis=1)[:, None] * normal
    lit = np.sum(a * normal, axis=1) < 0
    np.testing.assert_allclose(shadow_taper(a, mirror, normal), lit, atol=1e-13)
    np.testing.assert_array_equal(shadow_taper(a, b, normal) > 0, lit_and_seen(a, b, normal))


def test_the_mirror_angle_of_a_facet_is_that_of_the_half_vector() -> None:
    grazing = np.array([0.0, 1e-9, 0.3, np.pi / 2])
    a, b = (np.stack([np.cos(grazing), 0 * grazing, s * np.sin(grazing)], axis=-1) for s in (-1, 1))
    np.testing.assert_allclose(local_grazing(a, b), grazing, rtol=1e-14)


def test_a_mesh_is_the_sum_of_its_facets_by_weight_and_roughness() -> None:
    rng = np.random.default_rng(8)
    corners = rng.normal(size=(300, 1, 3)) + rng.normal(size=(300, 3, 3)) * 10.0 ** rng.uniform(-6, 0, (300, 1, 1))
    a, b = unit(rng.normal(size=(2, 300, 3)))
    k = np.array([0.0, 1e-9, 1.0, 360.0, 4e3])
    weight, height = rng.normal(size=300) * np.exp(1j * rng.normal(size=300)), rng.uniform(0, 0.01, 300)
    weight[::5] = 0.0
    normal = unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    left = coherent_factor(roughness_parameter(k, height[:, None], a[:, None], b[:, None], normal[:, None]))
    each = np.array([mesh_amplitude(c[None], i, s, k) for c, i, s in zip(corners, a, b, strict=True)])
    slow = weight[:, None] * left * each
    got = mesh_amplitude(corners, a, b, k, weight, height)
    np.testing.assert_allclose(got, slow.sum(axis=0), atol=1e-11 * abs(slow).max())
    assert got[0] == 0.0
    with pytest.raises(ValueError, match="facet, 3, xyz"):
        mesh_amplitude(corners[0], a, b, k)


@pytest.mark.parametrize("count", [1, 3, 4, 5, 40])
@pytest.mark.parametrize("first", [0.0, 1.0, 100.0])
@pytest.mark.parametrize("power", [1.0, 1.02])
def test_rows_are_as_exact_as_single_frequencies(count: int, first: float, power: float) -> None:
    """Phases across a facet from 1e-6 to 60 rad: by the series that a row shares, beyond it, and across its end."""
    rng = np.random.default_rng(count)
    k = np.linspace(first, 460.0, count) ** power
    assert np.isfinite(spacing(k)) == (count > 2 and power == 1.0)
    corners = rng.normal(size=(200, 1, 3)) * 0.5 + rng.normal(size=(200, 3, 3)) * 10.0 ** rng.uniform(
        -8, -1.5, (200, 1, 1)
    )
    a, b = unit(rng.normal(size=(2, 3)))
    slow = np.array([[mesh_amplitude(facet[None], a, b, one)[0] for one in k] for facet in corners])
    size = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    each = np.array([mesh_amplitude(facet[None], a, b, k) for facet in corners])
    assert (abs(each - slow) <= 1e-12 * (size[:, None] * k + 1e-300)).all()


def test_wavenumbers_of_equally_spaced_frequencies_are_seen_as_such() -> None:
    for band in (np.arange(25e3, 110.1e3, 5e3), np.linspace(25e3, 110e3, 18), np.fft.rfftfreq(4096, 1 / 400e3)):
        k = 2 * np.pi * band / 1497.3
        assert spacing(k) == pytest.approx(k[1] - k[0], rel=1e-12)
    assert np.isnan(spacing(np.array([1.0, 2.0, 3.0 + 1e-9])))
