"""A chorus obeys the laws of its process, and is heard as the sum of its snaps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import kstest

from sonarsynth.environment.absorption import absorption_db_per_m
from sonarsynth.environment.sea import Absorption
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.noise.chorus_moments import (
    PulsePower,
    effective_duration,
    excess_kurtosis,
    level_moment,
    power_spectrum,
    ring_moments,
)
from sonarsynth.randomness import number, uniforms
from sonarsynth.receiver import Band, PlanarLattice, Sonar, elements
from sonarsynth.signals.chorus.chorus_arrivals import ChorusArrivals, no_chorus
from sonarsynth.signals.chorus.chorus_synthesis import chorus_pressure
from sonarsynth.signals.filtered_pulse import pulse_spectrum
from sonarsynth.sources.chorus import Chorus, Clusters, ListeningWindow, draw_snaps
from sonarsynth.sources.snap_pulses import waveform

SPEED = 1540.0
SONAR = Sonar(
    array=PlanarLattice(columns=4, rows=4, pitch=0.3, face=0.05),
    band=Band(low=25e3, high=85e3),
    sampling_frequency=196e3,
    assumed_sound_speed=SPEED,
)


def absorption(frequency: np.ndarray) -> np.ndarray:
    """dB/m: about that of the sea."""
    return 2e-2 * (np.asarray(frequency) / 50e3) ** 1.5


def arrivals(place: np.ndarray, time: np.ndarray, **more: np.ndarray) -> ChorusArrivals:
    """Snaps of 185 dB at places (snap, xyz) of the sonar frame, sounding at times (snap,) s, each by one path."""
    length, count = np.linalg.norm(place, axis=1), len(place)
    none, zero = np.zeros(count), np.zeros(count, int)
    found = ChorusArrivals(
        delay=time + length / SPEED,
        direction=place / length[:, None],
        length=length,
        gain=1.0 / length,
        phase=none,
        delay_std=none,
        level=np.full(count, 185.0),
        width=zero,
        snap=np.arange(count),
        boundaries=zero,
        absorption=none,
        key=np.zeros((count, 5), int),
        sound_speed=SPEED,
    )
    return replace(found, **more)


def summed(found: ChorusArrivals, chorus: Chorus, sonar: Sonar, samples: int, some: list[int]) -> np.ndarray:
    """The same brute force from 4 ms on, in float64: every snap at some sensors, each frequency, from where it is."""
    array, rate, padded, start = elements(sonar.array), sonar.sampling_frequency, 16384, 4e-3
    out = np.zeros((len(some), samples))
    for n, length in enumerate(found.length):
        snap = waveform(chorus.snap, float(chorus.widths[found.width[n]]))
        f, spectrum = pulse_spectrum(snap, sonar.antialias, rate, padded)
        level = 1e-6 * 10.0 ** (found.level[n] / 20.0) / chorus.snap.pulse(0.0, 0.0).peak
        soft = np.exp(1j * found.phase[n] - 0.5 * (2.0 * np.pi * f * found.delay_std[n]) ** 2)
        for s, q in enumerate(array.position[some]):
            away = found.direction[n] * length - q
            r = np.linalg.norm(away)
            loss = 10.0 ** (-absorption(f) * r / 20.0) * element_directivity(f, away / r, array.face, SPEED)
            late = found.delay[n] + (r - length) / SPEED - start + 2048 / rate
            wave = spectrum * soft * loss * np.exp(-2j * np.pi * f * late) * level * found.gain[n] * length / r
            out[s] += (np.fft.irfft(wave, padded) * rate)[2048 : 2048 + samples]
    return out


@pytest.mark.parametrize(
    ("low", "high", "rate"), [(25e3, 85e3, 196e3), (25e3, 85e3, 400e3), (2e3, 85e3, 196e3), (15e3, 20e3, 96e3)]
)
def test_pressure_is_the_sum_of_the_snaps(low: float, high: float, rate: float) -> None:
    """Also on a fast grid, where the gentle filter has room, and with low frequencies, which last ten times as long:
    in a narrow band from 15 kHz on they were refused, when the frame was made."""
    sonar = replace(SONAR, band=Band(low=low, high=high), sampling_frequency=rate)
    random, chorus, samples = np.random.default_rng(3), Chorus(width=0.1), round(1e-2 * rate)
    place = random.standard_normal((6, 3)) * np.geomspace(1.5, 400.0, 6)[:, None]
    time = 5e-3 + 8e-3 * random.random(6) - np.linalg.norm(place, axis=1) / SPEED
    more = {
        "width": 7 * random.integers(0, 2, 6),
        "phase": np.where(random.random(6) < 0.5, 0.0, 1.0),
        "delay_std": np.where(random.random(6) < 0.5, 0.0, 2e-6),
    }
    every, some = arrivals(place, time, **more), [0, 6, 15]

    def errors(found: ChorusArrivals) -> np.ndarray:
        made = chorus_pressure(
            found, chorus.snap, chorus.widths, elements(sonar.array), sonar, absorption, 4e-3, samples
        )
        exact = summed(found, chorus, sonar, samples, some)
        wrong = made[some] - exact
        return np.array([np.abs(wrong).max() / np.abs(exact).max(), np.sqrt(np.mean(wrong**2) / np.mean(exact**2))])

    for n in range(6):  # each by itself, so that a loud one hides no other
        assert errors(every.select(np.array([n])))[0] < 0.02, n
    assert errors(every)[1] < 5e-3


def heard_by(
    density: float, start: float, stop: float, seed: int = 5, **more: object
) -> tuple[Chorus, ListeningWindow]:
    """A chorus, and who hears all of it that sounds on a disc of 50 m, at once."""
    return Chorus(density=density, **more), ListeningWindow(np.zeros(2), start, stop, 50.0, 0.0, 1e9, 1e9)


def counts(windows: int, length: float, **more: object) -> np.ndarray:
    """Snaps in so many windows of a length (s) one after another."""
    return np.array([
        len(draw_snaps(*_draw(heard_by(1e-2, k * length, (k + 1) * length, **more))).time) for k in range(windows)
    ])  # fmt: skip


def _draw(who: tuple[Chorus, ListeningWindow]) -> tuple[Chorus, int, ListeningWindow]:
    return who[0], number(1, "chorus", 0), who[1]


def test_numbers_of_cells_are_even_and_independent() -> None:
    u = uniforms(number(3, "chorus", 1), 1, np.arange(20000)[:, None], np.arange(8))
    five = 5.0 / np.sqrt(u.size)
    assert abs(u.mean() - 0.5) < five * np.sqrt(1 / 12) and abs(12 * u.var() - 1) < five * np.sqrt(0.8)
    for a, b in ((u[1:], u[:-1]), (u[:, 1:], u[:, :-1])):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < five
    assert (uniforms(7, [1, 2], 3) == [uniforms(7, 1, 3), uniforms(7, 2, 3)]).all()


def test_snaps_are_poisson() -> None:
    found = counts(600, 0.2)
    mean = 1e-2 * np.pi * 50.0**2 * 0.2
    assert abs(found.mean() - mean) < 5 * np.sqrt(mean / 600)
    assert abs(found.var(ddof=1) / found.mean() - 1.0) < 5 * np.sqrt(2 / 599)  # Fano factor
    snaps = draw_snaps(*_draw(heard_by(1e-2, 0.0, 30.0)))
    gaps = np.diff(np.sort(snaps.time)) * 1e-2 * np.pi * 50.0**2
    assert kstest(gaps, "expon").pvalue > 1e-3
    assert kstest((np.hypot(*snaps.position.T) / 50.0) ** 2, "uniform").pvalue > 1e-3
    assert kstest((snaps.level - 185.0) / 5.0, "norm").pvalue > 1e-3


def test_clusters_have_their_fano_factor() -> None:
    clusters = Clusters(snaps=3.0, radius=2.0, duration=0.1)
    found = counts(200, 2.0, clusters=clusters)
    mean = 1e-2 * np.pi * 50.0**2 * 2.0
    assert abs(found.mean() - mean) < 5 * np.sqrt(4 * mean / 200)
    assert abs(found.var(ddof=1) / found.mean() - 4.0) < 5 * 4.0 * np.sqrt(2 / 199) + 0.2  # the ends of windows


@pytest.mark.parametrize("clusters", [None, Clusters()])
def test_windows_that_overlap_hear_the_same_snaps(clusters: Clusters | None) -> None:
    chorus, seed = Chorus(density=3e-2, clusters=clusters), number(2, "chorus", 0)
    one, other, whole = (
        draw_snaps(chorus, seed, ListeningWindow(np.array(place), *span, 80.0, 40.0, 1500.0, 1550.0))
        for place, span in (((0.0, 0.0), (1.0, 1.1)), ((30.0, -20.0), (1.05, 1.2)), ((0.0, 0.0), (0.5, 2.0)))
    )
    for part, against in ((one, whole), (one, other)):
        index = {tuple(row): n for n, row in enumerate(against.key.tolist())}
        both = [(n, index[row]) for n, row in enumerate(map(tuple, part.key.tolist())) if row in index]
        assert len(both) > 20 and (against is other or len(both) == len(part.key))
        a, b = (one.select(np.array(n)) for one, n in zip((part, against), zip(*both, strict=True), strict=True))
        for name in ("position", "time", "level", "width", "sign"):
            assert (getattr(a, name) == getattr(b, name)).all(), name


def test_levels_and_widths_change_no_place() -> None:
    _, who = heard_by(1e-2, 0.0, 1.0)
    seed = number(1, "chorus", 0)
    plain, other = (
        draw_snaps(Chorus(density=1e-2, **more), seed, who) for more in ({}, {"level": 170.0, "width": 0.3})
    )
    assert (plain.position == other.position).all() and (plain.time == other.time).all()
    assert np.allclose(plain.level - other.level, 15.0)


def sea(frequency: np.ndarray) -> np.ndarray:
    """Absorption (Np/m of power) of sea water of 27 degC."""
    absorbed = absorption_db_per_m(Absorption(), frequency, 5.0)
    return np.asarray(absorbed * np.log(10.0) / 10.0)


def pulse(frequency: np.ndarray, duration: float = 14.5e-6) -> PulsePower:
    """The snap of the thesis at 1 Pa peak."""
    model = Chorus().snap
    made = model.pulse(0.0, 1.2 * float(frequency[-1]))
    power = np.abs(pulses.spectrum(frequency, made)) ** 2 / made.peak**2
    return PulsePower(frequency, power, sea(frequency), duration)


def test_level_of_the_chorus_is_that_of_a_sum_over_snaps_in_the_sea() -> None:
    """Levels (dB re 1 uPa2/Hz), direct paths only, of lambda 1e-4, 185 +- 5 dB, 5 m over the bottom: an independent
    integration."""
    f = np.array([20e3, 50e3, 100e3])
    snap = pulse(f)
    total = sum(
        ring_moments(a, 2 * a, np.array([5.0]), lambda rho, r: np.ones(r.shape), snap).spectrum
        for a in 1e-2 * 2.0 ** np.arange(22)
    )
    level = 120.0 + 10.0 * np.log10(power_spectrum(1e-4, level_moment(185.0, 5.0, 2), np.asarray(total), snap.power))
    assert np.abs(level - [64.6, 56.5, 47.5]).max() < 0.3


def test_kurtosis_of_far_snaps_is_that_of_another_integration() -> None:
    """Excess kurtosis of all snaps beyond R, one image, 25 to 85 kHz, 185 +- 5 dB."""
    rate = SONAR.sampling_frequency
    f, spectrum = pulse_spectrum(waveform(Chorus().snap), SONAR.antialias, rate, 1 << 12)
    some = slice(1, None)
    lasts = effective_duration(np.fft.irfft(spectrum, 1 << 12), 1.0 / rate)
    assert lasts == pytest.approx(14.5e-6, rel=0.05)
    snap = PulsePower(f[some], np.abs(spectrum[some]) ** 2, sea(f[some]), lasts)
    for density, near, expected in ((1e-2, 50.0, 118.0), (1e-2, 150.0, 24.5), (3e-2, 150.0, 8.2)):
        edges = near * 2.0 ** np.arange(9)
        rings = [ring_moments(a, b, np.zeros(1), lambda rho, r: np.ones(r.shape), snap) for a, b in pairwise(edges)]
        square, fourth = sum(r.square for r in rings), sum(r.fourth for r in rings)
        found = excess_kurtosis(density, 5.0, square, fourth)
        assert expected < found < 1.4 * expected  # pulses that absorption makes longer are taken for short


def test_level_moments_are_those_of_a_normal_law() -> None:
    random = np.random.default_rng(1)
    amplitude = 1e-6 * 10.0 ** ((185.0 + 2.0 * random.standard_normal(400_000)) / 20.0)
    for power in (2, 4):
        assert np.mean(amplitude**power) == pytest.approx(level_moment(185.0, 2.0, power), rel=0.02)


def test_spectrum_and_kurtosis_are_those_of_the_moments() -> None:
    """Campbell's theorem against the pressure of snaps as it is made, at points: mean power to 0.3 dB, and kurtosis."""
    chorus = Chorus(density=0.6, deviation=2.0, width=0.0)
    sonar = replace(SONAR, array=PlanarLattice(columns=3, rows=3, pitch=20.0, face=0.0))
    array, random, depth = elements(sonar.array), np.random.default_rng(5), 5.0
    low, high, seconds, rate = 20.0, 80.0, 1.0, sonar.sampling_frequency
    count = random.poisson(chorus.rate * np.pi * (high**2 - low**2) * seconds)
    away, angle = np.sqrt(low**2 + (high**2 - low**2) * random.random(count)), 2 * np.pi * random.random(count)
    place = np.column_stack([away * np.cos(angle), away * np.sin(angle), np.full(count, -depth)])
    found = arrivals(place, seconds * random.random(count) - np.linalg.norm(place, axis=1) / SPEED)
    found = replace(found, level=185.0 + 2.0 * random.standard_normal(count))
    centre = replace(array, position=array.position[4:5], gain=array.gain[4:5])
    samples = int(seconds * rate)
    heard = chorus_pressure(found, chorus.snap, chorus.widths, centre, sonar, absorption, 0.0, samples)[0]
    f, spectrum = pulse_spectrum(waveform(chorus.snap), sonar.antialias, rate, 1 << 14)
    some = (f > 20e3) & (f < 90e3)
    peak = chorus.snap.pulse(0.0, 0.0).peak
    lasts = effective_duration(np.fft.irfft(spectrum, 1 << 14), 1.0 / rate)
    absorbed = absorption(f[some]) * np.log(10.0) / 10.0
    snap = PulsePower(f[some], np.abs(spectrum[some]) ** 2 / peak**2, absorbed, lasts)
    ring = ring_moments(low, high, np.array([depth]), lambda rho, r: np.ones(r.shape), snap)
    square = chorus.rate * level_moment(185.0, 2.0, 2) * ring.square
    assert abs(10.0 * np.log10(np.mean(heard.astype(float) ** 2) / square)) < 0.3
    density = power_spectrum(chorus.rate, level_moment(185.0, 2.0, 2), ring.spectrum, snap.power)
    power = 2.0 * np.abs(np.fft.rfft(heard)) ** 2 / (rate * samples)
    at = np.fft.rfftfreq(samples, 1.0 / rate)
    for a, b in ((30e3, 45e3), (45e3, 60e3), (60e3, 80e3)):
        measured = power[(at > a) & (at < b)].mean()
        predicted = density[(snap.frequency > a) & (snap.frequency < b)].mean()
        assert abs(10.0 * np.log10(measured / predicted)) < 0.3
    excess = np.mean(heard.astype(float) ** 4) / np.mean(heard.astype(float) ** 2) ** 2 - 3.0
    bound = excess_kurtosis(chorus.rate, 2.0, ring.square, ring.fourth)
    assert bound / 1.7 < excess < 1.1 * bound  # absorption makes pulses longer: it is a bound


def test_a_snap_at_a_hydrophone_is_as_loud_as_at_its_bubble() -> None:
    array = elements(SONAR.array)
    found = arrivals(array.position[:1] + [0.0, 0.0, 1e-5], np.array([5e-3]))
    made = chorus_pressure(found, Chorus().snap, np.ones(8), array, SONAR, absorption, 4e-3, 600)
    assert np.isfinite(made).all()
    assert np.abs(made).max() <= 1e-6 * 10.0 ** (185.0 / 20.0) / 3.5e-3


def test_no_snap_changes_no_pressure() -> None:
    made = chorus_pressure(no_chorus(), Chorus().snap, np.ones(8), elements(SONAR.array), SONAR, absorption, 0.0, 300)
    assert made.shape == (16, 300) and not made.any()
