"""Figures of a soundscape: what is measured of made sound is what its process has, and what the model says of it."""

from __future__ import annotations

from dataclasses import replace
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

import sonarsynth as ss
from sonarsynth.equations.noise.arrival_counts import APART, fano_factor, loud_arrivals, path_counts
from sonarsynth.equations.noise.plane_wave_spectra import cross_power
from sonarsynth.equations.noise.wave_directions import quadrature
from sonarsynth.evaluation.soundscape.made_sound import listening_plan, made_sound
from sonarsynth.evaluation.soundscape.measured import MeasuredFigures, measure
from sonarsynth.evaluation.soundscape.model import sound_model
from sonarsynth.evaluation.soundscape.predicted import predict
from sonarsynth.evaluation.soundscape.recorded_sound import SeaRecording, recorded_sound
from sonarsynth.evaluation.soundscape.sound import NothingHeard, Sound
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.pictures.soundscape_figures.soundscape_figure import _of_recording
from sonarsynth.pipeline.frame_chorus import frame_chorus
from sonarsynth.receiver import Sonar

RATE = 200_000
RECIPE = """
scene:
  world:
    environment:
      depth: 20 m
      sound_speed: {kind: isovelocity, speed: 1540}
      noise: NOISE
    chorus: CHORUS
  sonar:
    array: {kind: position_table, positions: [[0, 0, 0], [0, 2 cm, 0], [0, 0, 3 cm]], face: FACE}
    baffle: BAFFLE
    beams: {azimuths: 3, elevations: 3}
    electronics: {level: 20 dB}
  trajectory: {frames: 1, interval: 0.5 s, sonar: {kind: still, position: [0, 0, -10], heading: 90 deg}}
"""


def recipe(noise: str = "null", chorus: str = "null", face: str = "0", baffle: str = "0 dB") -> ss.Recipe:
    given = {"NOISE": noise, "CHORUS": chorus, "FACE": face, "BAFFLE": baffle}
    return ss.loads(reduce(lambda text, name: text.replace(name, given[name]), given, RECIPE))


def test_loud_arrivals_of_a_poisson_process_are_poisson() -> None:
    random = np.random.default_rng(1)
    wave = np.zeros(4_000_000)
    wave[np.sort(random.integers(0, wave.size, random.poisson(400)))] = -2.0
    first = loud_arrivals(wave, 1.0, RATE, apart=0.0)
    counts = np.bincount(first // 40_000, minlength=100)
    assert counts.sum() == np.count_nonzero(wave)
    assert abs(fano_factor(counts) - 1.0) < 5.0 * np.sqrt(2.0 / 99.0)
    assert np.isnan(fano_factor(np.zeros(5, int))) and len(loud_arrivals(wave, 3.0, RATE)) == 0
    ringing = np.tile([0.0, 2.0, 0.0], 30)
    assert len(loud_arrivals(ringing, 1.0, RATE)) == 1 and len(loud_arrivals(ringing, 1.0, RATE, apart=0.0)) == 30


def test_counts_of_snaps_with_several_paths_are_those_of_a_simulation() -> None:
    random = np.random.default_rng(2)
    gain, delay = -20.0 * random.random((4, 3)), 3.0 * APART * random.random((4, 3))
    weight = np.array([0.2, 0.5, 0.1, 0.2])
    (got,) = path_counts(gain, delay, weight, (100.0, 6.0), np.array([92.0]))
    place = random.choice(4, 100_000, p=weight)
    loud = 100.0 + 6.0 * random.standard_normal(place.size)[:, None] + gain[place] > 92.0
    late = np.sort(np.where(loud, delay[place], np.nan), axis=1)
    groups = loud.any(axis=1) + np.nansum(np.diff(late, axis=1) > APART, axis=1)
    assert got.rate == pytest.approx(groups.mean() * np.exp(-groups.mean() * APART), rel=0.01)
    assert got.fano == pytest.approx((groups**2).mean() / groups.mean(), rel=0.02)


def test_coherence_of_plane_waves_is_that_of_the_closed_forms() -> None:
    """Cron and Sherman (1962) at 25 kHz and 49.53 mm: isotropic noise, and surface dipoles across and up."""
    k, d = 2.0 * np.pi * 25e3 / 1540.0, 49.53e-3
    offset = np.array([[0.0, d, 0.0], [0.0, 0.0, d]])
    toward, weight = quadrature(np.ones_like, (-1.0, 1.0), 20.0)
    np.testing.assert_allclose(cross_power(toward, weight, offset, k), [-0.186631, -0.186631], atol=2e-6)
    toward, weight = quadrature(lambda v: v, (0.0, 1.0), 20.0)
    np.testing.assert_allclose(cross_power(toward, weight, offset, k), [-0.131810, -0.425515 - 0.205777j], atol=2e-6)


def recording(folder: Path, values: np.ndarray, pascals: float | None = 5.0) -> MeasuredFigures:
    wavfile.write(folder / "sea.wav", RATE, values.astype(np.float32))
    return measure(recorded_sound(SeaRecording(folder / "sea.wav", pascals), Sonar()))


def test_a_recording_of_gaussian_noise_has_its_figures(tmp_path: Path) -> None:
    got = recording(tmp_path, 0.1 * np.random.default_rng(3).standard_normal(200_000))
    exact = 10.0 * np.log10(2.0 * 0.5**2 / RATE)
    off, spread = got.figures.octaves - exact, got.spread.octaves
    assert np.abs(off).max() < 5.0 * spread.max() and spread.max() < 0.2
    assert got.figures.stable[0] > 1.9
    assert abs(got.figures.moments[1]) < 5.0 * got.spread.moments[1] + 0.02
    assert abs(got.figures.moments[0] - 10.0 * np.log10(0.5**2 * 60e3 / 100e3)) < 0.1
    assert got.figures.rates.sum() < 3.0 and not got.gaps.size and np.isnan(got.figures.fano[0])
    relative = recording(tmp_path, 0.1 * np.random.default_rng(3).standard_normal(200_000), None)
    np.testing.assert_allclose(got.figures.octaves - relative.figures.octaves, 20.0 * np.log10(5.0), atol=1e-4)
    assert any("relative" in note for note in relative.sound.notes)
    drawn = _of_recording(relative, got)  # in a picture: at the level of the sound
    assert drawn.zero + relative.figures.octaves.mean() == pytest.approx(120.0 + got.figures.octaves.mean())
    assert "shifted" in drawn.legend and _of_recording(got, got).zero == 120.0


def test_a_recording_of_poisson_clicks_has_their_rate(tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    values, rate, seconds = 1e-3 * random.standard_normal(6 * RATE), 20.0, 6.0
    values[random.integers(0, values.size, random.poisson(rate * seconds))] += 1.0
    got = recording(tmp_path, values)
    level = 20.0 * np.log10(5.0 * 0.6)  # 0.6 of a click passes the filter
    middle = int(np.argmin(np.abs(got.levels - (level - 10.0))))
    assert abs(got.figures.rates[middle] - rate) < 5.0 * np.sqrt(rate / seconds)
    assert 0.5 * np.sqrt(rate / seconds) < got.spread.rates[middle] < 2.0 * np.sqrt(rate / seconds)
    assert abs(got.figures.fano[0] - 1.0) < 5.0 * np.sqrt(2.0 / 59.0)
    assert got.gaps.mean() == pytest.approx(1.0 / rate, rel=0.4)
    assert got.figures.moments[1] > 30.0 and got.figures.stable[0] > 1.5


def test_noise_is_heard_as_its_model_says() -> None:
    """Levels and coherence of surface noise through faces, and of noise and electronics that are independent."""
    one = recipe("[{kind: flat, level: 60 dB, directions: {kind: surface}}, {kind: flat, level: 50 dB}]", face="2 cm")
    plan, first = listening_plan(one, 0.2), one.frame(0)[1]
    got = measure(made_sound(plan, first, 0.2))
    model = predict(sound_model(plan, first), got)
    assert set(model.parts) == {"noise flat 1", "noise flat 2", "electronics"}
    assert np.abs(got.figures.octaves - model.octaves).max() < 0.1 + 5.0 * got.spread.octaves.max()
    assert np.abs(got.figures.coherence - model.coherence).max() < 5.0 * got.spread.coherence.max()
    assert got.spread.coherence.max() < 0.15 and np.abs(model.coherence).max() > 0.2


def test_a_chorus_is_heard_as_its_model_says() -> None:
    one = recipe(chorus="{density: 0.02, deviation: 1 dB, reach: 80 m, images: 1}")
    plan, first = listening_plan(one, 0.4), one.frame(0)[1]
    sound = made_sound(plan, first, 0.4)
    got, model = measure(sound), sound_model(plan, first)
    said = predict(model, got)
    assert plan.chorus is not None and plan.distant_chorus is not None
    whole = plan.chorus.level - 10.0 * np.log10(1.0 - plan.distant_chorus.share)
    assert abs(said.root + 120.0 - whole) < 0.3  # by another integration
    assert abs(got.figures.moments[0] - said.root) < 0.3 + 4.0 * said.scatter
    assert said.rates is not None
    near = np.flatnonzero((said.rates * sound.seconds > 5.0) & (said.rates * APART < 0.1))
    expected = said.rates[near] * sound.seconds
    assert (
        len(near) and (np.abs(got.figures.rates[near] * sound.seconds - expected) < 5.0 * np.sqrt(2 * expected)).all()
    )
    assert sound.arrivals is not None and said.elevation is not None
    assert sound.arrivals.weight.sum() == pytest.approx(said.elevation.sum(), rel=0.25)
    assert model.chorus is not None
    edges, paths = np.array([-1.0, 1.0]), len(sound.arrivals.sine)
    every = float(model.chorus.counts(edges, sound.seconds, 0.0)[0])
    assert abs(paths - every) < 5.0 * np.sqrt(2.0 * every)


def test_a_baffle_weakens_what_comes_from_behind_in_the_model_as_in_the_sea() -> None:
    one = recipe(chorus="{density: 0.02, deviation: 1 dB, reach: 80 m, images: 1}", baffle="12 dB")
    plan, first = listening_plan(one, 0.8), one.frame(0)[1]
    tilted = replace(first, sonar_pose=Pose(first.sonar_pose.position, quaternion(0.7, np.deg2rad(30.0))))
    paths, blocks = [], 20
    for number in range(blocks):
        frame = replace(tilted, step=number, moment=replace(first.moment, time=0.1 * number))
        arrivals = frame_chorus(plan, frame)
        assert arrivals is not None
        paths.append(arrivals.select((arrivals.delay >= 0.0) & (arrivals.delay < 0.1)))
    model = sound_model(plan, tilted).chorus
    assert model is not None
    energy = sum(float((some.gain**2 * 10.0 ** (-some.absorption / 10.0)).sum()) for some in paths)
    edges = np.array([-1.0, 1.0])
    assert energy == pytest.approx(float(model.energies(edges, 0.1 * blocks)[0]), rel=0.2)
    level = float(np.median(np.concatenate([some.received for some in paths])))
    often = float(model.counts(edges, 0.1 * blocks, level)[0])
    count = sum(np.count_nonzero(some.received > level) for some in paths)
    assert abs(count - often) < 5.0 * np.sqrt(2.0 * often)
    sine, around = np.linspace(-0.99, 0.99, 30)[:, None], np.linspace(0.0, 2.0 * np.pi, 2001)[:-1]
    flat = np.sqrt(1.0 - sine**2)
    toward = np.stack(np.broadcast_arrays(flat * np.cos(around), flat * np.sin(around), sine), axis=-1)
    exact = (tilted.sonar_pose.turn_to_body(toward)[..., 0] >= 0.0).mean(axis=1)
    np.testing.assert_allclose(model.in_front(sine[:, 0]), exact, atol=2e-3)
    assert 0.0 < exact[5] < exact[20] < 1.0


def test_no_sound_is_refused() -> None:
    with pytest.raises(NothingHeard, match="samples, more than"):
        listening_plan(recipe("{kind: flat, level: 60 dB}"), 1e4)
    with pytest.raises(NothingHeard, match="neither"):
        listening_plan(recipe())
    silent = Sound(np.zeros((10, 1, 100), np.float32), 196e3, np.zeros((1, 3)), True, (25e3, 85e3))
    with pytest.raises(NothingHeard, match="silent"):
        measure(silent)
