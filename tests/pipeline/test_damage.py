"""Whatever is changed in a store is found."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from sonarsynth import store
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.evaluation import Check
from sonarsynth.pipeline import Values
from sonarsynth.planning import Plan
from sonarsynth.schedule.repairing import repair
from sonarsynth.store.checking.reading_back import described
from sonarsynth.store.frame_reading import FrameReader


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, small_plan: Plan, made_up: Callable[[Plan, int], Values]) -> Path:
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    store.create(path, small_plan)
    for shard, frames in store.missing(path, small_plan, range(13)).items():
        store.write_shard(path, small_plan, shard, {frame: made_up(small_plan, frame) for frame in frames})
    return path


def found(path: Path) -> dict[str, str]:
    report = store.verify(path)
    assert report.ok is (not report.problems)
    return {problem.where: problem.what for problem in report.problems}


def flip(file: Path, bit: int) -> None:
    content = bytearray(file.read_bytes())
    content[bit // 8] ^= 1 << bit % 8
    file.write_bytes(content)


def test_a_whole_store_has_no_problem(whole: Path) -> None:
    report = store.verify(whole)
    assert report.ok
    assert report.complete == tuple(range(13))
    assert report.frames == 20
    assert report.bytes == sum(f.stat().st_size for f in whole.rglob("*") if f.is_file() and ".marks" not in f.parts)
    json.dumps(report.as_json(), allow_nan=False)


def test_a_flipped_bit_is_found_wherever_it_is(copy: Path) -> None:
    random = np.random.default_rng(1)
    files = sorted(f for f in copy.rglob("*") if f.is_file())
    chosen = [
        f
        for name in ("zarr.json", "signals/pressure/c.1.0.0", "time/c.0", "truth/beams/azimuth/c.0", ".marks/0.json")
        if (f := copy / name).exists()
    ]
    chosen += [files[i] for i in random.choice(len(files), 10, replace=False)]
    for file in chosen:
        bit = int(random.integers(8 * file.stat().st_size))
        flip(file, bit)
        assert found(copy), f"bit {bit} of {file.relative_to(copy)}"
        flip(file, bit)
    assert not found(copy)


DAMAGES: list[list[tuple[Callable[[Path], object], str, str]]] = [
    [
        (lambda p: (p / "image/energy/c.0.0.0").unlink(), "image/energy/c.0.0.0", "missing"),
        (lambda p: (p / "image/start/c.0").write_bytes(b""), "image/start/c.0", "has 0 bytes"),
        (lambda p: flip(p / "image/stop/c.0", 99), "image/stop/c.0", "changed"),
        (lambda p: (p / "image/azimuth/zarr.json").unlink(), "image/azimuth/zarr.json", "missing"),
        (lambda p: (p / "targets/box/faces/c.0.0").unlink(), "targets/box/faces/c.0.0", "missing"),
        (lambda p: (p / ".marks/1.json").unlink(), "shard 1", "without a completion mark"),
        (lambda p: shutil.copy(p / ".marks/0.json", p / ".marks/2.json"), ".marks/2.json", "damaged"),
        (lambda p: (p / ".marks/layout.copy.json").unlink(), ".marks/layout.copy.json", "missing"),
        (lambda p: (p / ".marks/x").write_text("hello"), ".marks/x", "does not belong"),
        (lambda p: (p / ".marks/00.json").write_text("hello"), ".marks/00.json", "does not belong"),
        (lambda p: (p / "notes.txt").write_text("hello"), "notes.txt", "does not belong"),
        (lambda p: (p / "image/x").symlink_to("/"), "image/x", "does not belong"),
        (lambda p: (p / "two\nlines").write_text("hello"), "two\\nlines", "does not belong"),
        (lambda p: shutil.copy(p / "cloud/x/c.0.0", p / "cloud/x/c.7.0"), "shard 7", "without a completion mark"),
    ],
    [
        (lambda p: (p / ".marks/layout.json").unlink(), ".marks/layout.json", "missing"),
        (lambda p: (p / ".marks/0.json").write_text("{}"), ".marks/0.json", "damaged"),
    ],
    [
        (lambda p: ((p / "zarr.json").unlink(), os.mkfifo(p / "zarr.json")), "zarr.json", "no plain file"),
        (lambda p: append(p / ".marks/0.json", b"\n"), ".marks/0.json", "damaged"),
    ],
]
"""What is done to a store at once, where that is said, and as what."""


def append(file: Path, more: bytes) -> None:
    file.write_bytes(file.read_bytes() + more)


@pytest.mark.parametrize("damages", DAMAGES)
def test_each_damage_is_named(copy: Path, damages: list[tuple[Callable[[Path], object], str, str]]) -> None:
    for damage, _, _ in damages:
        damage(copy)
    named = found(copy)
    for _, where, what in damages:
        assert what in named.get(where, f"{where} is not among {named}")


def test_values_that_are_not_finite_are_found(
    tmp_path: Path, small_plan: Plan, made_up: Callable[[Plan, int], Values]
) -> None:
    path = tmp_path / "s.zarr"
    store.create(path, small_plan)
    values = {frame: made_up(small_plan, frame) for frame in range(8)}
    values[3]["/signals", "pressure"][2, 5] = np.nan
    values[4]["/cloud", "x"][25] = np.nan
    values[5]["/cloud", "x"][25] = np.inf
    store.write_shard(path, small_plan, 0, values)
    assert found(path) == {
        "signals/pressure, frame 3": "1 values are not finite",
        "cloud/x, frame 5": "1 values are not finite",
    }


def test_checks_of_what_a_store_says_are_run_and_count(whole: Path) -> None:
    def frames(tree: xr.DataTree) -> list[Check]:
        count = tree.sizes["frame"]
        return [Check("frames", "20", str(count), count == 20, {"frames": count}), Check("none", "", "", None, {})]

    def fails(tree: xr.DataTree) -> list[Check]:
        return [Check("always", "yes", "no", False, {})]

    assert store.verify(whole, [frames]).ok
    report = store.verify(whole, [frames, fails])
    assert not report.ok
    assert [row["ok"] for row in report.as_json()["checks"]] == [True, None, False]


def test_no_store_at_all(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("hello")
    for name, message in (
        ("none", "no such store"),
        ("empty", "is not a store of sonarsynth"),
        ("file", "it is not a folder"),
    ):
        with pytest.raises(store.Mismatch, match=message):
            store.verify(tmp_path / name)


def test_frames_that_a_damage_spoils_are_named(copy: Path) -> None:
    (copy / "image/energy/c.1.0.0").unlink()
    (copy / "truth/zarr.json").unlink()
    answer = store.verify(copy).as_json()
    assert answer["frames"] == 20
    assert answer["frames_whole"] == "0:8"
    damage = ["image/energy/c.1.0.0: the file is missing"]
    assert answer["frame_report"] == [{"frame": f, "damage": damage, "checks": []} for f in range(8, 13)]
    assert [p["frames"] for p in answer["problems"]] == ["", "8:13"]
    (copy / ".marks/1.json").write_text("{}")
    assert store.verify(copy).as_json()["frames_whole"] == "0:8"


def test_frames_that_a_check_fails_in_are_named(whole: Path) -> None:
    def fails(tree: xr.DataTree) -> list[Check]:
        return [Check("always", "yes", "no", False, {}, (3, 4, 9))]

    answer = store.verify(whole, [fails]).as_json()
    assert answer["checks"][0]["frames"] == "3:5,9:10"
    assert [(row["frame"], row["checks"]) for row in answer["frame_report"]] == [(f, ["always"]) for f in (3, 4, 9)]


def test_numbers_that_are_not_the_ones_written_are_found_though_files_and_marks_agree(copy: Path) -> None:
    """Not by a quick look, which compares files only."""
    mark = store.marks.load_mark(copy, 0)
    assert mark is not None
    store.marks.save_mark(copy, store.Mark("0", mark.frames, "0" * 64, mark.files))
    assert store.verify(copy, quick=True).ok
    assert found(copy) == {"shard 0": "its data are not those that were written"}
    (copy / "image/energy/c.1.0.0").unlink()
    assert not store.verify(copy, quick=True).ok


@pytest.mark.parametrize(
    ("labels", "what"),
    [
        (np.array([0.0, 2.0, 1.0]), "neither rises nor falls"),
        (np.array([0.0, np.nan, 1.0]), "1 values are not finite"),
        (np.array(["a", "b", "a"]), "the same label twice"),
    ],
)
def test_coordinates_that_nothing_can_be_looked_up_by_are_found(labels: np.ndarray, what: str) -> None:
    tree = xr.DataTree.from_dict({"/": xr.Dataset(coords={"x": xr.Variable(("x",), labels, {"units": "1"})})})
    assert [(p.where, what in p.what) for p in described(tree)] == [("/x", True)]


def test_a_variable_without_units_is_found() -> None:
    tree = xr.DataTree.from_dict({"/part": xr.Dataset({"x": 1.0})})
    assert [(p.where, p.what) for p in described(tree)] == [("/part/x", "has no units")]


def _metadata(store: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    root = json.loads((store / "zarr.json").read_text())
    return root, root["consolidated_metadata"]["metadata"]


METADATA: dict[str, Callable[[dict[str, Any]], object]] = {
    "a unit": lambda of: of["signals/pressure"]["attributes"].update(units="uPa"),
    "an array that is gone": lambda of: of.pop("cloud/elevation"),
    "a type": lambda of: of["link_budget/transmission_loss_out"].update(data_type="int64"),
    "a shape larger than memory": lambda of: of["image/energy"]["shape"].__setitem__(0, 10**12),
}


@pytest.mark.parametrize("change", METADATA)
def test_numbers_are_not_read_by_metadata_that_have_changed(copy: Path, change: str) -> None:
    """Units and scales were taken from them, and what they lacked was a traceback."""
    root, of = _metadata(copy)
    METADATA[change](of)
    (copy / "zarr.json").write_text(json.dumps(root, indent=2))
    for read in (store.open_store, FrameReader):
        with pytest.raises(store.Damage, match=r"zarr\.json is missing or damaged: 'sonarsynth repair' restores it$"):
            read(copy)
    assert repair(copy, workers=0).ok
    assert store.open_store(copy).sizes["frame"] == 20


def test_a_link_in_a_store_is_not_our_fault(copy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (chunk,) = (copy / "image/energy").glob("c.0.*")
    chunk.rename(tmp_path / "elsewhere")
    chunk.symlink_to(tmp_path / "elsewhere")
    assert run(app, ["export", str(copy), "--to", "sonar-netcdf", "--out", str(tmp_path / "out")]) == 2
    assert f"{chunk}: is a link, which is not followed" in capsys.readouterr().err


def test_a_stranger_s_metadata_are_refused_in_one_line(copy: Path) -> None:
    shutil.rmtree(copy / ".marks")
    root, of = _metadata(copy)
    METADATA["a type"](of)
    (copy / "zarr.json").write_text(json.dumps(root))
    with pytest.raises(store.Mismatch, match="not a store that xarray can open") as raised:
        store.open_store(copy)
    assert "\n" not in str(raised.value)


@pytest.mark.filterwarnings("ignore::sonarsynth.store.marks.Unmarked")
def test_what_a_stranger_s_store_lacks_is_named(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.rmtree(copy / ".marks")
    root, of = _metadata(copy)
    del of["source_estimates/time"]
    (copy / "zarr.json").write_text(json.dumps(root))
    for command, name in (("show", "source_estimates/time"), ("export", "time")):
        assert run(app, [command, str(copy)]) == 2
        assert f"the store has no {name}: another version wrote it, or another program" in capsys.readouterr().err
