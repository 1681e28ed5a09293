"""Pulses that facets reshape: the time domain against the frequency domain, and the laws of the echo of one facet."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.facet_pulses import facet_mean, facet_response, mean_powers, rough_factor
from sonarsynth.equations.scattering.kirchhoff_kernels import mesh_amplitude
from sonarsynth.products import Arrivals
from sonarsynth.receiver import POINT, BandPass, LowPass, Sonar
from sonarsynth.signals import DirectSum, GriddedSynthesis, pulse_support
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.sources.snap_pulses import waveform
from tests.hearing import hearing
from tests.laws.test_synthesis import FACES, MODEL, SHARP, SNAPS, C, absorption, arrivals, error, some_of, target_at

CENTRE = SHARP.band.centre
PRECISE = GriddedSynthesis(precision="float64", width=14, tolerance=1e-10)
METHODS = (DirectSum(), PRECISE)


def paths(delay: list[float] | Floats, amplitude: list[float] | Floats, **columns: object) -> Arrivals:
    """Echoes from straight ahead, from very far."""
    n = len(delay)
    made = arrivals(np.array(delay), np.tile([1.0, 0.0, 0.0], (n, 1)), np.full(n, np.inf), np.array(amplitude))
    return replace(made, centre=CENTRE, **columns)


def heard(of: Arrivals, method: DirectSum | GriddedSynthesis | None = None, margin: float = 1.5e-3) -> Floats:
    """Pressure (sample,) in the window of the arrivals at one hydrophone, in float64."""
    hears = hearing(of, SHARP, POINT, margin=margin)
    return (method or DirectSum()).pressure(of, SNAPS, hears)[0][0]


def facet(seed: int, size: float) -> tuple[Floats, Floats, Floats]:
    """Corners (corner, xyz) of a facet about its middle, lit and seen; ways in and out."""
    rng = np.random.default_rng(seed)
    corners = size * rng.standard_normal((3, 3))
    corners -= corners.mean(axis=0)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    incident, scattered = rng.standard_normal((2, 3))
    incident -= (incident @ normal + 0.7 * abs(incident @ normal) + 0.3) * normal
    scattered += (0.3 - scattered @ normal + 0.7 * abs(scattered @ normal)) * normal
    return corners, incident / np.linalg.norm(incident), scattered / np.linalg.norm(scattered)


def echo_of(corners: Floats, incident: Floats, scattered: Floats, delay: float) -> Arrivals:
    """Kirchhoff's echo of facets (facet, corner, xyz) at 1 m, with the delays that they have about that of the
    origin."""
    middle = corners.mean(axis=1)
    across = incident - scattered
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return paths(
        delay + middle @ across / C,
        CENTRE / C * 0.5 * np.abs(area @ across),
        coherent=np.ones(len(corners), bool),
        corner_delays=(corners - middle[:, None]) @ across / C,
    )


def split(corners: Floats) -> Floats:
    """Each facet (facet, corner, xyz) in four."""
    a, b, c = corners.swapaxes(0, 1)
    x, y, z = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    return np.concatenate([np.stack(s, axis=1) for s in ((a, x, z), (x, b, y), (z, y, c), (x, y, z))])


# ---- one facet against the Kirchhoff integral ------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1e-9, 1e-3, 4e-3, 0.1])
def test_amplitude_and_response_are_the_kirchhoff_integral(size: float) -> None:
    corners, incident, scattered = facet(1, size)
    of = echo_of(corners[None], incident, scattered, 0.0)
    f = np.linspace(0.0, 1e5, 257)
    response = facet_response(f, of.coherent, of.corner_delays, of.coherent_fraction, of.height_delay_std, of.centre)
    exact = mesh_amplitude(corners[None], incident, scattered, 2.0 * np.pi * f / C)
    np.testing.assert_allclose(of.amplitude[0] * response[0], exact, atol=1e-14 * of.amplitude[0])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("size", [1e-4, 3e-3, 2e-2])
def test_signals_are_the_kirchhoff_integral_frequency_by_frequency(
    method: DirectSum | GriddedSynthesis, size: float
) -> None:
    """Tones of the filtered snap, each times the integral over the facet, summed at every time."""
    corners, incident, scattered = facet(2, size)
    delay, period = 0.03, 1 << 10
    of = echo_of(corners[None], incident, scattered, delay)
    f, spectrum = pulse_spectrum(waveform(MODEL), SHARP.antialias, SHARP.sampling_frequency, period)
    some = np.abs(spectrum) > 0.0
    omega, weight = 2.0 * np.pi * f[some], 2.0 * spectrum[some] * SHARP.sampling_frequency / period
    heard_of_it = weight * mesh_amplitude(corners[None], incident, scattered, omega / C)
    start, samples = hearing(of, SHARP, POINT, margin=1e-3)[3:5]
    t = start + np.arange(samples) / SHARP.sampling_frequency - delay
    near = np.abs(t) < 8e-4  # the period of the tones is longer than the echo
    got = heard(of, method=method, margin=1e-3)
    expected = (np.exp(1j * np.multiply.outer(t[near], omega)) @ heard_of_it).real
    assert error(got[near], expected) < 1e-10
    assert np.abs(got[~near]).max() < 1e-8 * np.abs(got).max()


def test_powers_of_delays_are_the_mean_over_the_facet() -> None:
    rng = np.random.default_rng(3)
    corners = rng.uniform(-1.0, 1.0, (50, 3)) * np.geomspace(1e-9, 1e-5, 50)[:, None]
    corners -= corners.mean(axis=1, keepdims=True)
    f, scale = np.linspace(0.0, 1e5, 9), 1e-5
    powers = mean_powers(corners, scale, 40)
    terms = np.array([(-2j * np.pi * f * scale) ** j / factorial(j) for j in range(40)])
    np.testing.assert_allclose(powers.T @ terms, facet_mean(f, corners), atol=1e-13)
    node, w = np.polynomial.legendre.leggauss(20)  # and by quadrature, over a triangle
    u, v = (g.ravel() for g in np.meshgrid(0.5 + 0.5 * node, 0.5 + 0.5 * node))
    weight = np.outer(w, w).ravel() * 0.25 * 2.0 * u
    t = corners @ np.stack([1.0 - u, u * (1.0 - v), u * v])
    np.testing.assert_allclose(powers[:9], np.array([(t / scale) ** j @ weight for j in range(9)]), atol=1e-14)


# ---- laws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_a_facet_in_four_parts_sends_the_same(method: DirectSum | GriddedSynthesis) -> None:
    corners, incident, scattered = facet(4, 4e-3)
    whole = echo_of(corners[None], incident, scattered, 0.03)
    parts = echo_of(split(corners[None]), incident, scattered, 0.03)
    array = some_of(FACES, 200, face=0.0)
    hears = hearing(whole, SHARP, array, margin=1.5e-3)
    one, four = (method.signals(x, SNAPS, hears).pressure for x in (whole, parts))
    assert error(four, one) < 2e-7  # of single precision


def test_many_tiny_facets_are_one_that_is_large() -> None:
    """Points instead of facets, each a plain derivative: their error falls by 4 with every split."""
    corners, incident, scattered = facet(5, 4e-3)
    exact, parts, errors = heard(echo_of(corners[None], incident, scattered, 0.03)), corners[None], []
    hears = hearing(echo_of(corners[None], incident, scattered, 0.03), SHARP, POINT, margin=1.5e-3)
    for _ in range(4):
        parts = split(parts)
        points = echo_of(parts, incident, scattered, 0.03)
        points = replace(points, corner_delays=np.zeros_like(points.corner_delays))
        errors.append(error(DirectSum().pressure(points, SNAPS, hears)[0][0], exact))
    assert errors[-1] < 2e-3
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.1)


@pytest.mark.parametrize("method", METHODS)
def test_a_mirror_differentiates_and_an_edge_repeats(method: DirectSum | GriddedSynthesis) -> None:
    mirror = paths([0.03], [1.0], coherent=np.ones(1, bool))
    plain, slope = heard(paths([0.03], [1.0]), method=method), heard(mirror, method=method)
    f = np.fft.rfftfreq(plain.size, 1.0 / SHARP.sampling_frequency)
    np.testing.assert_allclose(
        slope, np.fft.irfft(np.fft.rfft(plain) * 1j * f / CENTRE, plain.size), atol=1e-9 * np.abs(slope).max()
    )
    # a long strip, one of its ends at 0: what comes from there is the pulse itself, of 1/(pi f_c) over its length
    far = 1e-3
    edge = replace(mirror, delay=np.array([0.03 + far / 3.0]), corner_delays=far * np.array([[-1.0, -1.0, 2.0]]) / 3.0)
    t = hearing(mirror, SHARP, POINT, margin=1.5e-3).start + np.arange(plain.size) / SHARP.sampling_frequency - 0.03
    hears = hearing(mirror, SHARP, POINT, margin=1.5e-3)
    got = DirectSum().pressure(edge, SNAPS, hears)[0][0]
    first = np.abs(t) < 4e-4
    assert error(got[first], plain[first] / (np.pi * CENTRE * far)) < 0.01


@pytest.mark.parametrize("method", METHODS)
def test_what_is_missing_from_the_coherent_echo_is_sent_without_phase(method: DirectSum | GriddedSynthesis) -> None:
    """Powers of both parts add up to that of the smooth facet at every frequency: exp(-g^2) and 1 - exp(-g^2)."""
    height = 2e-6  # s
    plain = paths([0.03, 0.0301], [1.0, 0.3])
    blurred = replace(plain, delay_std=np.full(2, height))
    rough = replace(plain, coherent_fraction=np.ones(2), height_delay_std=np.full(2, height))
    hears = hearing(rough, SHARP, POINT, margin=1.5e-3)
    a, b, c = (np.abs(np.fft.rfft(method.pressure(x, SNAPS, hears)[0][0])) ** 2 for x in (plain, blurred, rough))
    np.testing.assert_allclose(b + c, a, atol=1e-9 * a.max())
    assert 0.1 < b.sum() / a.sum() < 0.9


def test_limits_of_roughness() -> None:
    plain = paths([0.03], [1.0])
    whole = heard(plain)
    for share, delay, expected in (
        (0.0, 1.0, 1.0),
        (0.36, 0.0, 0.8),
        (0.36, 1e-12, 0.8),
        (1.0, 1e-4, 1.0),
        (1.0, 1e300, 1.0),
    ):
        got = heard(replace(plain, coherent_fraction=np.array([share]), height_delay_std=np.array([delay])))
        assert error(got, expected * whole) < 1e-9
    for method in (*METHODS, GriddedSynthesis()):
        nothing = replace(plain, coherent_fraction=np.ones(1))
        assert not heard(nothing, method=method).any()
    f = np.geomspace(1.0, 1e6, 50)
    small = rough_factor(f, np.ones(1), np.array([1e-15]))[0]  # g to its last digit, not a difference of ones
    np.testing.assert_allclose(small, 2e-15 * np.pi * f, rtol=1e-13)


@pytest.mark.parametrize("method", [DirectSum(), GriddedSynthesis()])
def test_columns_that_say_nothing_change_no_bit(method: DirectSum | GriddedSynthesis) -> None:
    of = target_at(15.0, 30, 6)
    array = some_of(FACES, 60)
    hears = hearing(of, SHARP, array, absorption, margin=0.002)
    rng = np.random.default_rng(7)
    same = replace(of, height_delay_std=rng.uniform(0.0, 1e-3, of.delay.size), centre=np.nan)
    one, two = (method.signals(x, SNAPS, hears).pressure for x in (of, same))
    np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("method", [DirectSum(), PRECISE])
def test_corners_have_no_order_and_their_middle_is_a_delay(method: DirectSum | GriddedSynthesis) -> None:
    corners = np.array([[-6e-6, 1e-6, 3e-6], [2e-6, -4e-6, 1e-6]])
    of = paths([0.03, 0.03002], [1.0, -0.7], coherent=np.ones(2, bool), corner_delays=corners)
    off = np.array([7e-6, -3e-6])
    turned = replace(of, corner_delays=corners[:, [2, 0, 1]])
    moved = replace(of, delay=of.delay - off, corner_delays=corners + off[:, None])
    hears = hearing(of, SHARP, POINT, margin=1.5e-3)

    def one(x: Arrivals) -> Floats:
        return method.signals(x, SNAPS, hears).pressure

    assert error(one(turned), one(of)) < 2e-7
    assert error(one(moved), one(of)) < 2e-7
    assert error(one(replace(of, corner_delays=corners + off[:, None])), one(of)) > 0.1


@pytest.mark.parametrize("chosen", [None, SHARP.filter, LowPass(cutoff=80e3, transition=15e3, attenuation=120)])
def test_a_reshaped_pulse_is_over_after_its_support(chosen: BandPass | LowPass | None) -> None:
    sonar = Sonar(filter=chosen)
    left = 1e-5 if chosen is None else 5e-7  # 80 dB down and beyond half the sampling frequency
    for sloped, rough in ((True, 0.0), (False, 3e-8), (False, 5e-6)):
        shape = {"coherent": np.array([sloped]), "coherent_fraction": np.array([1.0 * (rough > 0.0)])}
        of = paths([0.05], [1.0], **shape, height_delay_std=np.array([rough]))
        before, after = pulse_support(waveform(MODEL), sonar.antialias, sloped=sloped, rough=rough)
        hears = hearing(of, sonar, POINT, margin=0.012)
        got = np.abs(DirectSum().pressure(of, SNAPS, hears)[0][0])
        t = hears.start + np.arange(hears.samples) / sonar.sampling_frequency - 0.05
        assert got[(t < -before) | (t > after)].max() < left * got.max()
