"""A store at a URL is the store that a folder would hold, object for object; what a URL cannot do is one line."""

from __future__ import annotations

import json
import re
import sys
import threading
import time
from collections.abc import Callable
from itertools import count
from pathlib import Path

import pytest

from sonarsynth import schedule, store
from sonarsynth.planning import Plan
from sonarsynth.schedule.repairing import repair
from sonarsynth.store import Folder, Remote, creating
from sonarsynth.store.files import lock
from tests.commands import status
from tests.places import contents, web_server
from tests.waiting import HANGING, wait_until

FRAMES = range(10)
"""What is built: a whole shard, and a part of the second."""

NUMBERS = count()


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(creating, "begun", lambda source=None: {"provenance": {"created": "then"}})


@pytest.fixture
def place() -> Remote:
    """A place that no test has used."""
    return Remote(f"memory://tests/{next(NUMBERS)}/s.zarr")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, small_plan: Plan) -> Path:
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(creating, "begun", lambda source=None: {"provenance": {"created": "then"}})
        assert schedule.build(small_plan, path, frames=FRAMES, workers=0).ok
    return path


@pytest.fixture
def copy(whole: Path, place: Remote) -> Remote:
    """The store, sent there."""
    place.write_each(contents(whole))
    return place


def test_a_store_at_a_url_is_the_one_in_a_folder(small_plan: Plan, place: Remote, whole: Path, tmp_path: Path) -> None:
    assert schedule.build(small_plan, str(place), frames=range(8), workers=0).there == 0
    report = schedule.build(small_plan, str(place), frames=FRAMES, workers=0)
    assert (report.ok, report.there, report.store) == (True, 8, str(place))
    assert contents(place) == contents(whole)
    beside = {name for name in Remote(f"{place.url.rpartition('/')[0]}").sizes() if not name.startswith("s.zarr/")}
    assert beside == {"s.zarr.card.md", "s.zarr.croissant.json"}, "the lock is given back"
    local = sorted(file.name for file in (tmp_path / "state").rglob("*") if file.is_file())
    assert local == ["s.zarr.log.jsonl", "s.zarr.times.jsonl"]
    assert schedule.build(small_plan, place, frames=FRAMES, workers=0).written == 0


def test_verify_says_of_it_what_it_says_of_a_folder(copy: Remote, whole: Path) -> None:
    there, here = store.verify(copy), store.verify(whole)
    assert there.ok
    assert (there.complete, there.files, there.bytes) == (here.complete, here.files, here.bytes)


def flip(place: Remote) -> None:
    content = bytearray(place.read_bytes())
    content[len(content) // 2] ^= 4
    place.write_bytes(bytes(content))


DAMAGES: dict[str, Callable[[Remote], None]] = {
    "a bit of a shard": lambda at: flip(at / "image/energy/c.0.0.0"),
    "a shard cut short": lambda at: (at / "truth/targets/box/c.1.0.0.0").write_bytes(b"short"),
    "a shard gone": lambda at: (at / "signals/pressure/c.0.0.0").unlink(),
    "a mark gone": lambda at: (at / ".marks/1.json").unlink(),
    "a bit of a mark": lambda at: flip(at / ".marks/0.json"),
    "metadata of the root": lambda at: (at / "zarr.json").unlink(),
    "an axis": lambda at: flip(at / "image/azimuth/c.0"),
    "both manifests": lambda at: at.unlink_each([".marks/layout.json", ".marks/layout.copy.json"]),
    "a stranger": lambda at: (at / "image/notes.txt").write_bytes(b"mine"),
    "a stranger among the marks": lambda at: (at / ".marks/x.json").write_bytes(b"{}"),
}


@pytest.mark.parametrize("name", DAMAGES)
def test_damage_is_found_and_mended(copy: Remote, whole: Path, name: str) -> None:
    DAMAGES[name](copy)
    assert not store.verify(copy, quick=True).ok
    report = repair(copy, workers=0, quick=True)
    assert report.ok, report
    assert contents(copy) == contents(whole)
    if "stranger" in name:
        assert report.moved
        assert all(moved.startswith(f"{copy}.foreign/") for moved in report.moved)


def test_a_store_that_was_not_laid_out_whole_is_laid_out_anew(small_plan: Plan, place: Remote, whole: Path) -> None:
    some = {name: found for name, found in contents(whole).items() if "layout" in name or name.startswith("truth/")}
    place.write_each({name: found for name, found in some.items() if "/c.1" not in name and "/c.0." not in name})
    schedule.build(small_plan, place, frames=FRAMES, workers=0)
    assert contents(place) == contents(whole)


def test_what_is_not_ours_stays(small_plan: Plan, anywhere: Folder) -> None:
    if isinstance(anywhere, Path):
        anywhere.mkdir()
    (anywhere / "precious.txt").write_bytes(b"mine")
    for restart in (False, True):
        with pytest.raises(store.Mismatch, match="not a store of sonarsynth"):
            schedule.build(small_plan, anywhere, workers=0, restart=restart)
    assert contents(anywhere) == {"precious.txt": b"mine"}


def test_another_recipe_is_refused_and_restart_begins_anew(small_plan: Plan, copy: Remote, small_text: str) -> None:
    from sonarsynth import planning
    from sonarsynth.recipe import reading

    other = planning.plan(reading.loads(small_text.replace("seed: 3", "seed: 4")))
    with pytest.raises(store.Mismatch, match="seed: 3, now 4"):
        schedule.build(other, copy, frames=range(8), workers=0)
    schedule.build(other, copy, frames=range(8), workers=0, restart=True)
    assert store.frames_there(copy) == list(range(8))
    assert store.verify(copy, quick=True).ok


def test_failed_frames_are_known_the_next_time(
    small_plan: Plan, place: Remote, whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from sonarsynth import pipeline

    trace = pipeline.trace_paths
    with monkeypatch.context() as patch:
        patch.setattr(pipeline, "trace_paths", lambda plan, i: 1 / 0 if i == 3 else trace(plan, i))
        assert not schedule.build(small_plan, place, frames=FRAMES, workers=0).ok
    assert store.beside(place, "failed.jsonl").exists()
    again = schedule.build(small_plan, place, frames=FRAMES, workers=0)
    assert [failure.frame for failure in again.failures] == [3]
    assert schedule.build(small_plan, place, frames=FRAMES, workers=0, retry_failed=True).ok
    assert not store.beside(place, "failed.jsonl").exists()
    assert contents(place) == contents(whole)


def test_a_second_build_is_refused_while_the_first_runs(small_plan: Plan, anywhere: Folder) -> None:
    with store.lock(anywhere), pytest.raises(store.StoreLocked, match=r"is being built by process \d+ on"):
        schedule.build(small_plan, anywhere, frames=FRAMES, workers=0)
    assert not anywhere.exists()
    assert not store.beside(anywhere, "lock").exists()


@pytest.fixture(params=["disk", "url"])
def anywhere(request: pytest.FixtureRequest, place: Remote, tmp_path: Path) -> Folder:
    return place if request.param == "url" else tmp_path / "s.zarr"


def claim_of(place: Folder, **facts: object) -> None:
    """Another's claim of a store."""
    claim = {"build": "other", "process": 1, "host": "there", "machine": "there", "started": "1", "renewed": 0}
    store.beside(place, "lock").write_bytes(json.dumps(claim | facts).encode())


def test_the_claim_of_a_process_that_is_gone_is_taken_at_once(anywhere: Folder) -> None:
    with store.lock(anywhere):
        mine = json.loads(store.beside(anywhere, "lock").read_bytes())
    claim_of(anywhere, machine=mine["machine"], process=mine["process"], started="1")
    with store.lock(anywhere, lease=1e9) as name:  # else this would wait for ever
        assert lock.holder(anywhere) == name


def test_a_claim_that_nobody_renews_is_taken_in_the_end(anywhere: Folder) -> None:
    claim_of(anywhere)
    began = time.monotonic()
    with store.lock(anywhere, lease=0.5) as name:
        assert time.monotonic() - began >= 0.5
        assert lock.holder(anywhere) == name


def test_a_claim_that_is_renewed_is_not_taken(anywhere: Folder) -> None:
    claim_of(anywhere)
    renewing = threading.Timer(0.3, lambda: claim_of(anywhere, renewed=1))
    renewing.start()
    with pytest.raises(store.StoreLocked, match="process 1 on there"), store.lock(anywhere, lease=HANGING):
        pass
    renewing.join()
    assert lock.holder(anywhere) == "other"


def test_a_holder_renews_its_claim_and_leaves_that_of_another(anywhere: Folder) -> None:
    def written() -> object:
        file = store.beside(anywhere, "lock")
        return file.stat().st_mtime_ns if isinstance(file, Path) else file.read_bytes()

    with store.lock(anywhere, renewed=0.05) as name:
        for _ in range(2):
            before = written()
            wait_until(lambda before=before: written() != before)  # type: ignore[misc]
        assert lock.holder(anywhere) == name
        claim_of(anywhere)
    assert lock.holder(anywhere) == "other"


@pytest.mark.parametrize("content", [b"", b"[1]", b"{}", b"process 7", b"[" * 100_000])
def test_what_is_no_claim_keeps_nobody_out(anywhere: Folder, content: bytes) -> None:
    store.beside(anywhere, "lock").write_bytes(content)
    with store.lock(anywhere) as name:
        assert lock.holder(anywhere) == name
    assert not store.beside(anywhere, "lock").exists()


def test_verify_says_that_it_is_being_built_and_by_whom(copy: Remote) -> None:
    (copy / ".marks/1.json").unlink()
    assert store.verify(copy, quick=True).building == ""
    with store.lock(copy):
        report = store.verify(copy, quick=True)
        mine = json.loads(store.beside(copy, "lock").read_bytes())
    assert report.ok
    assert re.fullmatch(r"process \d+ on .+", report.building)
    assert report.complete == tuple(range(8))
    claim_of(copy, machine=mine["machine"], process=mine["process"])
    report = store.verify(copy, quick=True)
    assert report.building == "", "that process is gone"
    assert not report.ok


def test_pictures_of_a_url_go_to_the_working_directory(copy: Remote, tmp_path: Path) -> None:
    from sonarsynth.pictures.store_reading import pictures_of

    assert pictures_of(copy) == Path("s.zarr.pictures")
    assert pictures_of(tmp_path / "s.zarr") == tmp_path / "s.zarr.pictures"


def test_a_place_that_cannot_be_written_is_found_before_anything_is_predicted(
    small_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(schedule, "predict", lambda *_, **__: 1 / 0)
    with web_server(tmp_path) as address:
        assert status("build", str(small_file), f"{address}/s.zarr") == 2
    assert "can be read, not written" in capsys.readouterr().err


def test_a_writer_that_outlived_its_build_writes_no_mark(
    small_plan: Plan, place: Remote, made_up: Callable[..., object]
) -> None:
    store.create(place, small_plan)
    frames = {0: made_up(small_plan, 0)}
    with pytest.raises(store.BuildEnded), store.shared_lock(place, "gone"):
        raise AssertionError
    with store.lock(place) as build, store.shared_lock(place, build) as still:
        claim_of(place)
        with pytest.raises(store.BuildEnded):
            store.write_shard(place, small_plan, 0, frames, still)  # type: ignore[arg-type]
    assert store.frames_there(place) == []


@pytest.mark.parametrize(
    ("url", "said"),
    [
        ("s3x://bucket/s.zarr", "Protocol not known"),
        ("gs://bucket/s.zarr", "a package is missing"),
        ("memory://a/s.zarr", "of this process alone"),
        ("s3://user:word@bucket/s.zarr", "may hold no credentials"),
        ("s3://bucket/s.zarr?signature=word", "may hold no ?"),
        ("s3://bucket", "names no place"),
        ("simplecache::s3://bucket/s.zarr", "s.zarr"),
    ],
)
def test_a_url_that_cannot_be_a_store_is_one_line(
    small_file: Path, capsys: pytest.CaptureFixture[str], url: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "gcsfs", None)
    monkeypatch.chdir(small_file.parent)
    if url.startswith("simplecache"):
        with pytest.raises(store.Unreachable):
            Remote(url)
        return
    assert status("build", str(small_file), url, "--no-predict") == 2
    found = capsys.readouterr().err
    assert found.count("\n") == 1
    assert said in found
    assert "word" not in found


def test_a_store_on_the_web_is_read(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], small_file: Path
) -> None:
    with web_server(whole.parent) as address:
        url = f"{address}/s.zarr"
        report = store.verify(url, quick=True)
        assert report.ok
        assert report.complete == tuple(FRAMES)
        assert status("card", url, "--out", str(tmp_path)) == 0
        assert (tmp_path / "s.zarr.card.md").exists()
        assert status("show", url, "--no-film", "--out", str(tmp_path)) == 0
        assert (tmp_path / "sheet.png").exists()
        capsys.readouterr()
        for command in (["build", str(small_file), url, "--no-predict"], ["repair", url], ["card", url]):
            assert status(*command) == 2
            found = capsys.readouterr().err
            assert "can be read, not written" in found
            assert found.count("\n") == 1
        assert status("verify", f"{url}x") == 2
    with web_server(whole.parent, ranges=False) as address:
        capsys.readouterr()
        assert status("show", f"{address}/s.zarr") == 2
        assert "no parts of files" in capsys.readouterr().err


def test_file_urls_are_paths(whole: Path) -> None:
    assert store.folder_of(f"file://{whole}") == whole
    assert store.verify(f"file://{whole}", quick=True).ok
