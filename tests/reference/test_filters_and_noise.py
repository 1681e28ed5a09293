"""Filters against scipy's, kernels against their transforms, noise spectra against published values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from sonarsynth.environment.noise import TabulatedNoise, ThermalNoise, WenzNoise, WindNoise
from sonarsynth.equations.bubble import pulses, snap_pressure
from sonarsynth.equations.noise import ambient_noise, filters
from sonarsynth.equations.noise.complex_normals import box_muller
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.sources.shrimp import LogarithmicBubble
from tests.filtered import filtered_pulse

MODEL = LogarithmicBubble()
BUBBLE = snap_pressure.Bubble(MODEL.a, MODEL.k, MODEL.m, MODEL.q, MODEL.density)
LOW = Fir(0.0, 110e3, 10e3, 80.0)
BAND = Fir(25e3, 85e3, 5e3, 80.0)


@pytest.mark.parametrize("fir", [LOW, BAND, Fir(30e3, 40e3, 4e3, 30.0), Fir(0.0, 20e3, 8e3, 140.0)])
def test_response_is_that_of_firwin_at_a_high_rate(fir: Fir) -> None:
    half = 5000
    taps, rate = 2 * half + 1, 2 * half / filters.duration(fir)
    edges = fir.high if fir.low == 0 else [fir.low, fir.high]
    h = signal.firwin(
        taps, edges, window=("kaiser", filters.kaiser_beta(fir.attenuation)), pass_zero=fir.low == 0, fs=rate
    )
    f = np.linspace(0.0, 2.0 * fir.high, 101)
    lag = (np.arange(taps) - taps // 2) / rate
    exact = np.cos(2 * np.pi * np.outer(f, lag)) @ h
    np.testing.assert_allclose(filters.response(f, fir), exact, atol=3e-4 if fir.attenuation < 50 else 3e-6)


@pytest.mark.parametrize("fir", [LOW, BAND])
def test_length_is_that_of_kaiserord(fir: Fir) -> None:
    rate = 1e9
    taps, beta = signal.kaiserord(fir.attenuation, fir.transition / (0.5 * rate))
    assert filters.duration(fir) == pytest.approx((taps - 1) / rate, abs=2 / rate)
    assert filters.kaiser_beta(fir.attenuation) == pytest.approx(beta)


@pytest.mark.parametrize("fir", [LOW, BAND])
def test_pass_band_edge_and_stop_band(fir: Fir) -> None:
    edge = filters.response(fir.high, fir)
    assert float(edge) == pytest.approx(0.5, abs=1e-4)
    half = 0.5 * fir.transition
    inside = np.linspace(fir.low + half if fir.low else 0.0, fir.high - half, 500)
    assert np.abs(filters.response(inside, fir) - 1).max() < 1.2 * 10 ** (-fir.attenuation / 20)
    outside = np.linspace(fir.high + half, 3 * fir.high, 500)
    assert np.abs(filters.response(outside, fir)).max() < 1.2 * 10 ** (-fir.attenuation / 20)


def test_filtered_pulse_is_the_inverse_transform_of_the_product() -> None:
    fir = Fir(20e3, 60e3, 8e3, 150.0)  # so little beyond 100 kHz that the integral may end there
    f = np.arange(0.0, 100e3, 100.0)
    product = snap_pressure.spectrum(f, BUBBLE) * filters.response(f, fir)
    t = np.array([-4e-4, -1e-4, -2e-5, -3e-6, 0.0, 5e-6, 1.3e-4])
    wave = 2 * 100.0 * np.real(np.exp(2j * np.pi * np.outer(t, f)) @ product)
    np.testing.assert_allclose(filtered_pulse(t, BUBBLE, fir), wave, atol=1e-7 * np.abs(wave).max())


@pytest.mark.parametrize("fir", [LOW, BAND])
def test_support_holds_the_pulse_and_no_more(fir: Fir) -> None:
    peak = np.abs(filtered_pulse(np.linspace(-2e-5, 2e-5, 201), BUBBLE, fir)).max()
    for tolerance in (1e-3, 1e-5, 1e-7):
        before, after = pulses.support(MODEL.pulse(0.0, 2.0 * fir.high), fir, tolerance)
        outside = np.concatenate([np.linspace(-before - 3e-4, -before, 100), np.linspace(after, after + 2e-4, 60)])
        assert np.abs(filtered_pulse(outside, BUBBLE, fir)).max() <= tolerance * peak
        inside = np.concatenate([-before + np.linspace(0, 2e-5, 40), after - np.linspace(0, 2e-5, 40)])
        assert np.abs(filtered_pulse(inside, BUBBLE, fir)).max() > 0.3 * tolerance * peak
    assert after <= 0.5 * filters.duration(fir) + 2e-6


@pytest.mark.parametrize(("width", "oversampling"), [(6, 1.5), (14, 2.0)])
def test_kernel_transform_is_its_integral(width: int, oversampling: float) -> None:
    beta = filters.kaiser_bessel_beta(width, oversampling)
    node, weight = np.polynomial.legendre.leggauss(200)
    x, w = 0.5 * width * node, 0.5 * width * weight
    for cycles in (0.0, 0.2, 0.37, beta / (np.pi * width), 0.9):
        integral = np.sum(w * filters.kaiser_bessel(x, width, beta) * np.cos(2 * np.pi * cycles * x))
        assert float(filters.kaiser_bessel_transform(cycles, width, beta)) == pytest.approx(integral, abs=1e-13)
    assert float(filters.kaiser_bessel(0.0, width, beta)) == pytest.approx(1.0)
    assert float(filters.kaiser_bessel(0.51 * width, width, beta)) == 0.0


WENZ = {  # kHz: turbulence, shipping, wind, thermal, total
    1: (17, 39.230, 60.925, -15, 60.955),
    10: (-13, 5.922, 46.089, 5, 46.090),
    25: (-24.938, -7.561, 38.536, 12.959, 38.548),
    50: (-33.969, -17.781, 32.653, 18.979, 32.835),
    85: (-40.883, -25.609, 28.101, 23.588, 29.416),
}


@pytest.mark.parametrize("kilohertz", WENZ)
def test_noise_levels_are_the_published(kilohertz: float) -> None:
    f = 1e3 * kilohertz
    got = [
        *(float(v) for v in ambient_noise.wenz_components(f, 0.5, 5.0).values()),
        float(ambient_noise.wenz_level(f, 0.5, 5.0)),
    ]
    assert got == pytest.approx(WENZ[kilohertz], abs=6e-4)


def test_noise_levels_elsewhere() -> None:
    assert float(ambient_noise.wenz_components(1e5, 0.5, 5.0)["wind"]) == pytest.approx(26.701, abs=6e-4)
    assert float(ambient_noise.wenz_level(1e5, 0.5, 5.0)) == pytest.approx(28.944, abs=6e-4)
    assert float(ambient_noise.wenz_level(2e5, 0.5, 5.0)) == pytest.approx(31.408, abs=6e-4)
    assert float(ambient_noise.wenz_level(1e4, 0.5, 0.0)) == pytest.approx(29.355, abs=6e-4)
    assert float(ambient_noise.wenz_level(5e4, 0.5, 0.0)) == pytest.approx(20.712, abs=6e-4)
    f = np.linspace(25e3, 85e3, 20001)
    band = np.trapezoid(ambient_noise.power_density(ambient_noise.wenz_level(f, 0.5, 5.0)), f)
    assert 10 * np.log10(band / 1e-12) == pytest.approx(81.31, abs=6e-3)


def test_noise_by_sea_state_and_of_rain() -> None:
    assert float(ambient_noise.knudsen_level(20e3, 2.0)) == pytest.approx(39.6, abs=0.1), "Knudsen's line of state 2"
    slope = ambient_noise.knudsen_level(20e3, 3.0) - ambient_noise.knudsen_level(10e3, 3.0)
    assert float(slope) == pytest.approx(-5.1, abs=0.05), "5 dB an octave"
    assert float(ambient_noise.rain_level(5e3, 10.0)) == pytest.approx(57.8, abs=1e-9)
    assert float(ambient_noise.rain_level(10e3, 10.0) - ambient_noise.rain_level(5e3, 10.0)) == pytest.approx(
        -3.01, abs=0.01
    )


def test_parts_of_wenz_are_the_parts_that_can_be_asked_for() -> None:
    f = np.geomspace(1e3, 2e5, 40)
    both = WindNoise(wind_speed=8.0).density(f) + ThermalNoise().density(f)
    components = ambient_noise.wenz_components(f, 0.5, 8.0)
    rest = sum(ambient_noise.power_density(components[name]) for name in ("turbulence", "shipping"))
    np.testing.assert_allclose(both + rest, WenzNoise(wind_speed=8.0).density(f), rtol=1e-12)
    table = TabulatedNoise(frequencies=(1e3, 1e5), levels=(60.0, 20.0))
    assert float(table.density(np.array([1e4]))[0]) == pytest.approx(1e-12 * 1e4, rel=1e-9), "40 dB half way"
    assert table.validity(25e3, 85e3) == () and "1000 to 100000 Hz" in table.validity(25e3, 2e5)[0]


def test_quantisation() -> None:
    density = ambient_noise.quantisation_density(2.0 / 2**16, 196e3)
    assert 10 * np.log10(density) == pytest.approx(-151.01, abs=6e-3)


def test_normal_numbers_are_those_of_box_and_muller_in_double_precision() -> None:
    bits = np.random.default_rng(3).integers(0, 1 << 32, 1 << 18, np.uint32)
    bits[:6] = 0, 0, (1 << 32) - 1, (1 << 32) - 1, 1 << 31, 1 << 31  # the largest radius, the smallest
    power = np.linspace(0.5, 2.0, bits.size // 2).astype(np.float32)
    pairs = np.empty(bits.size, np.float32)
    box_muller(power, bits, pairs)
    angle, uniform = 2.0 * np.pi * bits[::2] / 2.0**32, (bits[1::2] + 0.5) / 2.0**32
    exact = np.sqrt(-2.0 * power * np.log(uniform)) * np.exp(1j * angle)
    # a number near one is known to half of the last of 24 bits, its logarithm to as much: sqrt(2 power 2^-24)
    assert np.abs(pairs[::2] + 1j * pairs[1::2] - exact)[uniform < 0.999].max() < 1e-5
    assert np.abs(pairs[::2] + 1j * pairs[1::2] - exact).max() < np.sqrt(2.0 * 2.0 * 2.0**-24)
    assert abs(pairs[:2] - [np.sqrt(2.0 * 0.5 * 33.0 * np.log(2.0)), 0.0]).max() < 1e-5
