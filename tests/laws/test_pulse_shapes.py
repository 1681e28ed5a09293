"""Pulses that paths turn in phase, blur and stretch: closed forms, the fast synthesis against the exact one, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import hilbert

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.description import FieldError
from sonarsynth.equations.bubble.snap_pressure import Bubble
from sonarsynth.products import Arrivals
from sonarsynth.receiver import POINT, LowPass, Sonar
from sonarsynth.signals import DirectSum, GriddedSynthesis, pulse_support
from sonarsynth.signals.array_paths import array_paths, folded
from sonarsynth.signals.filtered_pulse import (
    fir,
    pulse_spectrum,
    silencing_blur,
    stretch_sizes,
    stretched_spectra,
)
from sonarsynth.signals.pulse_shapes import shape_modes
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_models import Gabor
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.sources.transmitter import Sweep
from sonarsynth.state import Emission
from tests.filtered import filtered_pulse
from tests.hearing import hearing
from tests.laws.test_synthesis import FACES, MODEL, SHARP, SNAPS, SONAR, absorption, arrivals, error, some_of, target_at

LOW = Sonar(filter=LowPass(cutoff=60e3, attenuation=140), sampling_frequency=250e3)
METHODS = (DirectSum(), GriddedSynthesis(precision="float64", width=14, tolerance=1e-9))


def shaped(
    of: Arrivals, seed: int, *, phase: float = 10.0, delay_std: float = 20e-6, doppler: float = 3e-3
) -> Arrivals:
    """Random shapes, of a few different stretches (each costs the exact sum a spectrum); some paths stay plain."""
    rng, n = np.random.default_rng(seed), of.delay.size
    some = rng.random((3, n)) < 0.8
    return replace(
        of,
        phase=np.where(some[0], rng.uniform(-phase, phase, n), 0.0),
        delay_std=np.where(some[1], rng.uniform(0.0, delay_std, n), 0.0),
        doppler=np.where(some[2], rng.choice(doppler * np.array([-1.0, -0.3, 0.8, 1.0]), n), 0.0),
    )


def alone(sonar: Sonar, phase: float = 0.0, delay_std: float = 0.0, doppler: float = 0.0) -> tuple[Floats, Floats]:
    """Times after the collapse (sample,) and the exact pressure (sample,) of one path at one hydrophone."""
    of = arrivals([0.05], [[1.0, 0.0, 0.0]], [10.0], [1.0])
    of = replace(of, phase=np.array([phase]), delay_std=np.array([delay_std]), doppler=np.array([doppler]))
    hears = hearing(of, sonar, POINT, margin=0.006)
    got, outside = DirectSum().pressure(of, SNAPS, hears)
    assert outside == 0
    return hears.start + np.arange(hears.samples) / sonar.sampling_frequency - 0.05, got[0]


# ---- the exact sum against closed forms ------------------------------------------------------------------------------


def test_a_quarter_turn_is_less_the_hilbert_transform() -> None:
    """exp(+i phase) at positive frequencies; Hilbert's transform has -i there."""
    _, plain = alone(SHARP)
    _, turned = alone(SHARP, phase=0.5 * np.pi)
    assert error(turned, -np.imag(hilbert(plain))) < 1e-6
    _, between = alone(SHARP, phase=-0.7)
    assert error(between, np.cos(0.7) * plain - np.sin(0.7) * turned) < 1e-11


def test_a_blur_is_a_gaussian_in_time() -> None:
    """Convolved in time with the Gaussian of that standard deviation, by Gauss-Hermite quadrature."""
    delay_std = 7e-6
    t, got = alone(SHARP, delay_std=delay_std)
    near = np.abs(t) < 3e-4
    x, w = np.polynomial.hermite_e.hermegauss(24)
    delayed = [filtered_pulse(t[near] - delay_std * late, MODEL.bubble, fir(SHARP.antialias)) for late in x]
    expected = w @ delayed / w.sum()
    assert error(got[near], expected) < 1e-8


@pytest.mark.parametrize("doppler", [3e-3, -3e-2])
def test_a_stretched_snap_is_that_of_a_slower_bubble(doppler: float) -> None:
    """p(t/(1 + s)) is (1 + s)^2 times the pressure of the bubble that lives 1 + s times as long; then the filter."""
    t, got = alone(SHARP, doppler=doppler)
    one = MODEL.bubble
    longer = 1.0 + doppler
    slower = Bubble(one.a, one.k / longer, one.m * longer, one.q / longer, one.density)
    near = np.abs(t) < 3e-4
    expected = longer**2 * filtered_pulse(t[near], slower, fir(SHARP.antialias))
    assert error(got[near], expected) < 1e-7


@pytest.mark.parametrize("sonar", [SHARP, LOW])
def test_a_turned_pulse_is_over_after_its_support(sonar: Sonar) -> None:
    before, after = pulse_support(waveform(MODEL), sonar.antialias, turned=True)
    for phase in (0.5 * np.pi, 0.9):
        t, got = alone(sonar, phase=phase)
        size = np.abs(got) / np.abs(got).max()
        assert size[(t < -before) | (t > after)].max() < 2e-7  # of its peak, which the envelope's may be above
    assert size[(t < -0.7 * before) | (t > 0.7 * after)].max() > 2e-7  # and not long before
    plain = pulse_support(waveform(MODEL), sonar.antialias)
    assert before >= plain[0]
    assert after >= plain[1]


# ---- the fast synthesis against the exact sum ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "bound"),
    [(GriddedSynthesis(), 1e-4), (GriddedSynthesis(width=14, precision="float64", tolerance=1e-11), 1e-8)],
)
def test_kernel_deposit_is_the_exact_sum(method: GriddedSynthesis, bound: float) -> None:
    """All at once: phase, blur and stretch of any size, refracted fronts, several snaps of different kinds."""
    snaps = (*SNAPS, Emission(np.zeros(3), 0.0, LogarithmicBubble(q=-2.5e5), 190.0))
    array = some_of(FACES, 60)
    of = shaped(target_at(8.0, 9, 2, refracted=True, direct=False), 3)
    of = replace(of, snap=np.random.default_rng(4).integers(0, 2, of.delay.size))
    hears = hearing(of, SHARP, array, absorption, margin=4e-4)
    exact, _ = DirectSum().pressure(of, snaps, hears)
    got, outside = method.pressure(of, snaps, hears)
    assert outside == 0
    assert 1e-14 < error(got, exact) < bound


@pytest.mark.parametrize(("phase", "delay_std"), [(1.0, 0.0), (0.0, 20e-6), (10.0, 20e-6)])
def test_many_shapes_over_the_whole_array(phase: float, delay_std: float) -> None:
    """Enough paths that nodes pay, in tiles of many modes; looked at where the rim and the middle are."""
    of = shaped(target_at(20.0, 300, 5, direct=False), 6, phase=phase, delay_std=delay_std, doppler=0.0)
    some = np.append(np.argsort(-np.linalg.norm(FACES.position, axis=1), kind="stable")[:2], 250)
    hears = hearing(of, SONAR, FACES, absorption, margin=4e-4)
    exact, _ = DirectSum().pressure(of, SNAPS, hears._replace(elements=FACES.select(some)))
    got = GriddedSynthesis().signals(of, SNAPS, hears).pressure
    assert error(got[some], exact) < 1e-4


def test_one_odd_path_among_many_is_not_lost() -> None:
    """Modes are chosen for the loudest path too, not for the mean alone: a phase of one path in a thousand is kept."""
    of = target_at(20.0, 1000, 7, direct=False)
    of = replace(of, phase=np.where(np.arange(1000) == 500, 0.02, 0.0), amplitude=np.full(1000, 1e-4))
    hears = hearing(of, SONAR, FACES, margin=4e-4)
    plain = replace(of, phase=np.zeros(1000))
    got, without = (GriddedSynthesis().pressure(x, SNAPS, hears)[0] for x in (of, plain))
    odd = of.select(np.array([500]))
    parts = (DirectSum().signals(x, SNAPS, hears).pressure for x in (odd, replace(odd, phase=np.zeros(1))))
    turned, straight = parts
    assert np.abs(turned - straight).max() > 0.015 * np.abs(straight).max()
    assert np.abs(got - without - (turned - straight)).max() < 1e-2 * np.abs(straight).max()


# ---- laws ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_half_turns_are_signs_and_nothing_is_nothing(method: DirectSum | GriddedSynthesis) -> None:
    array = some_of(FACES, 100)
    of = target_at(15.0, 12, 8, direct=False)
    hears = hearing(of, SHARP, array, margin=4e-4)
    turns = np.random.default_rng(9).integers(-9, 9, 12)
    half = replace(of, phase=np.pi * turns)
    signed = replace(of, amplitude=of.amplitude * (-1.0) ** turns)
    got, expected = (method.signals(x, SNAPS, hears).pressure for x in (half, signed))
    np.testing.assert_array_equal(got, expected)


@pytest.mark.parametrize("method", METHODS)
def test_a_turn_keeps_the_energy_and_turns_add_up(method: DirectSum | GriddedSynthesis) -> None:
    of = arrivals([0.05, 0.0501], [[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]], [10.0, 11.0], [1.0, 0.4])
    hears = hearing(of, SHARP, POINT, margin=0.002)

    def heard(*phase: float) -> Floats:
        turned = replace(of, phase=np.array(phase))
        return method.signals(turned, SNAPS, hears).pressure[0].astype(float)

    plain, quarter = heard(0.0, 0.0), heard(0.5 * np.pi, 0.5 * np.pi)
    for angle in (0.3, 1.0, 2.5):
        turned = heard(angle, angle)
        assert (turned**2).sum() == pytest.approx((plain**2).sum(), rel=1e-5)
        assert error(turned, np.cos(angle) * plain + np.sin(angle) * quarter) < 1e-6
        alike = heard(angle, angle + 1e-3)  # two modes, where they were of one shape
        assert error(alike, turned) < 1e-3
    assert error(heard(0.3, 0.3 + 2.0 * np.pi), heard(0.3, 0.3)) < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_blurs_add_by_squares_and_end_in_silence(method: DirectSum | GriddedSynthesis) -> None:
    of = arrivals([0.05, 0.0502], [[1.0, 0.0, 0.0], [1.0, 0.1, 0.0]], [10.0, 11.0], [1.0, 0.4])
    hears = hearing(of, SHARP, POINT, margin=0.002)

    def heard(*delay_std: float) -> Floats:
        soft = replace(of, delay_std=np.array(delay_std))
        got = method.signals(soft, SNAPS, hears)
        assert got.outside == 0
        return got.pressure[0].astype(float)

    plain, soft = heard(0.0, 0.0), heard(3e-6, 3e-6)
    f = np.fft.rfftfreq(hears.samples, 1.0 / SHARP.sampling_frequency)
    once = np.fft.irfft(np.fft.rfft(plain) * np.exp(-0.5 * (2 * np.pi * f * 3e-6) ** 2), hears.samples)
    twice = np.fft.irfft(np.fft.rfft(soft) * np.exp(-0.5 * (2 * np.pi * f * 4e-6) ** 2), hears.samples)
    assert error(soft, once) < 1e-6
    assert error(heard(5e-6, 5e-6), twice) < 1e-6
    silent = silencing_blur(waveform(MODEL), SHARP.antialias)
    assert not heard(1.01 * silent, 10.0 * silent).any()
    assert 0.0 < np.abs(heard(0.98 * silent, 0.98 * silent)).max() < 1e-6 * np.abs(plain).max()


def test_shared_shapes_cost_no_modes() -> None:
    """Where all paths have one shape, what is deposited is what plain pulses deposit: only their spectrum differs."""
    of = target_at(15.0, 6, 10, direct=False)
    hears = hearing(of, SHARP, POINT, margin=0.001)
    once = replace(of, phase=np.full(6, 0.8), delay_std=np.full(6, 4e-6), doppler=np.full(6, 2e-3))
    exact, _ = DirectSum().pressure(once, SNAPS, hears)
    got, _ = GriddedSynthesis(width=14, precision="float64", tolerance=1e-10).pressure(once, SNAPS, hears)
    assert error(got, exact) < 1e-8


# ---- the modes -------------------------------------------------------------------------------------------------------


def pulses(phase: Floats, delay_std: Floats, doppler: Floats, f: Floats, samples: int) -> Complexes:
    """The spectra (path, bin) that the definition gives."""
    rate, chosen = SHARP.sampling_frequency, SHARP.antialias
    S = [pulse_spectrum(waveform(MODEL), chosen, rate, samples, float(s))[1][: f.size] for s in doppler]
    return np.exp(1j * phase[:, None] - 0.5 * (2 * np.pi * np.multiply.outer(delay_std, f)) ** 2) * S


@pytest.mark.parametrize(("tolerance", "most"), [(1e-3, 10), (1e-6, 22)])
def test_modes_are_the_definition(tolerance: float, most: int) -> None:
    rng, samples, n = np.random.default_rng(11), 384, 60
    f, spectrum = pulse_spectrum(waveform(MODEL), SHARP.antialias, SHARP.sampling_frequency, samples)
    some = slice(40, 170)
    of = target_at(15.0, n, 12, direct=False)
    of = replace(
        of,
        amplitude=np.ones(n),
        phase=rng.uniform(-1.5, 1.5, n),
        delay_std=rng.uniform(0.0, 10e-6, n),
        doppler=rng.uniform(-1e-3, 1e-3, n),
    )
    series = stretched_spectra(waveform(MODEL), SHARP.antialias, SHARP.sampling_frequency, samples, 2.0**-9, 4)
    front = array_paths(of, SNAPS, POINT)
    front = replace(front, loss=front.loss - front.loss.mean())
    decay = absorption(f)
    modes = shape_modes(front, f[some], spectrum[some], decay[some], series[:, some], 2.0**-9, tolerance)
    exact = (pulses(of.phase, of.delay_std, of.doppler, f, samples) * np.exp(-np.multiply.outer(front.loss, decay)))[
        :, some
    ]
    apart = np.abs(modes.weight @ modes.spectrum - exact)
    assert apart.mean(axis=1).max() < 3.0 * tolerance * np.abs(exact).mean(axis=1).max()
    assert modes.weight.shape[1] <= most


def test_phases_alone_are_two_modes() -> None:
    f, spectrum = pulse_spectrum(waveform(MODEL), SHARP.antialias, SHARP.sampling_frequency, 384)
    of = shaped(target_at(15.0, 50, 13, direct=False), 14, delay_std=0.0, doppler=0.0)
    none, front = np.zeros((0, 130), complex), array_paths(of, SNAPS, POINT)
    modes = shape_modes(front, f[40:170], spectrum[40:170], np.zeros(130), none, 0.0, 1e-9)
    assert modes.weight.shape == (50, 2)


@pytest.mark.parametrize("widest", [1e-6, 1e-3, 0.1])
def test_a_series_in_doppler_is_the_stretched_snap(widest: float) -> None:
    rate, samples = SONAR.sampling_frequency, 384
    series = stretched_spectra(waveform(MODEL), SONAR.antialias, rate, samples, widest, 7)
    x = np.array([-1.0, 0.37, 1.0])
    got = np.cos(np.outer(np.arccos(x), np.arange(7))) @ series
    left = sum(stretch_sizes(waveform(MODEL), SONAR.antialias, widest)[7:])
    for row, at in zip(got, x, strict=True):
        _, exact = pulse_spectrum(waveform(MODEL), SONAR.antialias, rate, samples, float(widest * at))
        assert np.abs(row - exact).sum() < (2.0 * left + 1e-11) * np.abs(exact).sum()


@pytest.mark.parametrize(
    ("pulse", "widest", "samples"),
    [
        (Sweep(start=40e3, stop=80e3, duration=5e-3), 2.0**-5, 2048),
        *((Gabor(frequency=60e3 + off, cycles=1000.0), 2.0**-9, 16384) for off in (0.0, 200.0, 450.0)),
    ],
)
def test_the_series_of_a_long_pulse_has_as_many_degrees_as_it_takes(
    pulse: PulseModel, widest: float, samples: int
) -> None:
    """At 20 m/s, of a sweep of 5 ms: at 16, its echoes were up to 0.4 of their peak off, and up to 4 points each. Tones
    of 17 ms fall between frequencies 0.9 kHz apart: at those they had too few, or were refused."""
    long = waveform(pulse)
    sizes = np.array(stretch_sizes(long, SONAR.antialias, widest))
    count = int(np.flatnonzero(np.cumsum(sizes[::-1])[::-1] <= 1e-6)[0])
    series = stretched_spectra(long, SONAR.antialias, SONAR.sampling_frequency, samples, widest, count)
    _, exact = pulse_spectrum(long, SONAR.antialias, SONAR.sampling_frequency, samples, 0.8 * widest)
    got = np.cos(np.arccos(0.8) * np.arange(count)) @ series
    assert np.abs(got - exact).sum() < 1e-5 * np.abs(exact).sum()
    with pytest.raises(FieldError, match="pulses too long to be stretched"):
        stretch_sizes(waveform(Sweep(start=40e3, stop=80e3, duration=3e-3)), SONAR.antialias, 0.9)


def test_phases_fold_to_a_quarter_turn_either_side() -> None:
    phase = np.concatenate([np.linspace(-20.0, 20.0, 401), np.pi * np.arange(-5, 6), [1e6, -1e9]])
    sign, rest = folded(phase)
    apart = np.abs(sign * np.exp(1j * rest) - np.exp(1j * phase))
    assert (apart <= 4e-16 * (1.0 + np.abs(phase))).all()
    assert (np.abs(rest) <= 0.5 * np.pi).all()
    assert not rest[401:412].any()
