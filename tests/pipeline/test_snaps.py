"""Every model of a snap through a whole frame, from YAML to a store that verifies; and those that cannot be."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.random import default_rng

from sonarsynth import schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.description import FieldError
from sonarsynth.pictures.snap_pictures import snap as draw_snap
from sonarsynth.pipeline import render
from sonarsynth.planning import plan
from sonarsynth.recipe import Recipe, reading
from sonarsynth.store import verify

TEXT = """\
seed: 3
scene:
  world:
    environment: {depth: 10 m, sound_speed: {kind: isovelocity, speed: 1540}}
    targets:
      - name: ball
        shape: {kind: sphere, radius: 0.3, edge: 0.05}
        motion: {kind: line, start: [18, 3, -5], stop: [18, -3, -5], duration: 0.1}
    sources:
      - position: [14, -5]
        kind: snapping_shrimp
        snap: SNAP
        variation: {level: 2 dB, width: 0.05}
  sonar:
    array: {kind: planar_lattice, columns: 16, rows: 12, pitch: 5 cm}
    beams: {azimuths: 61, elevations: 21, elevation_span: 10 deg}
  trajectory: {frames: 2, interval: 0.1}
"""
SNAPS = {
    "logarithmic_bubble": "{kind: logarithmic_bubble}",
    "keller_miksis": "{kind: keller_miksis, gas_pressure: 3 kPa}",
    "recorded_snap": "{kind: recorded_snap, path: sounds/snap.csv, distance: 2 m}",
    "ricker": "{kind: ricker, frequency: 50 kHz, peak: 3 kPa}",
    "gabor": "{kind: gabor, frequency: 55 kHz, cycles: 3, peak: 3 kPa}",
}
EVERY = pytest.mark.parametrize("kind", SNAPS)


def recipe_with(folder: Path, snap: str, *, more: str = "") -> Recipe:
    (folder / "sounds").mkdir(parents=True, exist_ok=True)
    time = np.arange(-100, 200) / 500e3
    wave = 3e3 * np.exp(-np.maximum(time, 0.0) / 40e-6) * np.sin(2 * np.pi * 45e3 * np.maximum(time, 0.0))
    table = np.c_[1e6 * time, wave + 1e-3 * default_rng(1).standard_normal(300)]
    np.savetxt(folder / "sounds" / "snap.csv", table, delimiter=",", header="time (us),pressure (Pa)", comments="")
    (folder / "recipe.yaml").write_text(TEXT.replace("SNAP", snap) + more)
    return reading.load(folder / "recipe.yaml")


@EVERY
def test_a_dataset_with_each_model_verifies(tmp_path: Path, kind: str) -> None:
    """The image is brightest on the target, its ranges are right and the snap is where it is heard."""
    recipe = recipe_with(tmp_path, SNAPS[kind])
    assert recipe.scene.world.sources[0].snap.kind == kind
    assert reading.loads(reading.dump(recipe)) == recipe
    assert schedule.build(plan(recipe), tmp_path / "s.zarr", workers=0).ok
    report = verify(tmp_path / "s.zarr")
    assert report.ok, report


def test_a_frame_is_the_same_whatever_was_rendered_before(tmp_path: Path) -> None:
    recipe = recipe_with(tmp_path, SNAPS["keller_miksis"])
    made = plan(recipe)
    last = render(made, 1)
    first = render(made, 0)
    assert render(plan(recipe), 0).identical(first)
    assert render(plan(recipe), 1).identical(last)
    levels = [float(np.squeeze(tree["truth/emissions/level"].values)) for tree in (first, last)]
    assert levels[0] != levels[1]


def test_the_snap_of_a_model_is_drawn(tmp_path: Path) -> None:
    for kind in ("keller_miksis", "gabor"):  # made of a bubble, and none
        draw_snap(recipe_with(tmp_path, SNAPS[kind]), tmp_path / f"{kind}.png")
        assert (tmp_path / f"{kind}.png").read_bytes().startswith(b"\x89PNG")


def test_a_snap_is_compared_with_a_recording_and_what_is_none_gives_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from scipy.io import wavfile

    recipe_with(tmp_path, SNAPS["gabor"])
    rate, cut = 500_000, b"RIFF\x24\x00\x00\x00WAVEfmt "
    time = (np.arange(500) - 250) / rate
    width = 3 / 55e3 / (2 * np.sqrt(2 * np.log(2)))
    tone = np.exp(-0.5 * (time / width) ** 2) * np.cos(2 * np.pi * 55e3 * time)
    wavfile.write(tmp_path / "tone.wav", rate, (2**14 * tone).astype(np.int16))
    wavfile.write(tmp_path / "slow.wav", 8000, (2**14 * tone).astype(np.int16))
    wavfile.write(tmp_path / "silent.wav", rate, np.zeros(500, np.int16))
    wavfile.write(tmp_path / "nan.wav", rate, np.full(500, np.nan, np.float32))
    (tmp_path / "cut.wav").write_bytes(cut)
    (tmp_path / "empty.wav").write_bytes(b"")
    (tmp_path / "noise.wav").write_bytes(default_rng(0).bytes(3000))
    out = str(tmp_path / "compared.png")

    def compared(name: str) -> tuple[int, str]:
        arguments = ["snap", str(tmp_path / "recipe.yaml"), "--compare", str(tmp_path / name), "--out", out]
        status, texts = run(app, arguments), capfd.readouterr()
        return status, texts.out if status == 0 else texts.err

    status, said = compared("tone.wav")
    assert status == 0 and Path(out).read_bytes().startswith(b"\x89PNG")
    found = re.search(r"waveform (\S+) % .* spectrum (\S+) dB", said)
    assert found is not None and float(found[1]) < 5.0 and float(found[2]) < 0.5
    for name in ("slow.wav", "silent.wav", "nan.wav", "cut.wav", "empty.wav", "noise.wav", "absent.wav"):
        status, said = compared(name)
        assert status == 2 and said.count("\n") == 1 and name in said, said


@pytest.mark.long
def test_slow_tails_are_among_the_warnings(tmp_path: Path) -> None:
    low = "  physics: {tracing: {kind: straight, bounces: 1}}\n"
    text = "{kind: gabor, frequency: 50 kHz, cycles: 0.3}"
    recipe = recipe_with(tmp_path, text, more=low)
    sets = ("scene.sonar.filter={kind: low_pass, cutoff: 80 kHz}",)
    assert not any("falls off slowly" in note for note in plan(recipe).warnings)
    loud = reading.load(tmp_path / "recipe.yaml", sets)
    made = plan(loud)
    assert any("decays slowly: it is cut 0.02 s" in note for note in made.warnings)
    assert made.windows.echo_start < 3e-3  # the echoes, from 7 ms on, are heard in spite of the tail


WRONG = [
    (
        "{kind: keller_miksis, gas_pressure: 50}",
        r"12: scene\.world\.sources\.0\.snap: the wall reaches .* largest_mach",
    ),
    ("{kind: keller_miksis, gas_pressure: 0}", r"12: scene\.world\.sources\.0\.snap: "),
    ("{kind: keller_miksis, viscosity: 100}", r"12: scene\.world\.sources\.0\.snap: the bubble has no snap: .*settles"),
    ("{kind: keller_miksis, radius: 3 m}", r"12: scene\.world\.sources\.0\.snap: lasts"),
    ("{kind: recorded_snap, path: none.csv}", r"12: scene\.world\.sources\.0\.snap\.path: no such file: none\.csv"),
    ("{kind: recorded_snap, path: recipe.yaml}", r"12: scene\.world\.sources\.0\.snap: .*recipe\.yaml"),
    ("{kind: gabor, frequency: 500 kHz}", r"12: scene\.world\.sources\.0\.snap: is not heard"),
    ("{kind: gabor, frequency: 50 kHz, peak: 1e14}", r"12: scene\.world\.sources\.0\.snap: makes a source level of"),
    ("{kind: gabor, frequency: 50, cycles: 100}", r"12: scene\.world\.sources\.0\.snap: lasts .* a snap is over in"),
    ("{kind: richter, frequency: 50}", r"12: scene\.world\.sources\.0\.snap\.kind: 'richter' is not a kind.*'ricker'"),
]


@pytest.mark.parametrize(("snap", "message"), WRONG, ids=[s for s, _ in WRONG])
def test_snaps_that_cannot_be_are_refused_in_one_line(tmp_path: Path, snap: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:  # noqa: PT012
        recipe_with(tmp_path, snap)
        source = reading.read(tmp_path / "recipe.yaml")
        with reading.locating(source):
            plan(reading.recipe_of(source))
    assert isinstance(caught.value, (reading.RecipeError, FieldError))
    assert "\n" not in str(caught.value)
