"""A store that is looked at while it is built: what is complete is judged, and nothing else is called damaged."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import pytest

from sonarsynth import evaluation, store
from sonarsynth.cli import main
from sonarsynth.planning import Plan
from sonarsynth.schedule import build

FILE = "image/energy/c.1.0.0"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, small_plan: Plan) -> Path:
    """Two shards, the second as a writer has it in hand: data and a scratch file, no mark."""
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    build(small_plan, path, frames=range(16), workers=0)
    (path / ".marks/1.json").rename(path / ".marks/.1.json.7.partial")
    (path / FILE).write_bytes(b"cut sh")
    return path


def test_what_a_build_has_in_hand_is_no_damage_and_it_is_said(copy: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert not store.verify(copy).ok
    with store.lock(copy):
        report = store.verify(copy, [evaluation.check])
        with pytest.raises(SystemExit) as ended:
            main(["verify", str(copy)])
    assert ended.value.code == 0
    assert "being built by process" in capfd.readouterr().out
    assert report.ok and report.building.startswith("process ") and json.dumps(report.as_json())
    assert report.complete == tuple(range(8))
    assert not store.verify(copy).building


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("name", ["signals/pressure/c.0.0.0", ".marks/0.json"])
def test_damage_to_what_is_complete_is_found_all_the_same(copy: Path, name: str, quick: bool) -> None:
    content = bytearray((copy / name).read_bytes())
    content[len(content) // 2] ^= 4
    (copy / name).write_bytes(content)
    (copy / "frame/zarr.json").write_bytes(b"{}")
    with store.lock(copy):
        report = store.verify(copy, quick=quick)
    assert {name, "frame/zarr.json"} <= {problem.where for problem in report.problems}
    assert all(not problem.frames or problem.frames[0] < 8 for problem in report.problems)
    assert report.building and not report.ok and report.complete == ()


@pytest.mark.long
def test_no_frame_is_ever_called_bad_while_shards_are_written_and_written_again(
    tmp_path: Path, small_plan: Plan
) -> None:
    path = tmp_path / "s.zarr"
    build(small_plan, path, frames=[0, 8, 16], workers=0)
    told: list[bool] = []

    def builds() -> None:
        for frames in ([1, 9, 17], [2, 10, 18], None):  # each time, every shard is written anew
            told.append(build(small_plan, path, frames=frames, workers=0).ok)

    thread = threading.Thread(target=builds)
    thread.start()
    looked = []
    while thread.is_alive():
        looked.append(store.verify(path, quick=len(looked) % 2 == 0))
    thread.join()
    assert told == [True] * 3
    assert [problem for report in looked for problem in report.problems] == []
    assert any(report.building for report in looked)
    assert all({0, 8, 16} & set(report.complete) for report in looked)
    assert store.verify(path).complete == tuple(range(20))
