"""Numbers that no machine can build and no sea has, and YAML that no recipe needs: refused before anything is taken."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from sonarsynth import cli, planning
from sonarsynth.cli import printing
from sonarsynth.cli.running import run
from sonarsynth.recipe import Recipe, reading
from sonarsynth.recipe.reading import RecipeError
from tests.waiting import HANGING

ROOT = Path(__file__).resolve().parents[2]
WATER = "scene.world.environment.sound_speed"
SPEED = "kind: isovelocity, speed: 1540"
SHAPE = "kind: box, size: [1, 1, 1], edge: 0.25"
SHRIMP = "position: [12, 8]"
RANGE = "path: scene.world.environment.depth, first: 11, last: 15"
BEAMS = "beams: {azimuths"
ABSURD = [
    ("frames: 20", "frames: 1e12", "16: scene.trajectory.frames: must be a valid integer"),
    ("frames: 20", "frames: 1000000000000", "16: scene.trajectory.frames: must be less than or equal to 10000000"),
    ("seed: 3", "seed: 3\nrepeats: 100000000", "3: repeats: must be less than or equal to 1000000"),
    ("seed: 3", "seed: 3\nrepeats: 1000000", "1: grid: spans 1000000 sequences: more than 10000000 frames"),
    ("seed: 3", f"seed: 3\ngrid: [{{{RANGE}, count: 1000000000}}]", "3: grid.0.count: must be less than or equal"),
    ("seed: 3", f"seed: 3\ngrid: [{{{RANGE}, step: 1e-12}}]", "3: grid.0: step 1e-12 does not lead from first to"),
    (
        "seed: 3",
        "seed: 3\ngrid: ["
        + ", ".join(
            f"{{path: scene.world.targets.0.motion.start.{i}, first: 5, last: 9, count: 99999}}" for i in range(3)
        )
        + "]",
        "3: grid: spans 9.9997e+14 sequences, more than 1000000",
    ),
    (BEAMS, f"sampling_frequency: 1e15\n    {BEAMS}", "sampling_frequency: must be less than or equal to 10000000"),
    ("columns: 5, rows: 4", "columns: 32000, rows: 32000", "14: scene.sonar.array.columns: must be less than or equal"),
    (
        "columns: 5, rows: 4",
        "columns: 4000, rows: 4000",
        "14: scene.sonar.array: has 16000000 places, more than 100000",
    ),
    ("pitch: 5 cm", "pitch: 1e-299", "14: scene.sonar.array.pitch: must be greater than or equal to 0.000000001"),
    (
        "kind: planar_lattice, columns: 5, rows: 4, pitch: 5 cm",
        "kind: position_table, positions: [[0, 0, 0], [0, 1e-299, 0], [0, 0, 1e-299]]",
        "14: scene.sonar.array: positions span 1e-299 m: they must be one place, or span 1e-09 m or more",
    ),
    (
        SHAPE,
        "kind: sphere, radius: 1e9",
        "8: scene.world.targets.0.shape.radius: must be less than or equal to 10000",
    ),
    (SHAPE, "kind: sphere, radius: 1e-300", "8: scene.world.targets.0.shape.radius: must be greater than or equal to"),
    (SHAPE, "kind: sphere, radius: 1, edge: 1e-5", "8: scene.world.targets.0.shape: edges of 1e-05 m would take more"),
    (
        SHRIMP,
        f"{SHRIMP}\n        snap_times: {list(range(501))}",
        "10: scene.world.sources: 501 snaps are more than 500",
    ),
    ("stop: [10, 1, -5], duration: 1", "stop: [10, 400, -5], duration: 1", "target 'box' moves at 400 m/s at frame 0"),
    ("stop: [10, 1, -5], duration: 1", "stop: [10, 1, -5], duration: 5e-300", "target 'box' moves at 2e+299 m/s"),
    (
        "kind: line, start: [10, 0, -5], stop: [10, 1, -5], duration: 1",
        "kind: circle, centre: [10, 0, -5], radius: 1e-3, speed: 1",
        "scene.world.targets.0.motion: target 'box' moves and turns at up to",
    ),
    (
        "frames: 20,",
        "sonar: {kind: line, start: [0, 0, -5], stop: [0, 999, -5], duration: 1}, frames: 20,",
        "16: scene.trajectory.sonar: the array moves at 999 m/s at frame 0, too fast for sound in water",
    ),
    (
        SPEED,
        "kind: tabulated, depth: [0, 1e-300, 12], speed: [1500, 1600, 1500]",
        f"5: {WATER}: changes by more than 1e+06 m/s per metre between 0 and 1e-300 m",
    ),
    (
        SPEED,
        "kind: tabulated, depth: [0, 12], speed: [1.5, 1.5]",
        f"5: {WATER}.speed.0: must be greater than or equal to",
    ),
    (
        SPEED,
        "kind: tabulated, depth: [-5, 1], speed: [1500, 1500]",
        f"5: {WATER}.depth.0: must be greater than or equal",
    ),
    (
        SPEED,
        "kind: tabulated, depth: [0, 12], speed: [4920, 4921]",
        f"5: {WATER}: is 4920 m/s at 0 m, outside 1000 to 2500 m/s: is it in feet per second?",
    ),
    (SPEED, "kind: tabulated, depth: [50], speed: [1500]", f"5: {WATER}: is given from 50 m down, below the bottom at"),
    ("kind: flat", "kind: [flat]", "5: scene.world.environment.noise"),
    ("title: small", "%YAML 1.1\n---\ntitle: small", "2: is not of YAML 1.2: leave out '%YAML'"),
    ("title: small", "title: &a small\nlicence: &a CC0-1.0", "2: the anchor 'a' is given twice"),
    ("title: small", 'title: "\\ud800"', "1: title: holds half a character"),
    ("title: small", '"\\ud800": small', "1: a key holds half a character"),
    ("seed: 3", "seed: !!bool maybe", "2: seed: must be true or false, not maybe"),
    ("seed: 3", "seed: 0x" + "f" * 5000, "2: seed: is not a whole number that can be used"),
    ("seed: 3", "seed: " + "9" * 41, "2: seed: is not a whole number that can be used"),
    ("seed: 3", "seed: [" + "1," * 60_000 + "1]", "2: holds more than 50000 keys and values"),
]


@pytest.mark.parametrize(("right", "wrong", "message"), ABSURD)
def test_it_is_refused_soon(
    small_file: Path, capfd: pytest.CaptureFixture[str], right: str, wrong: str, message: str
) -> None:
    text = small_file.read_text()
    assert right in text
    small_file.write_text(text.replace(right, wrong))
    before, memory = time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert run(cli.app, ["build", str(small_file), str(small_file.parent / "s.zarr"), "--workers", "0"]) == 2
    assert time.process_time() - before < 10.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - memory < 1 << 20  # KiB
    out, err = capfd.readouterr()
    assert out == "" and message in err
    assert all(line.startswith(f"sonarsynth: {small_file}:") for line in err.splitlines())
    assert os.listdir(small_file.parent) == [small_file.name]


@pytest.mark.parametrize(
    ("water", "known"),
    [("depth: [0, 5], speed: [1500, 1501]", "from 0 to 5 m"), ("depth: [3], speed: [1500]", "at 3 m")],
)
def test_water_that_is_not_known_to_the_bed_is_noted(small_text: str, water: str, known: str) -> None:
    text = small_text.replace(SPEED, f"kind: tabulated, {water}")
    made = planning.plan(reading.loads(text), choices=planning.Choices())
    assert any(
        f"the sound speed is given {known}" in note and "the water is 12 m deep" in note for note in made.warnings
    )
    whole = small_text.replace(SPEED, "kind: tabulated, depth: [0.1, 11], speed: [1500, 1501]")
    made = planning.plan(reading.loads(whole), choices=planning.Choices())
    assert not any("is given" in note for note in made.warnings)


def test_memory_that_is_not_there(small_file: Path) -> None:
    source = reading.read(small_file)
    with pytest.raises(RecipeError, match=r"small\.yaml: needs more memory than there is$"), reading.locating(source):
        raise MemoryError


def test_a_title_is_printed_as_it_is(small: Recipe, capsys: pytest.CaptureFixture[str]) -> None:
    made = planning.plan(reading.loads(reading.dump(small).replace("title: small", "title: 'a [/b] [bold]c'")),
                         choices=planning.Choices())  # fmt: skip
    numbers = dict.fromkeys(
        ("seconds", "frames", "workers", "core_seconds", "bytes", "file_bytes", "raw_bytes", "files"), 1
    )
    printing.plan_report(made, SimpleNamespace(**numbers, basis="nothing"))  # type: ignore[arg-type]
    assert "a [/b] [bold]c" in capsys.readouterr().out


def test_what_cannot_be_printed_is_shown_by_number(small_file: Path, capfd: pytest.CaptureFixture[str]) -> None:
    small_file.write_text(small_file.read_text().replace("seed: 3", '"s\\e[31m\\u202e": 3'))
    assert run(cli.app, ["plan", str(small_file)]) == 2
    err = capfd.readouterr().err
    assert err.rstrip("\n").isprintable() and "s\\x1b[31m\\x202e" in err


@pytest.mark.long
def test_a_few_random_changes(tmp_path: Path) -> None:
    """The command that makes a thousand of them, of recipes, meshes and other files (tools/faults); here a few."""
    command = [sys.executable, "-m", "fault_injection", "--fuzz", "6", "--meshes", "6", "--casts", "4", "--seed", "5"]
    environment = {
        **os.environ,
        "TMPDIR": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(ROOT / "tools"), str(ROOT)]),
    }
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=HANGING, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    assert (found["casts"]["cases"], found["casts"]["failures"]) == (4, [])
    for kind, count in (("fuzz", 6), ("meshes", 6)):
        assert (found[kind]["cases"], found[kind]["failures"]) == (count, [])
        assert found[kind]["accepted"] + found[kind]["refused_in_one_line"] == count
    both = [found["fuzz"], found["meshes"]]
    assert sum(one["accepted"] for one in both) and sum(one["refused_in_one_line"] for one in both) > 6
    assert os.listdir(tmp_path) == []
