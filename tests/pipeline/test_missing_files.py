"""A file of a store that is gone: zarr takes it for fill values, but each reader of ours refuses, and a build makes it
again."""

from __future__ import annotations

import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import sonarsynth as ss
from sonarsynth import schedule
from sonarsynth.cli import app
from sonarsynth.cli.running import run
from sonarsynth.loading import Frames
from sonarsynth.planning import Plan
from sonarsynth.schedule.repairing import repair
from sonarsynth.store import Damage, Remote, lock
from sonarsynth.store.frame_reading import FrameReader
from sonarsynth.store.marks import ABSENT, Unmarked, load_mark, load_marks, marked
from tests.places import contents, web_server

FRAMES = range(10)
"""What is built: a whole shard, and a part of the second; the third is not there, and its frames are NaN."""


@pytest.fixture(scope="module")
def whole(small_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("missing") / "s.zarr"
    assert schedule.build(small_plan, path, frames=FRAMES, workers=0).ok
    return path


def all_chunks(store: Path) -> list[str]:
    """Files of chunks, of arrays with frames and of those without."""
    return sorted(str(file.relative_to(store)) for file in store.rglob("c*") if file.is_file())


def read_every(tree: object) -> None:
    for node in tree.subtree:  # type: ignore[attr-defined]
        for variable in node.dataset.variables.values():
            _ = variable.values


def test_what_was_never_built_is_nan_and_what_was_is_itself(whole: Path) -> None:
    absent = [f for _, m in load_marks(whole, marked(whole)) for f, r in m.files.items() if r == ABSENT]  # type: ignore[union-attr]
    assert absent, "there is a file that was not written, since all its numbers are the fill value"
    tree, reader = ss.open(whole), FrameReader(whole)
    read_every(tree)
    assert np.isfinite(tree["image/energy"].values[list(FRAMES)]).any(axis=(1, 2)).all()
    assert np.isnan(tree["image/energy"].values[10:]).all()
    assert np.isnan(reader.array("image/energy")[19]).all()
    for name in {file.rpartition("/")[0] for file in absent}:
        _ = reader.array(name).every()


def test_each_file_that_is_gone_is_missed_by_its_reader(copy: Path) -> None:
    """Whichever it is: of a shard, or fixed, by xarray and frame by frame."""
    tree = ss.open(copy)
    for file in all_chunks(copy):
        name, content = file.rpartition("/")[0], (copy / file).read_bytes()
        (copy / file).unlink()
        with pytest.raises(Damage, match=f"^{file}: the file is missing: 'sonarsynth repair' restores it"):
            _ = ss.open(copy)[name].values
        if tree[name].dims[:1] == ("frame",):
            with pytest.raises(Damage, match=f"^{file}: the file is missing"):
                _ = FrameReader(copy).array(name).every()
        (copy / file).write_bytes(content)
    read_every(pickle.loads(pickle.dumps(ss.open(copy))))


def test_elsewhere_too(whole: Path, tmp_path: Path) -> None:
    """In an object store, and on a web server, where nothing can be listed."""
    copy = tmp_path / "s.zarr"
    shutil.copytree(whole, copy)
    (copy / "image/energy/c.1.0.0").unlink()
    place = Remote("memory://missing/s.zarr")
    place.write_each(contents(copy))
    with web_server(tmp_path) as address:
        for at in (str(place), f"{address}/s.zarr"):
            tree = ss.open(at)
            assert np.isfinite(tree["image/energy"].isel(frame=slice(8)).values).any()
            with pytest.raises(Damage, match=r"^image/energy/c\.1\.0\.0: the file is missing"):
                _ = tree["image/energy"].values


@pytest.mark.parametrize(
    ("command", "file"),
    [
        (("show", "--frame", "9"), "image/energy/c.1.0.0"),
        (("show", "--frame", "9"), "targets/box/vertices/c.0.0"),
        (("export",), "truth/sonar_position/c.1.0"),
        (("export", "--to", "sonar-netcdf"), "signals/pressure/c.1.0.0"),
        (("export", "--to", "coco"), "image/energy/c.1.0.0"),
        (("card",), "signals/pressure/c.1.0.0"),
        (("report",), "truth/targets/category/c.0.0"),
        (("evaluate", "truth"), "truth/targets/pixel_box/c.0.0.0"),
        (("detect",), "image/energy/c.1.0.0"),
    ],
)
def test_commands_say_what_is_missing_and_leave_nothing(
    copy: Path, capfd: pytest.CaptureFixture[str], command: tuple[str, ...], file: str
) -> None:
    (copy / file).unlink()
    name, *options = command
    assert run(app, [name, str(copy), *options]) == 4
    said = capfd.readouterr().err.splitlines()[-1]
    assert said == f"sonarsynth: {file}: the file is missing: 'sonarsynth repair' restores it"
    assert [made for made in copy.parent.iterdir() if made.suffix in (".md", ".json", ".html", ".ply")] == []
    assert not any(copy.with_name(f"s.zarr.{to}").exists() for to in ("coco", "sonar-netcdf"))


def test_a_store_without_its_marks_is_said_to_be_one(copy: Path) -> None:
    """All of them, as `cp STORE/*` leaves them behind, or that of one shard; not one that is still being written."""
    mark, said = copy / ".marks/1.json", r" is missing: no one can say .* read as NaN: "
    content = mark.read_bytes()
    mark.unlink()
    with pytest.warns(Unmarked, match=rf"s\.zarr: \.marks/1\.json{said}a build was killed, or a copy cut short"):
        ss.open(copy)
    with lock(copy):
        ss.open(copy)
    mark.write_bytes(content)
    shutil.move(copy / ".marks", copy.parent / "marks")
    for reads in (ss.open, Frames):
        with pytest.warns(Unmarked, match=rf"s\.zarr: \.marks{said}copy it as well"):
            reads(copy)
    shown = [sys.executable, "-m", "sonarsynth", "show", str(copy), "--frame", "9"]
    said_by_show = subprocess.run(shown, capture_output=True, text=True, check=True).stderr
    assert (
        said_by_show.startswith(f"sonarsynth: {copy}: .marks is missing: ") and said_by_show.count("sonarsynth: ") == 1
    )
    place = Remote("memory://unmarked/s.zarr")
    place.write_each(contents(copy))
    with pytest.warns(Unmarked, match=rf"s\.zarr: \.marks{said}copy it as well"):
        ss.open(str(place))
    assert repair(copy, workers=0).ok
    assert (copy / ".marks/1.json").read_bytes() == content
    ss.open(copy)


def test_a_damaged_mark_says_what_to_do(copy: Path) -> None:
    """It is no loss: the frames are in the recipe."""
    before = contents(copy)
    for text in (b"", (copy / ".marks/1.json").read_bytes() + b" "):
        (copy / ".marks/1.json").write_bytes(text)
        with pytest.raises(Damage, match=r"^\.marks/1\.json: the mark is damaged: 'sonarsynth repair' writes it again"):
            load_mark(copy, 1)
        assert repair(copy, workers=0).ok
        assert contents(copy) == before


def test_a_build_makes_again_what_is_gone(copy: Path, whole: Path, small_plan: Plan) -> None:
    """To the byte, and no other shard; which is told without reading a file of data."""
    for file in ("image/energy/c.1.0.0", "truth/sonar_position/c.1.0"):
        (copy / file).unlink()
    other = (copy / "image/energy/c.0.0.0").stat().st_mtime_ns
    report = schedule.build(small_plan, copy, frames=FRAMES, workers=0)
    assert (report.there, report.written) == (8, 2)
    assert contents(copy) == contents(whole) and (copy / "image/energy/c.0.0.0").stat().st_mtime_ns == other
    assert schedule.build(small_plan, copy, frames=FRAMES, workers=0).written == 0
    shutil.rmtree(copy / "cloud/x")
    with pytest.raises(Damage, match=r"cloud/x/zarr\.json is missing .*: 'sonarsynth repair' restores it"):
        schedule.build(small_plan, copy, frames=FRAMES, workers=0)
