"""What is damaged is made again, to the byte; what cannot be is refused in one line; nothing else is touched."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from sonarsynth import pipeline, store
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.recipe import Recipe, reading
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair
from sonarsynth.store.marks import load_layout, load_mark, save_mark
from tests.places import contents

NO_MARKS = ("3.json", "99.json", "7")
SHARD = "image/energy/c.1.0.0"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, small: Recipe) -> Path:
    """Two shards whole, and half of the short last one."""
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    assert build(small, path, frames=range(18), workers=0).ok
    return path


def assert_identical(path: Path, whole: Path) -> None:
    """The same files, folders and bytes, and nothing else: no link, no pipe, no empty folder."""
    ours, theirs = contents(path), contents(whole)
    assert sorted(name for name in ours.keys() | theirs.keys() if ours.get(name) != theirs.get(name)) == []
    entries = [{(at.relative_to(root), at.is_symlink()) for at in root.rglob("*")} for root in (path, whole)]
    assert entries[0] == entries[1]


def in_place_of(file: Path, text: str = "") -> None:
    shutil.rmtree(file)
    file.write_text(text)


def append(file: Path, text: str) -> None:
    file.write_text(file.read_text() + text)


def truncate(path: Path, *names: str) -> None:
    for name in names:
        os.truncate(path / name, 10)


def copies(file: Path, *names: str) -> None:
    for name in names:
        shutil.copy(file, file.with_name(name))


def remove(path: Path, *names: str) -> None:
    for name in names:
        (path / name).unlink()


def folder_at(file: Path) -> None:
    file.unlink()
    file.mkdir()
    (file / "inside").write_text("hello")


def link_at(file: Path) -> None:
    elsewhere = file.parents[len(file.parts) - 3] / "elsewhere"
    elsewhere.write_text("precious")
    file.unlink()
    file.symlink_to(elsewhere)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "root metadata": lambda p: (p / "zarr.json").write_bytes(b"{}"),
    "root metadata and a copy of the manifest": lambda p: remove(p, "zarr.json", ".marks/layout.json"),
    "metadata of a group and of an array": lambda p: truncate(p, "truth/zarr.json", "time/zarr.json"),
    "both copies of the manifest": lambda p: [m.unlink() for m in (p / ".marks").glob("layout*")],
    "both copies, and a static array": lambda p: (
        [m.write_text("{}") for m in (p / ".marks").glob("layout*")],
        (p / "targets/box/faces/c.0.0").unlink(),
        (p / "notes.txt").write_text("hello"),
    ),
    "all marks": lambda p: shutil.rmtree(p / ".marks"),
    "the marks and a group are files": lambda p: (in_place_of(p / ".marks"), in_place_of(p / "image")),
    "the marks are a file": lambda p: in_place_of(p / ".marks"),
    "an array": lambda p: shutil.rmtree(p / "image/energy"),
    "a group": lambda p: shutil.rmtree(p / "targets"),
    "a group is a file": lambda p: in_place_of(p / "cloud", "hello"),
    "the short last shard": lambda p: os.truncate(p / "signals/pressure/c.2.0.0", 1000),
    "the mark of a shard": lambda p: (p / ".marks/2.json").unlink(),
    "the mark of a shard, and its steps": lambda p: ((p / ".marks/2.json").write_text("{}"), (p / "step/c.2").unlink()),
    "the mark of another shard": lambda p: shutil.copy(p / ".marks/0.json", p / ".marks/1.json"),
    "a blank after a mark": lambda p: append(p / ".marks/1.json", " "),
    "a folder where a file was": lambda p: folder_at(p / SHARD),
    "a folder where metadata was": lambda p: folder_at(p / "image/zarr.json"),
    "a folder where a mark was": lambda p: folder_at(p / ".marks/1.json"),
    "a folder where the manifest was": lambda p: folder_at(p / ".marks/layout.json"),
    "a link": lambda p: link_at(p / SHARD),
    "a pipe": lambda p: ((p / SHARD).unlink(), os.mkfifo(p / SHARD)),
    "a broken link": lambda p: ((p / "image/zarr.json").unlink(), (p / "image/zarr.json").symlink_to("nowhere")),
    "a linked folder that nobody made": lambda p: (p / "image/more").symlink_to("/"),
    "a shard past the end": lambda p: shutil.copy(p / "image/energy/c.0.0.0", p / "image/energy/c.7.0.0"),
    "a shard that was not built": lambda p: (p / "image/energy/c.1.0.0").rename(p / "image/energy/c.5.0.0"),
    "marks of shards that are not there": lambda p: copies(p / ".marks/0.json", *NO_MARKS),
    "a name that no line holds": lambda p: (p / "two\nlines \udcff").write_text("hello"),
    "an empty folder": lambda p: (p / "image/empty").mkdir(),
    "everything of frames": lambda p: [f.write_bytes(b"") for f in p.rglob("c.*.0.0")],
}  # fmt: skip


AT_ONCE = (
    "an empty folder",
    "root metadata; a group; a folder where a file was; a shard past the end; marks of shards that are not there",
    "root metadata and a copy of the manifest; a group is a file; the mark of a shard, and its steps; a link",
    "metadata of a group and of an array; an array; the short last shard; the mark of another shard; an empty folder",
    "both copies of the manifest; a broken link",
    "both copies, and a static array",
    "all marks",
    "the marks and a group are files",
    "the marks are a file; a shard that was not built",
    "the mark of a shard; a blank after a mark; a pipe; a folder where the manifest was; a name that no line holds",
    "a folder where metadata was; a folder where a mark was; a linked folder that nobody made",
    "everything of frames",
)
"""Each damage once, with others that are elsewhere in the store."""


def test_each_damage_is_repaired_once() -> None:
    assert sorted({name for names in AT_ONCE for name in names.split("; ")}) == sorted(DAMAGES)


@pytest.mark.parametrize("names", AT_ONCE)
def test_a_repaired_store_is_the_one_that_was_built(copy: Path, whole: Path, names: str) -> None:
    for name in names.split("; "):
        DAMAGES[name](copy)
    assert store.verify(copy, quick=True).ok is (names == "an empty folder")
    report = repair(copy, workers=0)
    assert report.ok, report
    assert_identical(copy, whole)


def test_in_a_store_that_is_whole_nothing_is_repaired(copy: Path, whole: Path) -> None:
    """So a repair of what was repaired does nothing: each store above came out as this one."""
    assert store.verify(copy).problems == ()
    report = repair(copy, workers=0)
    assert (report.restored, report.shards, report.moved) == ((), (), ())
    assert_identical(copy, whole)


def test_only_what_is_damaged_is_made_again(copy: Path, whole: Path) -> None:
    before = {f: f.stat().st_mtime_ns for f in copy.rglob("*") if f.is_file()}
    os.truncate(copy / SHARD, 10)
    (copy / "image/azimuth/c.0").write_bytes(b"")
    report = repair(copy, workers=0)
    assert (report.restored, report.shards, report.frames) == (("image/azimuth/c.0",), (1,), tuple(range(8, 16)))
    touched = {f.relative_to(copy).as_posix() for f in before if f.stat().st_mtime_ns != before[f]}
    layout, mark = load_layout(whole), load_mark(whole, 1)
    assert layout is not None
    assert mark is not None
    assert touched <= {"image/azimuth/c.0", ".marks/1.json", *mark.files}
    assert_identical(copy, whole)


def test_a_store_without_damage_needs_no_recipe(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "loads", lambda *_: 1 / 0)
    (copy / ".marks/layout.copy.json").unlink()
    (copy / "notes.txt").write_text("hello")
    report = repair(copy, workers=0)
    assert report.ok
    assert report.restored == (".marks/layout.copy.json",)
    assert [Path(m).read_text() for m in report.moved] == ["hello"]
    assert not store.verify(copy).problems


def test_what_moves_out_is_kept_whatever_was_there_before(copy: Path) -> None:
    for text in ("first", "second"):
        (copy / "image/notes.txt").write_text(text)
        assert repair(copy, workers=0).ok
    (copy / "image/notes.txt").mkdir()
    (copy / "image/notes.txt/deep").write_text("third")
    assert repair(copy, workers=0).ok
    kept = [f.read_text() for f in store.beside(copy, "foreign").rglob("*") if f.is_file()]
    assert sorted(kept) == ["first", "second", "third"]


@pytest.mark.parametrize(
    ("what", "now", "said"),
    [
        ("_version", "9.9", r"was built by sonarsynth .+, and this is 9\.9"),
        ("code_digest", "f" * 64, r"was built by another state of the code of sonarsynth"),
    ],
)
def test_another_version_is_refused_unless_told_otherwise(
    copy: Path, whole: Path, monkeypatch: pytest.MonkeyPatch, what: str, now: str, said: str
) -> None:
    monkeypatch.setattr(f"sonarsynth.store.creating.{what}", lambda: now)
    os.truncate(copy / SHARD, 10)
    damaged = contents(copy)
    with pytest.raises(store.Mismatch, match=said):
        repair(copy, workers=0)
    assert contents(copy) == damaged
    (copy / "truth/zarr.json").unlink()
    assert repair(copy, workers=0, force=True).ok
    assert_identical(copy, whole)


def test_a_store_keeps_the_shards_that_it_was_begun_with(
    copy: Path, whole: Path, small: Recipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sonarsynth.planning._shard_frames", lambda plan: 4)  # today's rule: others, of 8
    os.truncate(copy / SHARD, 10)
    assert repair(copy, workers=0).shards == (1,)
    assert_identical(copy, whole)
    assert build(small, copy, workers=0).ok
    assert store.verify(copy).ok


def test_numbers_that_come_out_differently_are_said(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    works = pipeline.trace_paths
    monkeypatch.setattr(pipeline, "trace_paths", lambda made, i: works(made, i - i % 2))
    os.truncate(copy / SHARD, 10)
    report = repair(copy, workers=0)
    assert report.differing == [1]
    assert not report.ok


def test_a_frame_that_cannot_be_rebuilt_fails(copy: Path, whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    works = pipeline.trace_paths
    os.truncate(copy / SHARD, 10)
    with monkeypatch.context() as patch:
        patch.setattr(pipeline, "trace_paths", lambda made, i: 1 / 0 if i == 9 else works(made, i))
        report = repair(copy, workers=0)
    assert [f.frame for f in report.failures] == [9]
    assert not report.ok
    assert store.frames_there(copy) == [f for f in range(18) if f != 9]
    assert json.loads(store.beside(copy, "failed.jsonl").read_text())["frame"] == 9


def test_numbers_that_are_not_the_ones_of_their_mark_are_made_again(copy: Path, whole: Path) -> None:
    mark = load_mark(copy, 0)
    assert mark is not None
    save_mark(copy, replace(mark, content="0" * 64))
    assert repair(copy, workers=0, quick=True).shards == ()
    assert repair(copy, workers=0).shards == (0,)
    assert_identical(copy, whole)


def test_an_interrupted_repair_goes_on(copy: Path, whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    truncate(copy, *(f"signals/pressure/c.{shard}.0.0" for shard in range(3)))
    with monkeypatch.context() as patch:
        patch.setattr("sonarsynth.store.writing.save_mark", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            repair(copy, workers=0)
    assert repair(copy, workers=0).shards == (0, 1, 2)
    assert_identical(copy, whole)


def test_a_worker_process_repairs_too(copy: Path, whole: Path) -> None:
    truncate(copy, *(f"signals/pressure/c.{shard}.0.0" for shard in range(3)))
    assert repair(copy, workers=1).shards == (0, 1, 2)
    assert_identical(copy, whole)


def test_a_mesh_that_has_changed_is_refused(tmp_path: Path, small_text: str) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh, path = tmp_path / "box.stl", tmp_path / "s.zarr"
    trimesh.creation.box((1, 1, 1)).export(mesh)
    text = small_text.replace("{kind: box, size: [1, 1, 1], edge: 0.25}", "{kind: mesh_file, path: box.stl}")
    build(reading.loads(text, folder=tmp_path), path, frames=[0], workers=0)
    whole = contents(path)
    (path / "step/c.0").unlink()
    kept = mesh.read_bytes()
    trimesh.creation.box((1, 1, 2)).export(mesh)
    with pytest.raises(store.Mismatch, match=r"a file that its recipe names, .* has changed"):
        repair(path, workers=0, files=tmp_path)
    mesh.unlink()
    with pytest.raises(store.Mismatch, match=r"box\.stl"):
        repair(path, workers=0, files=tmp_path)
    mesh.write_bytes(kept)
    assert repair(path, workers=0, files=tmp_path).ok
    assert contents(path) == whole


def test_the_command_says_what_it_did(copy: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    def command(*arguments: object) -> tuple[int, str, str]:
        status = run(app, [str(a) for a in arguments])
        return status, *capfd.readouterr()

    os.truncate(copy / SHARD, 10)
    (copy / "zarr.json").unlink()
    (copy / "notes.txt").write_text("hello")
    status, out, _ = command("verify", copy, "--quick")
    assert status == 4
    assert "damaged frames: 8:16; run 'sonarsynth repair'" in out
    status, out, _ = command("repair", copy, "--workers", "0")
    assert status == 0
    assert "restored zarr.json" in out
    assert "rebuilt: 1 shard, frames 8:16" in out
    assert f"moved out: {copy}.foreign/notes.txt" in out
    assert "store is intact" in out
    assert command("verify", copy, "--quick")[1].endswith("all files match their digests\n")
    status, out, _ = command("repair", copy, "--json")
    assert (status, json.loads(out)["ok"], json.loads(out)["shards"]) == (0, True, [])
    for arguments, message in (
        ((copy, "--workers", "1", "--scheduler", "tcp://127.0.0.1:1"), "--workers starts processes on this machine"),
        ((tmp_path / "none",), "none: no such store"),
        ((tmp_path,), "is not a store of sonarsynth"),
        ((copy / "zarr.json",), "is not a store: it is not a folder"),
    ):
        status, out, err = command("repair", *arguments)
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert message in err
    with store.lock(copy):
        status, _, err = command("repair", copy)
    assert status == 4
    assert "is being built by" in err


def test_a_store_whose_recipe_is_gone_is_one_line(copy: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name in (".marks/layout.json", ".marks/layout.copy.json", "zarr.json"):
        (copy / name).write_text("{}")
    assert run(app, ["repair", str(copy)]) == 4
    assert "its recipe cannot be read any more" in capfd.readouterr().err
