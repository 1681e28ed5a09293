"""The command `soundscape`: of recipes, stores and recordings, and what cannot be measured."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import wavfile

from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation.soundscape.sound import NothingHeard
from sonarsynth.evaluation.soundscape.stored_sound import stored_sound
from sonarsynth.pictures.soundscape_figures import soundscape_pictures
from sonarsynth.planning import plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import build
from sonarsynth.store import open_store

TEXT = """
scene:
  world:
    environment:
      depth: 10 m
      sound_speed: {kind: isovelocity, speed: 1540}
      noise: {kind: flat, level: 60 dB}
    targets:
      - {name: ball, shape: {kind: sphere, radius: 0.3, edge: 0.2}, motion: {kind: still, position: [18, 0, -5]}}
    sources: [{kind: snapping_shrimp, position: [14, -5]}]
    chorus: {density: 0.01, reach: 50 m, images: 1, width: 0, snap: SNAP}
  sonar:
    array: {kind: planar_lattice, columns: 3, rows: 3, pitch: 5 cm, face: 0, DEAD}
    beams: {azimuths: 5, elevations: 5}
    converter: {bits: 16, full_scale: 200 Pa}
  trajectory: {frames: 2, interval: 0.1}
"""


SHIP = "scene.world.noise_sources=[{name: ship, motion: {kind: still, position: [9, 0, -3]}, sound: {kind: thermal}}]"


def recipe_in(folder: Path, dead: str = "dead: [4]") -> Path:
    (folder / "sea.yaml").write_text(
        TEXT.replace("DEAD", dead).replace("SNAP", "{kind: ricker, frequency: 50 kHz, peak: 3 kPa}")
    )
    return folder / "sea.yaml"


def said(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = run(app, ["soundscape", *map(str, arguments)])
    out, err = capsys.readouterr()
    return status, out, err


def test_a_recipe_and_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sea, file, picture = recipe_in(tmp_path), tmp_path / "sea.h5", tmp_path / "out" / "sea.png"
    with h5py.File(file, "w") as made:
        made["other"] = np.zeros(9)
        made["pressure"] = np.random.default_rng(1).standard_normal(40_000) * 3000 / 32768
    of = ("--dataset", "pressure", "--sampling-frequency", 96_000, "--sensitivity", -180)
    status, out, _ = said(
        capsys, sea, "--seconds", 0.1, "--out", picture, "--compare", file, *of, "--set", SHIP, "--json"
    )
    found = json.loads(out)
    assert status == 0 and picture.stat().st_size > 20_000
    assert "NaN" not in out and found["hydrophones"] == 8  # one is dead
    assert set(found["spectrum"]["parts_db"]) == {"noise flat", "chorus", "distant chorus", "rounding"}
    recorded = found["recording"]
    assert any("48 kHz" in note for note in recorded["notes"])
    passed = 10.0 * np.log10((48.0 - 25.0) / 48.0)  # of white noise
    exact = 20.0 * np.log10(3000 / 32768) + 180.0 + passed
    assert recorded["amplitude"]["rms_db"] == pytest.approx(exact, abs=0.3)


def test_a_store(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = reading.load(recipe_in(tmp_path))
    assert build(plan(recipe, ["signals"]), tmp_path / "s.zarr", workers=0).ok
    monkeypatch.setattr(soundscape_pictures, "draw_soundscape", lambda found, out: out)  # one picture is drawn above
    status, out, _ = said(capsys, tmp_path / "s.zarr", "--out", tmp_path / "s.png", "--json")
    found = json.loads(out)
    assert status == 0 and any("before the listed snaps" in note for note in found["notes"])
    assert found["loud_arrivals"]["fano_factor"] is None and found["elevation"]["of"].startswith("paths over")
    assert found["seconds"] < 0.01
    tree = open_store(tmp_path / "s.zarr").copy()
    peak = 120.0 + 20.0 * np.log10(float(np.abs(tree["signals/pressure"]).max()))
    assert found["amplitude"]["level_db"][-1] < peak - 6.0  # the direct pulse and its echoes are left out
    tree["signals/pressure"] = tree["signals/pressure"].astype(float).where(tree["signals/pressure"].frame < 1)
    with pytest.raises(NothingHeard, match="not finite"):
        stored_sound(tree, recipe)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (["scene.world.chorus=null", "scene.world.environment.noise=null"], "neither scene.world.chorus nor"),
        (["scene.world.chorus=null", "scene.world.environment.noise=null", SHIP], "neither scene.world.chorus nor"),
        (["scene.sonar.array.dead=[0, 1, 2, 3, 4, 5, 6, 7, 8]"], "every hydrophone is dead"),
    ],
)
def test_a_recipe_without_sound_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], settings: list[str], line: str
) -> None:
    status, _, err = said(capsys, recipe_in(tmp_path), *(part for one in settings for part in ("--set", one)))
    assert status == 2 and line in err and err.count("\n") == 1


@pytest.mark.parametrize(
    ("values", "line"),
    [
        (np.zeros(40_000, np.int16), "is silent"),
        (np.zeros(0, np.int16), "holds no samples"),
        (np.ones(100, np.int16), "has 100 samples, too few"),
        (np.full(40_000, np.nan, np.float32), "not finite"),
    ],
)
def test_a_recording_without_sound_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], values: np.ndarray, line: str
) -> None:
    wavfile.write(tmp_path / "sea.wav", 196_000, values)
    status, _, err = said(capsys, recipe_in(tmp_path), "--compare", tmp_path / "sea.wav")
    assert status == 2 and line in err and err.count("\n") == 1


@pytest.mark.parametrize(
    "options",
    [
        ("--full-scale", "1"),
        ("--dataset", "a"),
        ("--compare", "sea.wav", "--full-scale", "1", "--sensitivity", "2"),
        ("--seconds", "0"),
    ],
)
def test_options_that_do_not_go_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...]
) -> None:
    status, _, err = said(capsys, recipe_in(tmp_path), *options)
    assert status == 2 and err.count("\n") == 1
    assert said(capsys, tmp_path / "none.yaml")[0] == 2 and said(capsys, tmp_path / "none.zarr")[0] == 2
