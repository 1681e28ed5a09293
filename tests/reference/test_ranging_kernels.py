"""Compiled kernels of locating and ranging, against the formulas that they stand for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.fft import ifft, next_fast_len

from sonarsynth.compiling import compiled
from sonarsynth.conventions import direction
from sonarsynth.equations.arrays.apertures import element_directivity, focus_delay
from sonarsynth.equations.kernels.lanes import LANES, store
from sonarsynth.equations.kernels.phasors import phasors
from sonarsynth.equations.kernels.sensor_rows import heard_power, power_and_peak
from sonarsynth.imaging.delay_and_sum.lattice_beams import LatticeBeams
from sonarsynth.imaging.delay_and_sum.lattice_sums import TERM, sums_of_one, sums_of_two
from sonarsynth.products import Signals
from sonarsynth.ranging import ranging_kernels
from sonarsynth.ranging.location.pulse_times import in_band
from sonarsynth.ranging.range_profiles import HALFWAY, template_spectrum
from sonarsynth.receiver import Band, PlanarLattice, Romanis, elements

SPEED = 1540.0
AXIS = np.array([1.0, 0.0, 0.0])
LATTICES = [
    Romanis(dead=(0, 250, 507)),
    PlanarLattice(columns=7, rows=4, pitch=0.05, dead=(3,)),
    PlanarLattice(columns=4, rows=9, pitch=0.05, mask=("##..",) * 5 + (".#.#",) * 4),
    PlanarLattice(columns=64, rows=1, pitch=0.02),
    PlanarLattice(columns=1, rows=300, pitch=0.01),
    PlanarLattice(columns=1, rows=1, pitch=0.05),
]


def random_spectra(sensors, bins):
    random = np.random.default_rng(7)
    return (random.normal(size=(sensors, bins)) + 1j * random.normal(size=(sensors, bins))).astype(np.complex64)


def lattice_beams(spectra, frequencies, array, u, focus):
    return LatticeBeams(lambda: spectra, frequencies, array, array.gain / array.gain.sum(), SPEED, focus)(u)


@pytest.mark.parametrize("array", LATTICES)
@pytest.mark.parametrize("focus", [None, 3.0])
def test_beams_of_a_lattice_equal_direct_sums(array, focus):
    """Beams in any order, several to an elevation; focused on the axis; dead elements are not listened to."""
    heard = elements(array)
    random = np.random.default_rng(2)
    u = direction(random.uniform(-1, 1, 9), random.choice([-0.7, -0.1, 0.0, 0.4], 9))
    for bins in (1, 16, 50):
        spectra = random_spectra(heard.count, bins)
        spectra[heard.gain == 0] = np.nan
        frequencies = 25e3 + 400.0 * np.arange(bins)
        live = np.flatnonzero(heard.gain)
        q = heard.position[live]
        delay = focus_delay(q, AXIS, focus, SPEED) - u @ q.T / SPEED
        phasor = np.exp(2j * np.pi * frequencies * delay[:, :, None])
        exact = np.einsum("qf,bqf->bf", spectra[live].astype(complex), phasor) / len(live)
        beams = lattice_beams(spectra, frequencies, heard, u, focus)
        assert beams.shape == (9, bins)
        error = max(2e-6, 5e-8 * max(heard.columns, heard.rows))
        np.testing.assert_allclose(beams, exact, atol=error * np.abs(exact).max())


@compiled
def _both_ways(terms, odd, near, far, out):
    c, s = phasors(near, 30e3, 400.0)
    d, t = phasors(far, 30e3, 400.0)
    together = sums_of_two(terms, 0, terms.size, odd, c, s, d, t)
    apart = sums_of_one(terms, 0, terms.size, odd, c, s), sums_of_one(terms, 0, terms.size, odd, d, t)
    for which in range(2):
        for n in range(8):
            store(out, (which * 8 + n) * LANES, together[which][n])
            store(out, (16 + which * 8 + n) * LANES, apart[which][n])


@pytest.mark.parametrize("odd", [False, True])
def test_two_directions_at_once_are_each_by_itself(odd):
    """To the bit: processors of many registers take two at once, others one after the other."""
    terms = np.random.default_rng(3).normal(size=13 * TERM).astype(np.float32)
    out = np.empty(32 * LANES, np.float32)
    _both_ways(terms, odd, 3.1e-6, -1.7e-5, out)
    together, apart = out.reshape(2, -1)
    assert together.any()
    np.testing.assert_array_equal(together, apart)


@pytest.mark.parametrize("sine", [0.0, 1e-300, 1e-12, 0.3, -0.9])
def test_face_responses_are_sincs_to_the_last_digits(sine):
    """From 0 Hz on, at the null of a face and beyond, and for directions that are hardly off the axis."""
    frequency = 3125.0 * np.arange(400)
    u = np.stack([np.zeros(3), [sine, -sine, 0.5 * sine], [0.2, 0.0, sine]], axis=-1)
    delay = u * (0.04953 / SPEED)
    got = ranging_kernels.face_responses(delay[:, 1], delay[:, 2], 0.0, 3125.0, 400)
    np.testing.assert_allclose(got, element_directivity(frequency, u[:, None], 0.04953, SPEED), rtol=1e-12, atol=1e-14)


def test_turning_delays_a_spectrum():
    random = np.random.default_rng(0)
    spectrum = random.normal(size=(5, 300)) + 1j * random.normal(size=(5, 300))
    delay = random.uniform(-1e-3, 1e-3, 5)
    exact = spectrum * np.exp(2j * np.pi * (25e3 + 200.0 * np.arange(300)) * delay[:, None])
    np.testing.assert_allclose(ranging_kernels.turned(spectrum, delay, 25e3, 200.0), exact, atol=1e-11)


def test_windows_move_with_the_time_and_hold_nothing_beyond_the_ends():
    random = np.random.default_rng(1)
    pressure = random.normal(size=(6, 100)).astype(np.float32)
    pressure[5] = np.nan  # dead
    place, gain = np.array([50.0, 40.25, 3.7, 97.5, -60.0, 50.0]), np.array([1.0, 0.5, 1.0, 1.0, 1.0, 0.0])
    half = 31
    index = np.floor(place)[:, None].astype(int) - half + np.arange(2 * half)
    into = np.clip(4 * (1 - np.abs(index - place[:, None]) / half), 0, 1)
    window = (0.5 - 0.5 * np.cos(np.pi * into)) * ((index >= 0) & (index < 100)) * gain[:, None]
    exact = np.nan_to_num(np.take_along_axis(pressure, np.clip(index, 0, 99), axis=1)) * window
    np.testing.assert_allclose(ranging_kernels.cut_out(pressure, place, half, gain), exact, atol=1e-14)


@pytest.mark.parametrize("sensors", [3, 9, 10, 11, 24])
def test_powers_count_who_is_live(sensors):
    random = np.random.default_rng(3)
    pressure = random.normal(size=(sensors, 50)).astype(np.float32)
    live = np.arange(sensors) % 4 != 2
    pressure[2, 10] = -99.0
    for some in (slice(0, 50), slice(7, 41)):
        power, peak = power_and_peak(pressure, live, some.start, some.stop)
        np.testing.assert_allclose(power, np.sum(pressure[live, some].astype(float) ** 2, axis=0), rtol=1e-14)
        assert peak == np.abs(pressure[live, some]).max()


def test_power_of_a_part_of_a_record_is_that_of_its_whole():
    """Whether the whole was asked for before or not, bit for bit."""
    signals = Signals(np.random.default_rng(3).normal(size=(11, 50)).astype(np.float32), 0.0, 196e3, 0.0, 0, 0)
    before = heard_power(signals, 7, 41)[0]
    every, peak = heard_power(signals, 0, 50)
    after, same = heard_power(signals, 7, 41)
    np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(before, every[7:41])
    assert peak == same == np.abs(signals.pressure).max()


def test_lags_and_templates_are_the_sums_of_their_formulas():
    random = np.random.default_rng(4)
    heard = random.normal(size=(9, 20)) + 1j * random.normal(size=(9, 20))
    response, omega = random.normal(size=(9, 20)), random.uniform(1, 2, 20)
    total, power = ranging_kernels.template_sums(heard, response)
    np.testing.assert_allclose(total, np.sum(response * heard, axis=0), rtol=1e-12)
    np.testing.assert_allclose(power, np.sum(response**2, axis=0), rtol=1e-12)
    model = response * (total / power)
    rest = heard - model
    slope, weight, unexplained, across = ranging_kernels.lag_sums(heard, response, total / power, omega)
    np.testing.assert_allclose(slope, np.imag(model * rest.conj()) @ omega, atol=1e-12)
    np.testing.assert_allclose(weight, np.abs(model) ** 2 @ omega**2, rtol=1e-12)
    np.testing.assert_allclose(unexplained, np.sum(np.abs(rest) ** 2, axis=1), rtol=1e-12)
    np.testing.assert_allclose(across, np.sum(np.imag(rest / (model / np.abs(model))) ** 2, axis=1), rtol=1e-12)


def test_the_loudest_near_is_the_loudest_of_all_pairs():
    random = np.random.default_rng(6)
    elevation, azimuth = np.linspace(-0.1, 0.1, 11), np.linspace(-0.15, 0.15, 16)
    row, column = np.nonzero(random.random((11, 16)) < 0.4)
    index = np.full((11, 16), -1)
    index[row, column] = np.arange(len(row))
    u = direction(azimuth[column], elevation[row])
    power = random.random((len(row), 40)).astype(np.float32)
    top = random.integers(0, 40, len(row))
    reach, about = 0.045, 2
    got = ranging_kernels.loudest_near(power, top, about, row, column, index, 3, 3, u, reach)
    near = np.linalg.norm(u[:, None] - u, axis=2) <= reach
    at = np.abs(np.arange(40) - top[:, None]) <= about
    exact = [power[near[b]][:, at[b]].max() for b in range(len(row))]
    assert np.array_equal(got, np.array(exact, np.float32))


@pytest.mark.parametrize("length", [40, 62, 1280])
def test_a_template_has_its_own_spectrum_at_other_frequencies(length):
    """Against the direct transform of its waveform, whether the other FFT is longer or shorter than the template."""
    rate, half = 196e3, 31
    t = (np.arange(2 * half) - half) / rate
    wave = np.exp(-(((t - 1e-5) / 3e-5) ** 2)) * np.cos(2 * np.pi * 50e3 * t)
    template = np.array([np.sum(wave * np.exp(-2j * np.pi * f * t)) for f in np.arange(half + 1) * rate / (2 * half)])
    got = template_spectrum(template, length)
    exact = np.array([np.sum(wave * np.exp(-2j * np.pi * f * t)) for f in np.arange(length // 2 + 1) * rate / length])
    np.testing.assert_allclose(got, exact, atol=1e-12)


def test_a_band_between_two_bins_has_the_nearest():
    frequency = 3e3 * np.arange(20)
    assert in_band(frequency, Band(low=9e3, high=15e3)) == slice(3, 6)
    assert in_band(frequency, Band(low=9.1e3, high=11e3)) == slice(3, 4)
    assert in_band(frequency, Band(low=70e3, high=71e3)) == slice(19, 20)


@pytest.mark.parametrize(("bins", "cut"), [(1, 0), (2, 1), (3, 0), (50, 3), (347, 100)])
def test_powers_between_delays_are_those_of_a_transform_to_all_of_them(bins, cut):
    """Of spectra that are tapered as profiles are, few bins within 1 %; an even or odd number of delays."""
    spectra = random_spectra(4, bins) * np.sin(np.pi * (np.arange(bins) + 0.5) / bins) ** 2
    length = next_fast_len(2 * bins)
    exact = np.abs(ifft(spectra.astype(complex), 2 * length, axis=1))[:, : 2 * length - cut] * 2
    found, total = np.empty(exact.shape, np.float32), np.empty(len(exact), np.float32)
    loudest = np.zeros(exact.shape[1], np.float32)
    ranging_kernels.powers(ifft(spectra.astype(np.complex64), length, axis=1), HALFWAY, found, total, loudest)
    np.testing.assert_array_equal(loudest, found.max(axis=0))
    np.testing.assert_allclose(total, found.sum(axis=1, dtype=float), rtol=1e-5)
    np.testing.assert_allclose(np.sqrt(found), exact, atol=(1e-2 if bins < 16 else 1e-4) * exact.max())
