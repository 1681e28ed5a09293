"""What a chorus brings from beyond its reach is what its snaps there would: level, spectrum, directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.noise.chorus_moments import level_moment
from sonarsynth.equations.noise.filters import response
from sonarsynth.planning import Plan, plan
from sonarsynth.planning.measured.chorus_reach import band_frequencies, snap_power
from sonarsynth.products import Signals
from sonarsynth.recipe import reading
from sonarsynth.signals import add_noise
from sonarsynth.signals.filtered_pulse import fir

SEA = """\
scene:
  world:
    environment: {depth: 15 m, sound_speed: {kind: isovelocity, speed: 1540 m/s}}
    sources: [{kind: snapping_shrimp, position: [6, 5]}]
    chorus: {density: 0.01, deviation: 2 dB, width: 0, reach: 150 m, images: 1}
  sonar:
    array: {kind: position_table, face: 0 m, positions: [[0, 0, 0], [0, 20, 0], [0, 0, 3], [0, -20, 3]]}
    beams: {azimuths: 3, elevations: 3}
  trajectory: {sonar: {kind: still, position: [0, 0, -5], heading: 90 deg}}
"""
HEIGHTS = np.array([10.0, 20.0])  # m: straight from the bottom, and by the surface


@pytest.fixture(scope="module")
def made() -> Plan:
    return plan(reading.loads(SEA), ("signals",))


def density(made: Plan, frequency: float, reach: float, farthest: float = 3e4) -> float:
    """One-sided density (Pa2/Hz) of the snaps from a reach (m) on: Campbell's theorem as it is written."""
    chorus = made.scene.world.chorus
    assert chorus is not None
    pulse = chorus.snap.at_depth(15.0).pulse(0.0, 2e5)
    lost = float(made.absorption(frequency)) * np.log(10.0) / 10.0

    def ring(log: float) -> float:
        length = np.hypot(np.exp(log), HEIGHTS)
        return float(2.0 * np.pi * np.exp(2.0 * log) * np.sum(np.exp(-lost * length) / length**2))

    integral = quad(ring, np.log(reach), np.log(farthest), limit=400)[0]
    wide = (pulses.scaled(pulse, 1.0, width) for width in chorus.widths)
    power = np.mean([np.abs(pulses.spectrum(np.array([frequency]), snap)[0]) ** 2 for snap in wide]) / pulse.peak**2
    return float(2.0 * chorus.rate * level_moment(chorus.level, chorus.deviation, 2) * power * integral)


@pytest.mark.parametrize("width", [0.0, 0.5])
def test_level_within_the_reach_is_campbells(made: Plan, width: float) -> None:
    chorus = replace(made.scene.world.chorus, width=width)
    other = plan(replace(made.recipe, scene=with_chorus(made, chorus)), ("signals",))
    band, within = made.scene.sonar.band, other.chorus
    assert within is not None
    grid = np.linspace(band.low, band.high, 101)
    passed = response(grid, fir(made.scene.sonar.antialias)) ** 2
    expected = np.trapezoid([density(other, f, 1e-2, 150.0) for f in grid] * passed, grid)
    assert within.level == pytest.approx(120.0 + 10.0 * np.log10(expected), abs=0.05)


def test_spectrum_is_campbells(made: Plan) -> None:
    distant = made.distant_chorus
    assert distant is not None
    for frequency in (5e3, 25e3, 40e3, 60e3, 85e3):
        found, expected = float(distant.density(np.array([frequency]))[0]), density(made, frequency, 150.0)
        assert abs(10.0 * np.log10(found / expected)) < 0.05, frequency


def test_what_is_drawn_has_that_level(made: Plan) -> None:
    """Mean periodograms of thirds of the band, and the power of the whole, to 0.3 dB."""
    distant, sonar, samples = made.distant_chorus, made.scene.sonar, 20_000
    assert distant is not None
    silence = Signals(np.zeros((4, samples), np.float32), 0.0, sonar.sampling_frequency, 0.0, 0, 0)
    pose = made.recipe.frame(0)[1].sonar_pose
    drawn = add_noise(silence, distant, sonar, made.elements, np.random.default_rng(1), pose, 1540.0).pressure
    at = np.fft.rfftfreq(samples, 1.0 / sonar.sampling_frequency)
    power = np.mean(2.0 * np.abs(np.fft.rfft(drawn)) ** 2, axis=0) / (sonar.sampling_frequency * samples)
    for low, high in ((28e3, 40e3), (40e3, 55e3), (55e3, 80e3)):
        grid = np.linspace(low, high, 25)
        expected = np.mean([density(made, f, 150.0) for f in grid])
        measured = power[(at >= low) & (at <= high)].mean()
        assert abs(10.0 * np.log10(measured / expected)) < 0.3
    grid = np.linspace(20e3, 90e3, 141)
    passed = response(grid, fir(sonar.antialias)) ** 2
    expected = np.trapezoid([density(made, f, 150.0) for f in grid] * passed, grid)
    assert abs(10.0 * np.log10(np.mean(drawn.astype(float) ** 2) / expected)) < 0.3


def test_the_whole_chorus_is_as_loud_whatever_its_reach(made: Plan) -> None:
    """Snaps one by one within, Gaussian beyond: together Campbell's mean square, 10 m to 1 km."""
    total = []
    for reach in (10.0, 150.0, 1000.0):
        chorus = replace(made.scene.world.chorus, reach=reach)
        other = plan(replace(made.recipe, scene=with_chorus(made, chorus)), ("signals",))
        distant, within = other.distant_chorus, other.chorus
        assert distant is not None and within is not None
        assert abs(10.0 * np.log10(distant.share) - within.beyond) < 0.1
        total.append(within.level - 10.0 * np.log10(1.0 - distant.share))
    assert np.ptp(total) < 0.05
    left_out = replace(made.scene.world.chorus, distant=False)
    assert plan(replace(made.recipe, scene=with_chorus(made, left_out)), ("signals",)).distant_chorus is None


@pytest.mark.parametrize("density", [1e-5, 1e-3, 3e-2])
def test_snaps_are_told_apart_as_far_as_they_matter(made: Plan, density: float) -> None:
    """Under 2 % of the power is from beyond the reach, or that is 3 km."""
    chorus = replace(made.scene.world.chorus, density=density, reach="auto")
    within = plan(replace(made.recipe, scene=with_chorus(made, chorus)), ("signals",)).chorus
    assert within is not None
    assert within.beyond < 10.0 * np.log10(0.02) or within.reach == 3000.0


def with_chorus(made: Plan, chorus: object) -> object:
    return replace(made.scene, world=replace(made.scene.world, chorus=chorus))


def test_it_comes_from_where_the_snaps_are(made: Plan) -> None:
    """Coherence of hydrophones over one another, by the energy of the band, against that of snaps from 150 m on."""
    distant, chorus = made.distant_chorus, made.scene.world.chorus
    assert distant is not None and chorus is not None
    lost = made.absorption(band_frequencies(made.scene.sonar))
    pulse = snap_power(chorus.snap.at_depth(15.0), chorus.widths, made.scene.sonar, lost)
    log = np.linspace(np.log(150.0), np.log(3e4), 20_001)
    length = np.hypot(np.exp(log)[:, None], HEIGHTS)
    left = np.exp(-length[..., None] * pulse.absorbed) @ pulse.power
    energy = np.exp(2.0 * log)[:, None] * left / length**2  # of equal steps of log(distance)
    sine = HEIGHTS / length * [-1.0, 1.0]
    edges = np.array(distant.directions.edges)
    brought = np.array(distant.directions.powers) * np.diff(edges)
    assert brought[edges[1:] <= 0.0].sum() > 0.5 * brought.sum()  # straight ones come from below, and are nearer
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    for phase in (1.0, 10.0, 30.0, 100.0):
        expected = np.sum(energy * np.exp(1j * phase * sine)) / energy.sum()
        found = np.sum(brought * np.exp(1j * phase * middle) * np.sinc(phase * half / np.pi)) / brought.sum()
        assert abs(found - expected) < 0.015, phase
