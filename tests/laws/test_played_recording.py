"""A recording of the sea that is played: itself in the middle of the array, with the coherence of its directions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.signal import csd, resample, welch
from scipy.stats import kurtosis

import sonarsynth as ss
from sonarsynth.environment.noise.directions import OneDirection
from sonarsynth.pipeline.synthesis import digitise
from sonarsynth.products import Signals
from sonarsynth.signals.noise.played_noise import STRETCH, add_played_noise

FS, RATE, APART = 196e3, 245_000, 0.03
RECIPE = """
scene:
  world:
    environment:
      depth: 40 m
      sound_speed: {kind: isovelocity, speed: 1540}
      noise: {kind: recording, path: sea.wav, play: samples, directions: {kind: isotropic}}
  sonar:
    array: {kind: position_table, positions: [[0, 0, 0], [0, 0.03, 0], [0, 0, -0.5]], face: 0 m}
    beams: {azimuths: 3, elevations: 3}
  trajectory: {frames: 40, interval: 0.05 s, sonar: {kind: still, position: [0, 0, -20]}}
"""


def sea(seconds: float) -> np.ndarray:
    """Clicks in noise within the band of the sonar."""
    random = np.random.default_rng(3)
    spectrum = np.fft.rfft(0.1 * random.standard_normal(int(seconds * RATE)))
    frequency = np.fft.rfftfreq(int(seconds * RATE), 1 / RATE)
    made = np.fft.irfft(spectrum * ((frequency > 30e3) & (frequency < 80e3)), int(seconds * RATE))
    made[random.integers(0, made.size - 40, int(200 * seconds))] += 3.0
    return np.fft.irfft(np.fft.rfft(made) * ((frequency > 30e3) & (frequency < 80e3)), made.size)


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> ss.Plan:
    folder = tmp_path_factory.mktemp("sea")
    wavfile.write(folder / "sea.wav", RATE, sea(0.4).astype(np.float32))
    (folder / "recipe.yaml").write_text(RECIPE)
    return ss.plan(ss.load(folder / "recipe.yaml"), products=["signals"])


def heard(plan: ss.Plan, index: int, samples: int, start: float = 0.0) -> np.ndarray:
    """What the hydrophones (sensor, sample) hear of nothing but the recording."""
    silence = Signals(np.zeros((3, samples), np.float32), start, FS, 0.0, 0, 0)
    return digitise(plan, plan.recipe.frame(index)[1], silence).pressure


def test_the_middle_hears_the_recording_itself_again_and_again(plan: ss.Plan) -> None:
    """Within 1e-3 of it, resampled by another way: from its start at time 0, and after its end once more."""
    played = heard(plan, 0, int(0.4 * FS))[0]
    exact = resample(sea(0.4), int(0.4 * FS))
    assert np.linalg.norm(played - exact) < 1e-3 * np.linalg.norm(exact)
    later = heard(plan, 9, int(0.1 * FS))[0]  # at 0.45 s
    assert np.linalg.norm(later - exact[int(0.05 * FS) :][: later.size]) < 1e-3 * np.linalg.norm(later)


def test_windows_that_overlap_hear_the_same(plan: ss.Plan) -> None:
    """All hydrophones, whatever the frame and the length of the window."""
    one, other = heard(plan, 0, 20_000), heard(plan, 1, 6000)
    np.testing.assert_allclose(other, one[:, int(0.05 * FS) :][:, :6000], atol=2e-4 * np.abs(one).max())


def test_hydrophones_hear_one_spectrum_with_the_coherence_of_the_directions(plan: ss.Plan) -> None:
    """0.05 dB less off the middle; sin(kd)/(kd) between hydrophones within 4/sqrt(stretches); snaps are there."""
    seconds = 1.6
    got = heard(plan, 0, int(seconds * FS))
    f, power = welch(got, FS, nperseg=1024)
    some = (f > 32e3) & (f < 78e3)
    level = 10.0 * np.log10(power[:, some].sum(axis=1) / power[0, some].sum())
    np.testing.assert_allclose(level, [0.0, -0.05, -0.05], atol=0.1)
    crossed = csd(got[0], got[1], FS, nperseg=1024)[1][some] / np.sqrt(power[0] * power[1])[some]
    model = np.sinc(2.0 * f[some] * APART / 1540.0)
    assert abs(np.mean((crossed - model).real)) < 4.0 / np.sqrt(seconds / STRETCH)
    assert np.mean(crossed.real * np.sign(model)) > 0.5 * np.mean(np.abs(model))
    assert (kurtosis(got, axis=1) > 0.7 * kurtosis(sea(0.4))).all() and kurtosis(sea(0.4)) > 3.0


def test_a_wave_from_below_is_heard_first_below(plan: ss.Plan) -> None:
    """By the way down over the sound speed, and in the same form."""
    noise = replace(
        plan.scene.world.environment.noises[0], directions=OneDirection(bearing=0.0, elevation=-0.5 * np.pi)
    )
    silence = Signals(np.zeros((3, 20_000), np.float32), 0.0, FS, 0.0, 0, 0)
    here = plan.recipe.frame(0)[1].sonar_pose
    early = 64
    speed = 0.5 * FS / early
    got = add_played_noise(
        silence, noise, plan.scene.sonar, plan.elements, here, speed, time=0.0, even=lambda stretch: np.zeros(2)
    ).pressure
    assert np.corrcoef(got[0, early:], got[2, :-early])[0, 1] > 0.999
    assert abs(np.corrcoef(got[2, early:], got[0, :-early])[0, 1]) < 0.2
    np.testing.assert_allclose(got[1], got[0], atol=1e-4 * np.abs(got).max())


def test_samples_need_directions(tmp_path: Path) -> None:
    (tmp_path / "sea.wav").write_bytes(b"")
    (tmp_path / "recipe.yaml").write_text(RECIPE.replace(", directions: {kind: isotropic}", ""))
    with pytest.raises(ss.RecipeError, match="samples come from somewhere: give `directions`"):
        ss.load(tmp_path / "recipe.yaml")
