"""Exports that end half way: what is there passes for an export only where all of it is there."""

from __future__ import annotations

import os
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import sonarsynth as ss
from sonarsynth import planning, schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.detection import from_rows
from sonarsynth.export import FORMATS, coco_files, sonar_netcdf, write_bellhop, write_points
from sonarsynth.frontiers import AccuracyReport, Point, frontier_report
from sonarsynth.pictures.figures.style import figure, save
from sonarsynth.pictures.film import write_film
from sonarsynth.recipe import reading

BELOW = """\
seed: 1
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1540}}
    targets: []
    sources: [{kind: snapping_shrimp, position: [0 m, 0 m]}]
  sonar: {array: {kind: planar_lattice, columns: 2, rows: 2, pitch: 5 cm}}
  trajectory: {frames: 2, interval: 1 s, sonar: {kind: course, start: [-1 m, 0 m, -6 m], heading: 90 deg, speed: 1 m/s}}
"""
"""A sonar that is straight above its source in its second frame."""


@pytest.fixture(scope="module")
def store(small_text: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two frames of a box before 20 hydrophones."""
    path = tmp_path_factory.mktemp("cut") / "s.zarr"
    plan = planning.plan(reading.loads(small_text), {"signals", "image", "cloud"})
    assert schedule.build(plan, path, frames=[2, 3], workers=0).ok
    return path


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("ending", FORMATS)
def test_a_file_of_points_is_all_there_or_as_it_was(ending: str, tmp_path: Path) -> None:
    """On a full disk a PLY of a third of its points was said to be written; the last byte counts as well."""
    rows = np.random.default_rng(1).normal(size=(2000, 3))
    names = {"energy", "snr", "range_error", "frame", "target", "family"}
    columns = {name: ("point", np.abs(rows[:, 0])) for name in names}
    cloud = xr.Dataset({"position": (("point", "xyz"), rows), "normal": (("point", "xyz"), rows), **columns})
    file = tmp_path / f"a.{ending}"
    write_points(cloud, file)  # all that it imports is compiled: Python's files of that would be cut as well
    whole = file.stat().st_size
    file.write_text("an earlier export")
    for size in (20_000, whole - 1):
        with files_of_at_most(size), pytest.raises(OSError) as raised:
            write_points(cloud, file)
        assert raised.value.filename == str(file)
        assert file.read_text() == "an earlier export" and list(tmp_path.iterdir()) == [file]


def test_a_file_that_a_command_writes_is_all_there_or_as_it_was(
    store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On a full disk a table and a list of detections were cut, and the line did not name the file."""
    commands = {
        "d.json": ["detect", str(store), "--out"],
        "t/target_strength.csv": ["target-strength", "{kind: sphere, radius: 0.25 m}", "--out"],
    }
    for name, command in commands.items():
        file = tmp_path / name
        place = str(file.parent if "/" in name else file)
        assert run(app, [*command, place]) == 0  # all that it imports is compiled
        whole = file.read_bytes()
        capsys.readouterr()
        with files_of_at_most(len(whole) - 1):
            assert run(app, [*command, place]) == 1
        assert capsys.readouterr().err == f"sonarsynth: {file}: File too large\n"
        assert file.read_bytes() == whole and {one.name for one in file.parent.iterdir()} >= {file.name}
        assert not list(file.parent.glob("*.partial")) + list(file.parent.glob(".*"))


def test_a_film_and_a_picture_are_all_there_or_as_they_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")  # no ffmpeg
    drawn = figure(2, 2, dpi=50)
    for write in (
        lambda: write_film(drawn, lambda text: drawn.suptitle(text), "ab", tmp_path, 5.0),
        lambda: save(drawn, tmp_path / "picture"),
    ):
        file = write()
        whole = file.read_bytes()
        with files_of_at_most(len(whole) - 1), pytest.raises(OSError) as raised:
            write()
        assert raised.value.filename == str(file) and file.read_bytes() == whole


@pytest.mark.parametrize("what", ["bellhop", "frontiers", "coco"])
def test_what_is_written_over_an_earlier_export_is_all_there_or_as_it_was(
    store: Path, tmp_path: Path, what: str
) -> None:
    """From Python, into a folder that has files: an environment, a table of reflection, rows or a picture was cut."""
    table = "{kind: table, grazing: [0 deg, 90 deg], modulus: [1, 1], phase: [180 deg, 180 deg]}"
    below = BELOW.replace("{depth: 12 m", f"{{surface: {{reflection: {table}}}, depth: 12 m")
    points = [Point("synthesis", "knob", str(n), 1e-3 * n, "1", 1.0, 1.0 / n, chosen=n == 2) for n in (1, 2, 3)]
    report = AccuracyReport("a recipe", (0,), 4, tuple(points), ())
    write = {
        "bellhop": lambda: write_bellhop(planning.plan(reading.loads(below)), 0, tmp_path, "below")[0],
        "frontiers": lambda: frontier_report.write(report, tmp_path),
        "coco": lambda: coco_files.write_coco(ss.open(store), tmp_path, np.array([2, 3])),
    }[what]
    files = write()
    assert len(files) > (what != "coco")
    whole = {file: file.read_bytes() for file in files}
    for cut in files:
        for file in files:
            file.write_bytes(whole[file] + b" ")  # an earlier one, which is not what is written now
        with files_of_at_most(len(whole[cut]) - 1), pytest.raises(OSError):
            write()
        assert all(file.read_bytes().rstrip(b" ") == whole[file].rstrip(b" ") for file in files)


def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reading_end = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    from_rows([{"frame": 1, "score": 0.5, "azimuth": 0.0, "elevation": 0.0}]).write(pipe)
    assert pipe.is_fifo() and b'"image_id": 1' in os.read(reading_end, 1000)
    os.close(reading_end)


@pytest.mark.parametrize(("to", "module"), [("coco", coco_files), ("sonar-netcdf", sonar_netcdf)])
def test_an_export_that_is_killed_leaves_no_file_in_its_folder(
    store: Path, tmp_path: Path, to: str, module: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sequences that were written before a kill were a folder like any other."""
    name = "write_coco" if to == "coco" else "write_sonar_netcdf"
    write, out = getattr(module, name), tmp_path / "out"

    def killed_last(*given: Any) -> None:
        write(*given)
        os._exit(9)

    if (child := os.fork()) == 0:
        monkeypatch.setattr(module, name, killed_last)
        run(app, ["export", str(store), "--to", to, "--out", str(out)])
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 9
    assert [file.name for file in out.iterdir()] == [".partial"]
    shutil.rmtree(out)
    assert run(app, ["export", str(store), "--to", to, "--out", str(out)]) == 0
    assert ".partial" not in [file.name for file in out.iterdir()]


@pytest.mark.parametrize("there", [True, False])
def test_netcdf_is_not_begun_on_a_disk_that_is_too_small(
    store: Path, tmp_path: Path, there: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """HDF5 ended the process by a segmentation fault."""
    out = tmp_path / "out"
    if there:
        out.mkdir()
    assert run(app, ["export", str(store), "--to", "sonar-netcdf", "--out", str(tmp_path / "all")]) == 0
    size = sum(file.stat().st_size for file in (tmp_path / "all").iterdir())
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=size))
    capsys.readouterr()
    assert run(app, ["export", str(store), "--to", "sonar-netcdf", "--out", str(out)]) == 1
    assert "are free" in capsys.readouterr().err
    assert out.exists() == there and not list(tmp_path.glob("out/*"))


@pytest.mark.parametrize("to", ["coco", "sonar-netcdf"])
def test_a_full_disk_is_said_with_the_name_of_the_folder(
    store: Path, tmp_path: Path, to: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a quota too, where HDF5 ended the process with a signal."""
    with files_of_at_most(40):
        assert run(app, ["export", str(store), "--to", to, "--out", str(tmp_path / "out")]) == 1
    assert f"{tmp_path}/out: File too large" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_environments_of_frames_before_one_that_has_none_are_not_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recipe = tmp_path / "below.yaml"
    recipe.write_text(BELOW)
    out = tmp_path / "out"
    assert run(app, ["export", str(recipe), "--to", "bellhop", "--frames", "0:2", "--out", str(out)]) == 2
    assert "snap 0 is straight above or below the array" in capsys.readouterr().err
    assert not out.exists()
    assert run(app, ["export", str(recipe), "--to", "bellhop", "--frames", "0", "--out", str(out)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [str(file) for file in out.iterdir()] == [line for line in said if not line.startswith("note")]
