"""Facets and waves at the ends of what there is: needles, points, no wave, 1e9 wavelengths, far from the origin."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.equations.scattering.kirchhoff_integral import (
    circular_plate,
    divided_exponential,
    lit_sphere,
    local_grazing,
    rectangular_plate,
    shadow_taper,
)
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.equations.scattering.modal_series import (
    Fluid,
    cylinder_amplitude,
    sphere_amplitude,
    sphere_coefficients,
)
from sonarsynth.geometry import unit

DOWN, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 0.0, 1.0])
NEEDLE = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.5, 1e-12, 0]])
POINT, LINE = np.ones((3, 3)), np.array([[0.0, 0, 0], [1.0, 1, 1], [2.0, 2, 2]])


@pytest.mark.parametrize("k", [0.0, 1e-12, 1.0, 1e3, 1e9])
def test_what_has_no_area_scatters_nothing(k: float) -> None:
    for a, b in unit(np.random.default_rng(0).normal(size=(50, 2, 3))):
        assert abs(mesh_amplitude(np.stack([POINT, LINE]), a, b, k)).max() == 0.0
        assert abs(mesh_amplitude(NEEDLE[None], a, b, k)).max() <= 1e-12 * k


def test_no_wave_and_no_change_of_direction_give_no_echo() -> None:
    corners = np.random.default_rng(1).normal(size=(20, 3, 3))
    assert abs(mesh_amplitude(corners, UP, UP, 300.0)).max() == 0.0
    assert abs(mesh_amplitude(corners, UP, DOWN, np.zeros(1))).max() == 0.0


@pytest.mark.parametrize("distance", [20.0, 1e4])
def test_a_facet_far_from_the_origin_has_the_same_echo_later(distance: float) -> None:
    rng = np.random.default_rng(3)
    corners, k = rng.integers(-64, 64, (30, 3, 3)) / 1024.0, 450.0  # exact when moved
    away = np.array([distance, -distance, 0.5 * distance])
    for facet, (a, b) in zip(corners, unit(rng.normal(size=(30, 2, 3))), strict=True):
        near, far = (complex(mesh_amplitude(x[None], a, b, k)[0]) for x in (facet, facet + away))
        assert abs(far) == pytest.approx(abs(near), rel=1e-9, abs=1e-16)
        assert abs(far - near * np.exp(-1j * k * (a - b) @ away)) < 1e-14 * k * distance * 0.01


def test_numbers_that_are_none_stay_none() -> None:
    assert np.isnan(divided_exponential([0.0, np.nan, 1.0]))
    assert np.isnan(mesh_amplitude(NEEDLE[None], DOWN, UP, np.nan)).all()
    assert np.isnan(mesh_amplitude(NEEDLE[None] + np.nan, DOWN, UP, 1.0)).all()


def test_single_numbers_do_as_well_as_arrays() -> None:
    assert divided_exponential(np.zeros(3)) == 0.5
    assert divided_exponential(np.array([0.0, 1.0, 9.0])).shape == ()
    assert rectangular_plate((1.0, 1.0), DOWN, UP, 5.0).shape == circular_plate(1.0, DOWN, UP, 5.0).shape == ()


def test_spheres_of_no_wave_and_of_very_many() -> None:
    assert lit_sphere(0.3, 0.0) == 0.0
    assert lit_sphere(0.3, 1e-9) == pytest.approx(0.5j * 0.09e-9, rel=1e-8)
    assert abs(lit_sphere(0.3, 1e9)) == pytest.approx(0.15, rel=1e-6)
    k = 10.0 ** np.arange(-300.0, 3.0, 10.0)
    for boundary in ("rigid", "soft", Fluid(1e-3, 0.2), Fluid(1e6, 1e3)):
        a = sphere_coefficients(k, boundary)  # type: ignore[arg-type]
        assert np.isfinite(a).all()
        assert (abs(a) <= 1 + 1e-12).all()
        f = sphere_amplitude(k, np.pi, radius=1.0, sound_speed=2 * np.pi, boundary=boundary)  # type: ignore[arg-type]
        assert np.isfinite(f).all()
    assert np.isfinite(cylinder_amplitude(k, 0.3, radius=1.0, length=1.0, sound_speed=2 * np.pi)).all()


def test_directions_that_graze_or_oppose() -> None:
    along = np.array([1.0, 0.0, 0.0])
    assert shadow_taper(along, along, UP) == 0.0
    assert shadow_taper(DOWN, DOWN, UP) == 0.0
    assert shadow_taper(DOWN, UP, UP) == 1.0
    tilted = unit(np.array([1.0, 0.0, -1e-12]))
    assert shadow_taper(tilted, tilted * [1, 1, -1], UP) == pytest.approx(1.0)
    assert local_grazing(UP, UP) == 0.0
    assert local_grazing(UP, DOWN) == pytest.approx(np.pi / 2)
