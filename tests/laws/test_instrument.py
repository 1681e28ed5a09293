"""Noise of the stated density, and the converter."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.environment.noise import FlatNoise, WenzNoise
from sonarsynth.equations.noise.ambient_noise import power_density, wenz_level
from sonarsynth.equations.noise.filters import response
from sonarsynth.products import Signals
from sonarsynth.randomness import stream
from sonarsynth.receiver import BandPass, Converter, PlanarLattice, Sonar, elements
from sonarsynth.signals import add_noise, convert
from sonarsynth.signals.filtered_pulse import fir

SONAR = Sonar()
ARRAY = elements(PlanarLattice(columns=16, rows=16, pitch=0.05))


def silence(samples: int, sensors: int = 256) -> Signals:
    return Signals(np.zeros((sensors, samples), np.float32), 0.0, SONAR.sampling_frequency, 0.0, 0, 3)


def periodogram(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One-sided density (Pa2/Hz), mean over sensors, with a Hann window against leakage."""
    n = x.shape[1]
    taper = np.hanning(n)
    power = np.abs(np.fft.rfft(x * taper, axis=1)) ** 2
    return np.fft.rfftfreq(n, 1 / SONAR.sampling_frequency), 2 * power.mean(axis=0) / (
        SONAR.sampling_frequency * np.sum(taper**2)
    )


@pytest.mark.parametrize("samples", [600, 1021, 2000])
@pytest.mark.parametrize("noise", [FlatNoise(level=60.0), WenzNoise(wind_speed=8.0)])
def test_density_is_the_stated_whatever_the_number_of_samples(samples: int, noise: FlatNoise | WenzNoise) -> None:
    got = add_noise(silence(samples), noise, SONAR, ARRAY, stream(1, "noise", samples))
    f, density = periodogram(got.pressure.astype(float))
    inside = (f > 29e3) & (f < 81e3)
    level = noise.level if isinstance(noise, FlatNoise) else wenz_level(f[inside], noise.shipping, noise.wind_speed)
    ratio = density[inside] / power_density(level)
    assert abs(ratio.mean() - 1) < 5 * 1.5 / np.sqrt(256 * inside.sum())
    assert np.abs(ratio - 1).max() < 6 / np.sqrt(256)
    assert got.outside == 3


def test_noise_passes_through_the_filter() -> None:
    sonar = Sonar(filter=BandPass(low=40e3, high=60e3, transition=20e3, attenuation=60))
    got = add_noise(silence(4000), FlatNoise(level=100.0), sonar, ARRAY, stream(2))
    f, density = periodogram(got.pressure.astype(float))
    expected = power_density(100.0) * response(f, fir(sonar.antialias)) ** 2
    near = np.convolve(expected, np.ones(3) / 3, "same")  # the window smears by a bin
    loud = expected > 1e-3 * expected.max()
    assert np.abs(density[loud] / near[loud] - 1).max() < 0.5
    assert density[(f < 25e3) | (f > 75e3)].max() < 1e-5 * expected.max()


def test_noise_is_gaussian_independent_and_as_loud_at_both_ends() -> None:
    got = add_noise(silence(2048), FlatNoise(level=60.0), SONAR, ARRAY, stream(3)).pressure.astype(float)
    f = np.linspace(0.0, 98e3, 9801)
    power = float(np.trapezoid(power_density(60.0) * response(f, fir(SONAR.antialias)) ** 2, f))
    z = got / np.sqrt(power)
    assert (z**2).mean() == pytest.approx(1.0, abs=0.01)
    assert (z**4).mean() == pytest.approx(3.0, abs=0.06)
    between = (z[:-1] * z[1:]).mean(axis=1)
    assert np.abs(between).max() < 6 * np.sqrt(196 / 120 / 2048)
    ends = (z[:, :20] * z[:, -20:][:, ::-1]).mean()
    assert abs(ends) < 0.1
    wrapped = (z[:, 0] * z[:, -1]).mean()  # neighbours on a circle would be correlated by sinc(60/98)..., not these
    assert abs(wrapped) < 5 / 16


def test_dead_elements_stay_silent_and_no_noise_is_no_change() -> None:
    some = elements(PlanarLattice(columns=16, rows=16, pitch=0.05, dead=(7,)))
    got = add_noise(silence(300), FlatNoise(level=60.0), SONAR, some, stream(4))
    assert not got.pressure[7].any()
    assert got.pressure[8].any()


def test_noise_is_the_same_for_the_same_stream() -> None:
    a, b, c = (
        add_noise(silence(300), FlatNoise(level=60.0), SONAR, ARRAY, stream(5, *k)).pressure for k in ((1,), (1,), (2,))
    )
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)


@pytest.mark.parametrize(("bits", "ratio"), [(12, 74.008), (16, 98.091)])
def test_full_scale_sine_has_the_ratio_of_its_bits(bits: int, ratio: float) -> None:
    converter = Converter(bits=bits, full_scale=1.0)
    t = np.arange(400_000)
    wave = (converter.full_scale - converter.quantum) * np.sin(2 * np.pi * 0.0712345 * t)
    signals = Signals(wave[None], 0.0, 196e3, 0.0, 0, 0)  # float64 in, so that only the converter rounds
    got = convert(signals, converter)
    rounding = got.pressure.astype(float)[0] - wave
    assert 10 * np.log10((wave**2).mean() / (rounding**2).mean()) == pytest.approx(ratio, abs=0.1)
    assert got.clipped == 0


def test_counts_are_whole_and_clipping_is_counted() -> None:
    converter = Converter(bits=8, full_scale=10.0)
    wave = np.array([[0.0, 0.04, -0.04, 5.0, 9.99, -9.99, 11.0, -1e6, 3.21]], np.float32)
    got = convert(Signals(wave, 0.0, 1.0, 0.0, 2, 0), converter)
    counts = got.pressure / converter.quantum
    np.testing.assert_array_equal(counts, np.rint(counts))
    assert np.abs(counts).max() == 127
    assert got.clipped == 2 + 4
    assert got.quantum == converter.quantum
    np.testing.assert_array_equal(convert(got, converter).pressure, got.pressure)
    assert convert(got, None) is got


def test_a_count_times_the_quantum_to_the_last_bit() -> None:
    converter = Converter(bits=24, full_scale=3.7)
    wave = np.linspace(-3.6, 3.6, 20001)[None].astype(np.float32)
    got = convert(Signals(wave, 0.0, 1.0, 0.0, 0, 0), converter)
    counts = np.rint(got.pressure.astype(float) / converter.quantum)
    np.testing.assert_array_equal((counts * converter.quantum).astype(np.float32), got.pressure)


def test_signals_that_are_not_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="NaN"):
        convert(Signals(np.full((1, 3), np.nan, np.float32), 0.0, 1.0, 0.0, 0, 0), Converter(full_scale=1.0))
