"""Laws of reflection from described boundaries: energy, limits, signs, roughness, tables."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.environment.boundaries import (
    NORMAL,
    FluidHalfSpace,
    PressureRelease,
    Reflection,
    ReflectionTable,
    Rigid,
    SeaBottom,
    SeaSurface,
    Sediment,
)
from sonarsynth.environment.boundary_numbers import bounces, coefficient, delay_std, rms_height
from sonarsynth.equations.water.boundary_reflection import (
    bubble_loss,
    rayleigh,
    roughness_blur,
    wind_wave_height,
)
from sonarsynth.equations.water.formula_ranges import OutOfRange

GRAZING = np.linspace(0.0, NORMAL, 181)
TABLE = ReflectionTable(grazing=(0.0, 0.3, 0.5, NORMAL), modulus=(1.0, 0.9, 0.4, 0.35), phase=(np.pi, 1.0, 0.2, 0.1))
EVERY: list[Reflection] = [
    PressureRelease(),
    Rigid(),
    FluidHalfSpace(density_ratio=1.9, speed_ratio=1.2, loss_tangent=0.02),
    FluidHalfSpace(density_ratio=1.2, speed_ratio=0.97),
    FluidHalfSpace(density_ratio=1.2e-3, speed_ratio=0.22),
    Sediment(name="clay"),
    Sediment(name="fine sand"),
    TABLE,
]


@pytest.mark.parametrize("reflection", EVERY)
def test_no_boundary_gives_energy(reflection: Reflection) -> None:
    for boundary in (SeaSurface(reflection=reflection), SeaBottom(reflection=reflection, rms_height=0.1)):
        assert np.abs(coefficient(boundary, GRAZING)).max() <= 1 + 1e-14


def test_a_lossless_bed_keeps_the_energy_of_every_wave() -> None:
    """What comes back and what goes on add up: |V|^2 + |1 + V|^2 Re(w)/(m sin q) = 1, w from V itself."""
    bottom = SeaBottom(reflection=FluidHalfSpace(density_ratio=1.7, speed_ratio=1.15))
    q = GRAZING[1:]
    v = coefficient(bottom, q)
    w = np.sqrt((1 / 1.15**2 - np.cos(q) ** 2).astype(complex))
    sent_on = np.abs(1 + v) ** 2 * w.real / (1.7 * np.sin(q))
    np.testing.assert_allclose(np.abs(v) ** 2 + sent_on, 1.0, rtol=0, atol=1e-12)


def test_a_lossy_bed_takes_energy_and_keeps_the_sign_of_the_phase() -> None:
    """In exp(+i 2 pi f t) the phase below the critical angle lies in (0, pi), and loss takes from the modulus."""
    q = np.linspace(0.05, 0.4, 50)
    lossless = coefficient(SeaBottom(reflection=FluidHalfSpace(density_ratio=1.8, speed_ratio=1.18)), q)
    lossy = coefficient(SeaBottom(reflection=FluidHalfSpace(density_ratio=1.8, speed_ratio=1.18, loss_tangent=0.02)), q)
    assert lossless.imag.min() > 0.0
    assert lossy.imag.min() > 0.0
    assert np.all(np.abs(lossy) < np.abs(lossless))
    assert np.all(np.diff(np.angle(lossless)) < 0.0)


def test_a_pulse_reflected_below_the_critical_angle_spreads_by_the_phase_alone() -> None:
    """The reflected spectrum is V for f > 0 and its conjugate for f < 0: a real pulse of the same energy."""
    v = coefficient(SeaBottom(reflection=FluidHalfSpace(density_ratio=1.8, speed_ratio=1.18)), [0.2])[0]
    pulse = np.exp(-0.5 * ((np.arange(256) - 128) / 4.0) ** 2) * np.cos(1.1 * np.arange(256))
    spectrum = np.fft.rfft(pulse)
    spectrum[[0, -1]] = 0.0
    reflected = np.fft.irfft(v * spectrum)
    pulse = np.fft.irfft(spectrum)
    assert np.sum(reflected**2) == pytest.approx(np.sum(pulse**2), rel=1e-12)
    quarter = np.fft.irfft(1j * spectrum)
    np.testing.assert_allclose(reflected, v.real * pulse + v.imag * quarter, rtol=0, atol=1e-13)


@pytest.mark.parametrize("q", [1e-3, 0.3, NORMAL])
def test_heavy_and_light_media_are_rigid_and_soft(q: float) -> None:
    heavy = SeaBottom(reflection=FluidHalfSpace(density_ratio=1e9, speed_ratio=1.5))
    light = SeaBottom(reflection=FluidHalfSpace(density_ratio=1e-9, speed_ratio=1.5))
    assert coefficient(heavy, q) == pytest.approx(1.0, abs=2e-6)
    assert coefficient(light, q) == pytest.approx(-1.0, abs=1e-8)
    assert coefficient(SeaBottom(reflection=Rigid()), q) == 1.0
    assert coefficient(SeaBottom(reflection=PressureRelease()), q) == -1.0


def test_the_air_over_the_sea_is_almost_pressure_release() -> None:
    air = SeaSurface(reflection=FluidHalfSpace(density_ratio=1.2e-3, speed_ratio=0.22))
    np.testing.assert_allclose(coefficient(air, GRAZING), coefficient(SeaSurface(), GRAZING), atol=6e-4)


def test_more_of_the_same_water_reflects_nothing() -> None:
    same = SeaBottom(reflection=FluidHalfSpace(density_ratio=1.0, speed_ratio=1.0))
    np.testing.assert_array_equal(coefficient(same, GRAZING), 0.0)


def test_a_boundary_of_density_alone_reflects_the_same_at_every_angle() -> None:
    q = np.array([0.0, 1e-12, 1e-3, 0.7, NORMAL])
    np.testing.assert_allclose(rayleigh(q, 1.5, 1.0), 0.2, rtol=1e-12)


@pytest.mark.parametrize("loss", [0.0, 1e-12, 0.01624, 0.5])
@pytest.mark.parametrize("speed", [0.98, 1.1782])
def test_the_wave_in_the_bed_goes_down_and_dies_away(speed: float, loss: float) -> None:
    """exp(+i w t - i k w z) at a depth z in the bottom, with w = m sin q (1 - V)/(1 + V): Im w <= 0 and Re w >= 0."""
    q = np.linspace(0.01, NORMAL, 200)
    v = rayleigh(q, 1.845, speed, loss)
    w = 1.845 * np.sin(q) * (1 - v) / (1 + v)
    assert w.imag.max() <= 1e-12
    assert w.real.min() >= -1e-12
    assert np.abs(w).min() > 0.01
    np.testing.assert_allclose(w**2, ((1 - 1j * loss) / speed) ** 2 - np.cos(q) ** 2, atol=1e-12)


def test_the_reflection_is_continuous_in_the_loss() -> None:
    lossy, lossless = (rayleigh(GRAZING, 1.845, 1.1782, loss) for loss in (1e-14, 0.0))
    np.testing.assert_allclose(lossy, lossless, atol=1e-12)


@pytest.mark.parametrize("reflection", EVERY)
def test_coefficients_are_continuous_at_grazing_and_normal_incidence(reflection: Reflection) -> None:
    for end, inside in ((0.0, 1e-12), (NORMAL, NORMAL - 1e-9)):
        at, near = coefficient(SeaBottom(reflection=reflection), np.array([end, inside]))
        assert abs(at - near) < 1e-8


@pytest.mark.parametrize("speed", [1e-9, 1e-3, 1 - 1e-15, 1.0, 1 + 1e-15, 1e9])
@pytest.mark.parametrize("density", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("loss", [0.0, 1e-300, 1.0])
def test_every_medium_that_may_be_described_has_finite_passive_coefficients(
    speed: float, density: float, loss: float
) -> None:
    bottom = SeaBottom(reflection=FluidHalfSpace(density_ratio=density, speed_ratio=speed, loss_tangent=loss))
    v = coefficient(bottom, np.concatenate([[0.0, 1e-300, 1e-12], GRAZING]))
    assert np.isfinite(v).all()
    assert np.abs(v).max() <= 1 + 1e-14


def test_eckarts_loss_is_the_mean_over_a_rough_boundary() -> None:
    """Each piece of the boundary at height h delays by 2 h sin q/c; Gaussian heights average to the blurred pulse."""
    rough = SeaBottom(rms_height=0.01)
    nodes, weights = np.polynomial.hermite_e.hermegauss(80)
    f, q, c = 40e3, 0.4, 1500.0
    delay = 2 * rough.rms_height * nodes * np.sin(q) / c
    mean = np.sum(weights * np.exp(-2j * np.pi * f * delay)) / np.sqrt(2 * np.pi)
    assert np.exp(-0.5 * (2 * np.pi * f * delay_std(rough, q, c)) ** 2) == pytest.approx(mean, abs=1e-13)


def test_bounces_are_the_product_of_single_reflections() -> None:
    bottom = SeaBottom(reflection=Sediment(name="fine sand"), rms_height=0.02)
    q, count, c = np.array([0.1, 0.1, 0.7, 1.5]), np.array([1, 3, 2, 5]), 1500.0
    got = bounces(bottom, q, count, c)
    np.testing.assert_allclose(got.modulus * np.exp(1j * got.phase), coefficient(bottom, q) ** count, rtol=1e-13)
    np.testing.assert_allclose(got.delay_std, 2 * 0.02 * np.sin(q) / c * np.sqrt(count), rtol=1e-11)


def test_a_path_without_reflections_is_left_as_it_is() -> None:
    for boundary in (SeaSurface(wind_speed=9.0, bubbles=True), SeaBottom(rms_height=0.1)):
        got = bounces(boundary, np.array([np.nan, 0.2]), np.array([0, 0]), np.nan, 50e3)
        assert got.modulus.tolist() == [1.0, 1.0]
        assert got.phase.tolist() == got.delay_std.tolist() == [0.0, 0.0]


def test_a_reflection_at_no_angle_is_not_a_number() -> None:
    got = bounces(SeaBottom(), np.array([np.nan, 0.2]), np.array([1, 1]), 1500.0)
    for value in (got.modulus, got.phase, got.delay_std):
        assert np.isnan(value).tolist() == [True, False]


def test_no_angle_is_no_reflection_to_the_single_coefficient() -> None:
    for boundary in (SeaSurface(wind_speed=9.0, bubbles=True), SeaBottom(), SeaBottom(reflection=TABLE)):
        assert coefficient(boundary, [np.nan], 50e3).tolist() == [1.0]
        assert delay_std(boundary, [np.nan], 1500.0).tolist() == [0.0]


@pytest.mark.parametrize("reflection", [PressureRelease(), FluidHalfSpace(density_ratio=1e-9, speed_ratio=0.5)])
def test_a_change_of_sign_is_the_phase_pi(reflection: Reflection) -> None:
    got = bounces(SeaSurface(reflection=reflection), np.array([0.0, 0.3, NORMAL, 0.3]), np.array([1, 1, 1, 3]), 1500.0)
    np.testing.assert_array_equal(got.phase, np.pi * np.array([1, 1, 1, 3]))
    np.testing.assert_allclose(got.modulus, 1.0, atol=1e-8)


def test_a_table_is_exact_at_its_nodes_and_linear_between() -> None:
    bottom = SeaBottom(reflection=TABLE)
    assert TABLE.modulus is not None
    modulus, phase = np.array(TABLE.modulus), np.array(TABLE.phase)
    at_nodes = coefficient(bottom, TABLE.grazing)
    np.testing.assert_allclose(np.abs(at_nodes), modulus, rtol=1e-15)
    np.testing.assert_allclose(np.angle(at_nodes), phase, rtol=1e-14)
    middle = coefficient(bottom, 0.5 * (np.array(TABLE.grazing)[1:] + np.array(TABLE.grazing)[:-1]))
    np.testing.assert_allclose(np.abs(middle), 0.5 * (modulus[1:] + modulus[:-1]), rtol=1e-14)
    np.testing.assert_allclose(np.angle(middle), 0.5 * (phase[1:] + phase[:-1]), rtol=1e-14)


def test_a_table_in_decibels_is_linear_in_decibels() -> None:
    bottom = SeaBottom(
        reflection=ReflectionTable(grazing=(0.0, 0.5, NORMAL), loss=(0.0, 6.0, 20.0), phase=(0.0, 0.0, 0.0))
    )
    got = coefficient(bottom, [0.0, 0.25, 0.5, NORMAL])
    np.testing.assert_allclose(-20 * np.log10(np.abs(got)), [0.0, 3.0, 6.0, 20.0], atol=1e-13)


def test_a_fine_table_of_a_fluid_bed_is_that_bed() -> None:
    """Second order in the step, away from the critical angle."""
    sand = SeaBottom(reflection=Sediment(name="medium sand"))
    probes = np.linspace(0.65, 1.55, 77)
    error = []
    for rows in (91, 181):
        angles = np.linspace(0.0, NORMAL, rows)
        v = coefficient(sand, angles)
        table = ReflectionTable(
            grazing=tuple(angles), modulus=tuple(np.minimum(np.abs(v), 1.0)), phase=tuple(np.unwrap(np.angle(v)))
        )
        error.append(np.abs(coefficient(SeaBottom(reflection=table), probes) - coefficient(sand, probes)).max())
    assert error[0] < 5e-4
    assert error[1] < 0.4 * error[0]


def test_wind_raises_the_waves_of_the_fully_developed_spectrum() -> None:
    """The variance is the integral of the spectrum of Pierson and Moskowitz over frequency."""
    u = 12.0
    w = np.geomspace(0.05, 500.0, 400_001)
    spectrum = 8.1e-3 * 9.81**2 / w**5 * np.exp(-0.74 * (9.81 / u / w) ** 4)
    variance = np.sum(0.5 * (spectrum[1:] + spectrum[:-1]) * np.diff(w))
    assert rms_height(SeaSurface(wind_speed=u)) == pytest.approx(np.sqrt(variance), rel=1e-5)
    assert rms_height(SeaSurface(wind_speed=0.0)) == 0.0
    assert wind_wave_height(1.5 * u) == pytest.approx(2.25 * wind_wave_height(u), rel=1e-14)
    expected = roughness_blur(np.sqrt(variance), 0.3, 1500.0)
    assert delay_std(SeaSurface(wind_speed=u), 0.3, 1500.0) == pytest.approx(expected, rel=1e-5)


def test_bubbles_take_their_loss_and_nothing_else() -> None:
    calm, windy = SeaSurface(wind_speed=8.0), SeaSurface(wind_speed=8.0, bubbles=True)
    q = GRAZING[1:]
    ratio = coefficient(windy, q, 50e3) / coefficient(calm, q)
    np.testing.assert_allclose(-20 * np.log10(ratio.real), bubble_loss(8.0, 50e3, q), rtol=1e-11)
    np.testing.assert_array_equal(ratio.imag, 0.0)
    assert coefficient(windy, 0.0, 50e3) == 0.0
    np.testing.assert_array_equal(delay_std(calm, q, 1500.0), delay_std(windy, q, 1500.0))


def test_the_loss_in_bubbles_is_continuous_where_waves_begin_to_break() -> None:
    below, above = bubble_loss([6.0 - 1e-9, 6.0 + 1e-9], 50e3, 0.3)
    assert below == pytest.approx(above, rel=1e-8)


@pytest.mark.parametrize("wind", [0.5, 5.0, 25.0])
def test_waves_warn_outside_the_winds_that_were_measured(wind: float) -> None:
    with pytest.warns(OutOfRange, match=f"wind speed {wind:g} m/s is outside 10 to 21 m/s"):
        assert wind_wave_height(wind) == pytest.approx(0.00533 * wind**2, rel=1e-3)
    assert wind_wave_height([0.0, 10.0, 21.0])[0] == 0.0


@pytest.mark.parametrize("frequency", [1e3, 200e3])
def test_bubbles_warn_outside_the_frequencies_of_the_handbook(frequency: float) -> None:
    with pytest.warns(OutOfRange, match="kHz is outside 10 to 100 kHz"):
        bubble_loss(8.0, frequency, 0.3)


def test_bubbles_without_a_frequency_are_refused() -> None:
    with pytest.raises(ValueError, match=r"^the loss in bubbles needs a frequency$"):
        coefficient(SeaSurface(wind_speed=8.0, bubbles=True), 0.3)


def test_bellhops_form_of_the_coefficient_is_the_same_number() -> None:
    """-(f - i s m)/(f + i s m) with f = sqrt(cos^2 q - n^2): exp(-i omega t delays) as here."""
    q = np.concatenate([np.linspace(0.01, 0.5, 20), np.linspace(0.6, NORMAL, 20)])
    for loss in (0.0, 0.02):
        n = (1 - 1j * loss) / 1.18
        f = np.sqrt(np.cos(q) ** 2 - n**2 + 0j)
        form = -(f - 1j * 1.8 * np.sin(q)) / (f + 1j * 1.8 * np.sin(q))
        np.testing.assert_allclose(rayleigh(q, 1.8, 1.18, loss), form, rtol=0, atol=1e-13)
