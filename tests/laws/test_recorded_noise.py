"""Noise of the spectrum of a recording: its level, its file, and recordings that cannot be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.signal import welch

import sonarsynth as ss
from sonarsynth.environment.noise import recorded_noise
from sonarsynth.equations.noise.filters import response
from sonarsynth.pipeline.synthesis import digitise
from sonarsynth.products import Signals
from sonarsynth.receiver import BandPass
from sonarsynth.signals.filtered_pulse import fir

FS = 196e3
RECIPE = """
scene:
  world:
    environment:
      depth: 40 m
      sound_speed: {kind: isovelocity, speed: 1540}
      noise: {kind: recording, path: sea.wav, pascals: 4MORE}
  sonar: {array: {kind: position_table, positions: [[0, 0, 0], [0, 0.2, 0]]}, beams: {azimuths: 3, elevations: 3}}
  trajectory: {frames: 1, interval: 0.5 s, sonar: {kind: still, position: [0, 0, -20]}}
"""


def recipe(folder: Path, more: str = "") -> ss.Recipe:
    (folder / "recipe.yaml").write_text(RECIPE.replace("MORE", more))
    return ss.load(folder / "recipe.yaml")


def recorded(folder: Path, rate: int = 250_000) -> None:
    """A WAV of white noise of 0.1 in each sample."""
    wavfile.write(folder / "sea.wav", rate, (0.1 * np.random.default_rng(1).standard_normal(60_000)).astype(np.float32))


def test_noise_of_a_recording_has_its_spectrum(tmp_path: Path) -> None:
    recorded(tmp_path)
    plan = ss.plan(recipe(tmp_path), products=["signals"])
    frame = plan.recipe.frame(0)[1]
    got = digitise(plan, frame, Signals(np.zeros((2, 60_000), np.float32), 0.0, FS, 0.0, 0, 0)).pressure
    f, density = welch(got, FS, nperseg=2048)
    passed = response(f, fir(BandPass(low=25e3, high=85e3))) ** 2
    some = (f > 30e3) & (f < 80e3)
    exact = 2.0 * 0.4**2 / 250e3 * passed  # 0.1 of 4 Pa, over half the sampling frequency
    assert abs(10.0 * np.log10(density[:, some].mean() / exact[some].mean())) < 0.1
    assert abs(np.corrcoef(got)[0, 1]) < 0.02
    together = ss.plan(recipe(tmp_path, ", directions: {kind: bottom}"), products=["signals"])
    assert "bottom" in str(together)


def test_the_file_decides_the_digest_and_must_be_there(tmp_path: Path) -> None:
    with pytest.raises(ss.RecipeError, match=r"noise.path: no such file"):
        recipe(tmp_path)
    recorded(tmp_path)
    one = recipe(tmp_path).digest
    wavfile.write(tmp_path / "sea.wav", 250_000, np.ones(9000, np.float32))
    assert recipe(tmp_path).digest != one


@pytest.mark.parametrize(
    ("rate", "samples", "said"),
    [
        (250_000, np.zeros(9000, np.int16), "is silent"),
        (250_000, np.full(9000, 1e200), "louder than numbers can say"),
        (250_000, np.ones(40, np.int16), "has 40 samples"),
        (96_000, np.arange(9000, dtype=np.int16), "holds nothing of the middle of the band"),
    ],
)
def test_recordings_that_cannot_be_are_refused(tmp_path: Path, rate: int, samples: np.ndarray, said: str) -> None:
    wavfile.write(tmp_path / "sea.wav", rate, samples)
    with pytest.raises(ss.FieldError, match=said):
        ss.plan(recipe(tmp_path))
    (tmp_path / "sea.wav").write_bytes(b"RIFF no sound")
    with pytest.raises(ss.FieldError, match="cannot be read as WAV"):
        ss.plan(recipe(tmp_path))


def test_a_long_recording_is_of_its_beginning_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorded_noise, "LONGEST", 20_000)
    values = np.random.default_rng(1).standard_normal(60_000).astype(np.float32)
    values[20_000:] *= 100.0
    wavfile.write(tmp_path / "sea.wav", 250_000, values)
    noise = ss.plan(recipe(tmp_path)).scene.world.environment.noises[0]
    assert noise.validity(25e3, 85e3) == (f"of the recording {noise.path} the spectrum of the first 0.08 s is used",)
    mean = noise.density(np.linspace(25e3, 85e3, 200)).mean()
    assert mean == pytest.approx(2.0 * 4.0**2 / 250e3, rel=0.1)


@pytest.mark.parametrize(
    ("kind", "file", "said"),
    [
        ("recording", "low.wav", "holds nothing of the middle of the band"),
        ("recording", "broken.wav", "cannot be read as WAV"),
        ("noise_recording", "broken.wav", "cannot be read as WAV"),
    ],
)
def test_recordings_of_sources_of_noise_are_refused_too(tmp_path: Path, kind: str, file: str, said: str) -> None:
    wavfile.write(tmp_path / "low.wav", 96_000, np.arange(9000, dtype=np.int16))
    (tmp_path / "broken.wav").write_bytes(b"RIFF no sound")
    one = f"{{name: a, motion: {{kind: still, position: [9, 0, -9]}}, sound: {{kind: {kind}, path: {file}}}}}"
    text = RECIPE.replace("noise: {kind: recording, path: sea.wav, pascals: 4MORE}", "noise: null")
    (tmp_path / "recipe.yaml").write_text(
        text.replace("  sonar: {array", f"    noise_sources: [{one}]\n  sonar: {{array")
    )
    with pytest.raises(ss.FieldError, match=rf"scene.world.noise_sources.0.sound: .*{said}"):
        ss.plan(ss.load(tmp_path / "recipe.yaml"))
