"""Levels of beams in impulsive noise: how surely each statistic tells a beam that is 3 dB brighter."""

from __future__ import annotations

from math import gamma, pi, sqrt

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.imaging import FocusedDelayAndSum, LpMean, OrderStatistic
from sonarsynth.imaging.lp import power_mean
from sonarsynth.products import Signals
from sonarsynth.receiver import BeamGrid, PlanarLattice, Sonar, elements

RATE = 196e3
ARRAY = PlanarLattice(columns=6, rows=5, pitch=0.02)
SONAR = Sonar(array=ARRAY, beams=BeamGrid(azimuths=9, elevations=7))
STUDY = {  # 600 samples: p = 0.5, log, median (a study of its own; alpha 2 is Gaussian)
    1.2: (3.85, 6.03, 6.23),
    1.5: (6.43, 6.95, 6.90),
    1.8: (8.41, 7.25, 7.04),
    2.0: (9.9, 7.6, 7.3),
}
TRIALS, SAMPLES = 4000, 600


def stable(alpha, shape, random):
    """Symmetric alpha-stable numbers. Source: Chambers, Mallows & Stuck (1976), J. Am. Stat. Assoc. 71, 340."""
    v, w = random.uniform(-0.5 * np.pi, 0.5 * np.pi, shape), random.exponential(size=shape)
    return np.sin(alpha * v) / np.cos(v) ** (1 / alpha) * (np.cos((1 - alpha) * v) / w) ** ((1 - alpha) / alpha)


def index(level):
    """Standard deviations of ln(level) in 3 dB: the scale of the noise changes its mean and nothing else."""
    return np.log(10.0**0.15) / np.std(np.log(level))


def moment(p, alpha):
    """E|y|^p of symmetric alpha-stable noise of unit scale, 0 < p < alpha; of alpha 2, Gaussian of variance 2, any."""
    gaussian = 2.0**p * gamma(0.5 * (1.0 + p)) / sqrt(pi)
    return gaussian if alpha == 2.0 else gaussian * gamma(1.0 - p / alpha) / gamma(1.0 - 0.5 * p)


def exact_index(alpha, p):
    """That of 3 dB by the mean of |y|^p of all samples, p under alpha/2; of ln |y| for p = 0. Source: Nikias & Shao
    (1995), Signal Processing with Alpha-Stable Distributions, ch. 2 and 5."""
    if p == 0.0:
        return 0.15 * np.log(10.0) * np.sqrt(SAMPLES / (np.pi**2 / 6.0 * (1.0 / alpha**2 + 0.5)))
    return p * 0.15 * np.log(10.0) * np.sqrt(SAMPLES / (moment(2.0 * p, alpha) / moment(p, alpha) ** 2 - 1.0))


@pytest.mark.parametrize("alpha", STUDY)
def test_a_beam_3_db_brighter_is_told_as_the_study_says(alpha):
    magnitude = np.abs(stable(alpha, (TRIALS, SAMPLES), np.random.default_rng(5)))
    half, log, median = (
        index(method.amplitude(magnitude)) for method in (LpMean(p=0.5), LpMean(p=0.0), OrderStatistic())
    )
    assert (half, log, median) == pytest.approx(STUDY[alpha], rel=0.03)
    assert log == pytest.approx(exact_index(alpha, 0.0), rel=0.03)
    # The mean of |y|^p is as its moments say where they exist well below alpha/2; from there on there is no index.
    p = 0.25 * alpha if alpha < 2.0 else 1.0
    assert index(power_mean(magnitude, p)) == pytest.approx(exact_index(alpha, p), rel=0.03)
    # ln of a mean of squares has the variance pi^2/6 (4/alpha^2 - 1), that of a positive stable number of alpha/2.
    energy = index(power_mean(magnitude[:, ::5], 2.0))
    if alpha < 2.0:
        assert energy == pytest.approx(0.15 * np.log(10.0) / np.pi * np.sqrt(6.0 / (1.0 / alpha**2 - 0.25)), rel=0.15)
    else:
        assert energy == pytest.approx(0.15 * np.log(10.0) * np.sqrt(2.0 * SAMPLES / 5), rel=0.03)


def test_small_powers_tend_to_the_logarithm_and_means_rise_with_the_power():
    magnitude = np.random.default_rng(1).exponential(size=(5, 100))
    log = power_mean(magnitude, 0.0)
    np.testing.assert_allclose(power_mean(magnitude, 1e-14), log, rtol=1e-10)
    np.testing.assert_allclose(power_mean(magnitude, 1.0), magnitude.mean(axis=1), rtol=1e-12)
    means = np.stack([power_mean(magnitude, p) for p in (0.0, 0.1, 0.5, 1.0, 2.0)])
    assert (np.diff(means, axis=0) > 0.0).all()
    assert not power_mean(np.array([0.0, 1.0]), 0.0) and power_mean(np.array([0.0, 1.0]), 0.5) == pytest.approx(0.25)


def bright_beam(impulses):
    """Band-limited Gaussian sound from one direction, and sound of few and very loud samples from another."""
    random, samples = np.random.default_rng(4), 1200
    f = np.fft.rfftfreq(samples, 1.0 / RATE)
    band = (f > 25e3) & (f < 85e3)
    light, snaps = random.normal(size=samples), np.zeros(samples)
    snaps[[300, 520, 800]] = impulses
    pressure = np.zeros((elements(ARRAY).count, samples))
    for wave, (row, column) in ((light, (2, 2)), (snaps, (5, 7))):
        u = direction(SONAR.beams.azimuth[column], SONAR.beams.elevation[row])
        delay = -elements(ARRAY).position @ u / SONAR.assumed_sound_speed
        pressure += np.fft.irfft(np.fft.rfft(wave) * band * np.exp(-2j * np.pi * f * delay[:, None]), samples)
    return Signals(pressure.astype(np.float32), 0.0, RATE, 0.0, 0, 0)


@pytest.mark.parametrize("method", [LpMean(focus=None), OrderStatistic(focus=None, window=5e-5)])
def test_what_shines_throughout_is_brighter_than_what_snaps(method):
    heard, window = bright_beam(impulses=30.0), (0.001, 0.0055)
    energy = FocusedDelayAndSum(focus=None).image(heard, elements(ARRAY), SONAR, *window).energy
    assert np.unravel_index(energy.argmax(), energy.shape) == (5, 7)
    level = method.image(heard, elements(ARRAY), SONAR, *window).energy
    assert np.unravel_index(level.argmax(), level.shape) == (2, 2)


@pytest.mark.parametrize("window", [None, 1e-4])
def test_p_of_two_is_delay_and_sum_with_samples_or_windows(window):
    heard = bright_beam(impulses=10.0)
    plain = FocusedDelayAndSum(focus=None).image(heard, elements(ARRAY), SONAR, 0.001, 0.0055).energy
    level = LpMean(focus=None, p=2.0, window=window).image(heard, elements(ARRAY), SONAR, 0.001, 0.0055).energy
    np.testing.assert_allclose(level, plain, rtol=0.05, atol=1e-3 * plain.max())
