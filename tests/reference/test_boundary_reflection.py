"""Reflection from the bottom and the surface: published values, limits, and energy."""

import numpy as np
import pytest

from sonarsynth.equations.water.boundary_reflection import (
    bubble_loss,
    rayleigh,
    wind_wave_height,
)
from sonarsynth.equations.water.formula_ranges import OutOfRange

GRAZING = np.radians([5, 10, 20, 30, 45, 60, 90])


def test_normal_incidence_is_the_contrast_of_impedances():
    m, ratio = 1.7, 1.2
    assert rayleigh(np.pi / 2, m, ratio) == pytest.approx((m * ratio - 1) / (m * ratio + 1), rel=1e-14)


def test_energy_is_conserved_above_the_critical_angle():
    q = np.linspace(np.arccos(1 / 1.2) + 1e-3, np.pi / 2, 300)
    m, n = 1.8, 1 / 1.2
    v = rayleigh(q, m, 1.2).real
    sine_below = np.sqrt(1 - (np.cos(q) / n) ** 2)
    transmitted = (1 + v) ** 2 * n * sine_below / (m * np.sin(q))
    np.testing.assert_allclose(v**2 + transmitted, 1.0, rtol=0, atol=1e-12)


def test_a_boundary_of_density_alone_reflects_the_same_at_every_angle():
    q = np.array([0.0, 1e-12, 1e-3, 0.7, np.pi / 2])
    np.testing.assert_allclose(rayleigh(q, 1.5, 1.0), 0.2, rtol=1e-12)
    np.testing.assert_array_equal(rayleigh(q, 1.0, 1.0), 0.0)


@pytest.mark.parametrize("loss", [0.0, 1e-12, 0.01624, 0.5])
@pytest.mark.parametrize("speed", [0.98, 1.1782])
def test_the_wave_in_the_bed_goes_down_and_dies_away(speed, loss):
    """exp(+i w t - i k w z) at a depth z in the bottom, with w = m sin q (1 - V)/(1 + V): Im w <= 0 and Re w >= 0."""
    q = np.linspace(0.01, np.pi / 2, 200)
    v = rayleigh(q, 1.845, speed, loss)
    w = 1.845 * np.sin(q) * (1 - v) / (1 + v)
    assert w.imag.max() <= 1e-12
    assert w.real.min() >= -1e-12
    assert np.abs(w).min() > 0.01
    np.testing.assert_allclose(w**2, ((1 - 1j * loss) / speed) ** 2 - np.cos(q) ** 2, atol=1e-12)


def test_the_reflection_is_continuous_in_the_loss():
    np.testing.assert_allclose(
        rayleigh(GRAZING, 1.845, 1.1782, 1e-14), rayleigh(GRAZING, 1.845, 1.1782, 0.0), atol=1e-12
    )


@pytest.mark.parametrize("wind", [0.5, 5.0, 25.0])
def test_waves_warn_outside_the_winds_that_were_measured(wind):
    with pytest.warns(OutOfRange, match=f"wind speed {wind:g} m/s is outside 10 to 21 m/s"):
        assert wind_wave_height(wind) == pytest.approx(0.00533 * wind**2, rel=1e-3)
    assert wind_wave_height([0.0, 10.0, 21.0])[0] == 0.0


@pytest.mark.parametrize("frequency", [1e3, 200e3])
def test_bubbles_warn_outside_the_frequencies_of_the_handbook(frequency):
    with pytest.warns(OutOfRange, match="kHz is outside 10 to 100 kHz"):
        bubble_loss(8.0, frequency, 0.3)
