"""What a worker notes of itself: the stage that it is in, and the limit after which it ends."""

from __future__ import annotations

import faulthandler
import os
from pathlib import Path

import pytest

from sonarsynth.schedule import worker_status


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The diary of this process, as if it were a worker."""
    path = tmp_path / "s.zarr.doing" / "worker"
    path.parent.mkdir()
    handle = os.open(path, os.O_RDWR | os.O_CREAT)
    os.lseek(handle, worker_status.HEAD, os.SEEK_SET)
    monkeypatch.setattr(worker_status, "_mine", lambda store: handle)
    return path


def test_the_last_stage_that_began_is_noted_until_its_task_ends(tmp_path: Path, file: Path) -> None:
    store = str(tmp_path / "s.zarr")
    with worker_status.diary(store) as note:
        for frame, stage in ((100_000, "beamform"), (7, "trace")):
            note(frame, stage, 0.0, 0.0)
            assert worker_status.read(store, file.name) == worker_status.Entry(frame, stage, "", "")
    assert worker_status.read(store, file.name) is None


def test_a_limit_is_set_once_for_many_stages_and_never_ends_one_too_soon(
    tmp_path: Path, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, ends, events = 0.0, [0.0], list[str]()
    monkeypatch.setattr(worker_status.time, "monotonic", lambda: now)

    def set_limit(seconds: float, **options: object) -> None:
        events.append("set")
        ends[0] = now + seconds

    monkeypatch.setattr(faulthandler, "dump_traceback_later", set_limit)
    monkeypatch.setattr(faulthandler, "cancel_dump_traceback_later", lambda: events.append("cancelled"))
    with worker_status.diary(str(tmp_path / "s.zarr")) as note:
        for n in range(100):
            limit = 20.0 if n < 60 else 5.0
            note(n, "trace", limit, 0.0)
            assert limit <= ends[0] - now <= worker_status.LATEST * limit
            now += 0.05
    assert events[-1] == "cancelled"
    assert events.count("set") < 10
