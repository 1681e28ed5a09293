"""Frames that hang, crash or take all memory cost themselves alone; workers, disks and schedulers may fail."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import dask
import numpy as np
import psutil
import pytest
import zarr
from distributed import LocalCluster

from sonarsynth import store
from sonarsynth.planning import Plan
from sonarsynth.recipe import Recipe
from sonarsynth.schedule import TooLarge, build, connecting, disk_space
from sonarsynth.store.files import lock
from sonarsynth.store.files.json_lines import read_lines
from tests.waiting import wait_until

FAULTS = """\
import faulthandler, time
import numpy as np
from sonarsynth import pipeline as render
works = getattr(render.beamform_frame, "works", render.beamform_frame)  # preloaded more than once
def fails(made, index, *parts):
    if index == 2:
        time.sleep(1e4)
    if index == 5:
        faulthandler._sigsegv()
    if index == 9:
        np.ones(10**11)  # more than any worker may take
    if index == 17:
        raise ZeroDivisionError("no way")
    return works(made, index, *parts)
fails.works = works
render.beamform_frame = fails
"""


def different(path: Path, reference: Path, frames: list[int] | None = None) -> list[str]:
    """Arrays that are not the same, bit for bit, in the frames given."""
    ours, theirs = zarr.open_group(path, mode="r"), zarr.open_group(reference, mode="r")
    chosen = slice(None) if frames is None else frames
    return [
        name
        for name, array in ours.members(max_depth=None)
        if isinstance(array, zarr.Array)
        and "frame" in (array.metadata.dimension_names or ())
        and np.asarray(array[...])[chosen].tobytes() != np.asarray(theirs[name][...])[chosen].tobytes()
    ]


def listening() -> set[str]:
    """Addresses that this process and those that it started listen on."""
    us = psutil.Process()
    found = [c for process in (us, *us.children(recursive=True)) for c in process.net_connections(kind="tcp")]
    return {connection.laddr.ip for connection in found if connection.status == psutil.CONN_LISTEN}


@pytest.mark.long
def test_frames_that_end_their_worker_are_named_with_why_and_the_rest_goes_on(
    tmp_path: Path, small_plan: Plan, reference: Path
) -> None:
    faults, path = tmp_path / "faults.py", tmp_path / "s.zarr"
    faults.write_text(FAULTS)
    addresses: set[str] = set()
    dashboards: list[str] = []

    def look(dashboard: str) -> None:
        dashboards.append(dashboard)
        addresses.update(listening())

    with dask.config.set({"distributed.worker.preload": [str(faults)]}):
        report = build(small_plan, path, workers=1, frame_timeout=20.0, dashboard=True, announce=look)
    found = {failure.frame: failure for failure in report.failures}
    assert sorted(found) == [2, 5, 9, 17]
    assert {failure.stage for failure in found.values()} == {"beamform"}
    assert "longer than 20 s" in found[2].error
    assert "crashed its worker process: Fatal Python error" in found[5].error
    assert "MemoryError" in found[9].error
    assert found[17].error == "ZeroDivisionError: no way"
    assert all("in fails" in failure.traceback for failure in found.values())
    good = [frame for frame in range(20) if frame not in found]
    assert store.frames_there(path) == good
    assert different(path, reference, good) == []
    assert report.workers_lost >= 2
    assert dashboards == [report.dashboard]
    assert report.dashboard.partition("//")[2].startswith("127.0.0.1:")
    assert addresses == {"127.0.0.1"}
    events = [row["event"] for row in read_lines(store.beside(path, "log.jsonl"))]
    assert events.count("failed") == 4
    assert events[0] == "build"
    assert events[-1] == "end"
    assert {"workers", "worker lost"} <= set(events)
    assert not store.beside(path, "doing").exists()
    again = build(small_plan, path, workers=0)
    assert (again.written, len(again.failures)) == (0, 4)
    assert build(small_plan, path, workers=0, retry_failed=True).ok
    assert different(path, reference) == []


STUCK = """\
import time
from sonarsynth import pipeline as render
works = getattr(render.beamform_frame, "works", render.beamform_frame)  # preloaded more than once
def stuck(made, index, *parts):
    while index >= 8:
        time.sleep(1)
    return works(made, index, *parts)
stuck.works = works
render.beamform_frame = stuck
"""


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A Dask scheduler, with a worker that comes no further than the first shard, as processes of their own.

    It has a thread for each shard: in one alone, a later shard may be stuck before the first is written.
    """
    file, preload = tmp_path / "scheduler.json", tmp_path / "stuck.py"
    preload.write_text(STUCK)
    common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]
    parts = {"scheduler": ["--port", "0"], "worker": ["--nthreads", "4", "--no-nanny", "--preload", str(preload)]}
    with ExitStack() as stack:
        processes = []
        for name, options in parts.items():
            command = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.dask_{name}", *common, *options]
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.kill)
            processes.append(process)
        wait_until(lambda: file.exists() and file.read_text().endswith("}"), lambda: processes[0].poll() is None)
        yield processes[0], json.loads(file.read_text())["address"]


@pytest.mark.long
def test_a_scheduler_that_dies_ends_the_build_in_one_line_and_it_goes_on(
    tmp_path: Path, small_plan: Plan, reference: Path, elsewhere: tuple[subprocess.Popen[bytes], str]
) -> None:
    scheduler, address = elsewhere
    path = tmp_path / "s.zarr"

    def kill(done: int, total: int, failed: int) -> None:
        if done:
            scheduler.kill()

    with pytest.raises(ConnectionError, match="is gone"):
        build(small_plan, path, scheduler=address, progress=kill)
    assert not store.beside(path, "lock").exists()
    assert store.frames_there(path) == list(range(8))
    assert build(small_plan, path, workers=0).ok
    assert different(path, reference) == []


@pytest.mark.parametrize(
    ("address", "fine"),
    [
        ("tcp://127.0.0.1:8786", True),
        ("localhost:8786", True),
        ("tcp://[::1]:8786", True),
        ("tcp://10.1.2.3:8786", False),
        ("node7:8786", False),
        ("tcp://0.0.0.0:8786", False),
        ("ws://example.org", False),
    ],
)
def test_a_scheduler_elsewhere_needs_tls_or_consent(address: str, fine: bool) -> None:
    connecting.check_address(address, True)
    if fine:
        connecting.check_address(address, False)
    else:
        with pytest.raises(ValueError, match="--insecure"):
            connecting.check_address(address, False)


def test_what_does_not_fit_is_refused_before_anything_is_written_unless_agreed(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(disk_space.shutil, "disk_usage", lambda place: shutil._ntuple_diskusage(10**9, 10**9, 1000))
    with pytest.raises(TooLarge, match=r"needs up to [\d.]+ [kM]B and 1 kB are free: use --yes"):
        build(small_plan, tmp_path / "s.zarr", workers=0)
    assert list(tmp_path.iterdir()) == []
    assert build(small_plan, tmp_path / "s.zarr", frames=[0], workers=0, agreed=True).ok
    monkeypatch.setattr(disk_space.shutil, "disk_usage", lambda place: shutil._ntuple_diskusage(10**15, 0, 10**15))
    huge = replace(small_plan, stages=tuple(replace(s, bytes=10**12) for s in small_plan.stages))
    with pytest.raises(TooLarge, match=r"a worker takes up to [\d.]+ TB of memory, and each of 1 has"):
        build(huge, tmp_path / "h.zarr", workers=0)
    with pytest.raises(TooLarge, match=r"needs up to [\d.]+ TB \("):
        build(huge, tmp_path / "h.zarr", workers=0, worker_memory=10**15)
    long = replace(small_plan, sizes=small_plan.sizes | {"sample": 10**8})
    kept = 24 + 4 * len(("noise", "echoes of the target"))  # bytes a sample
    needed = f"{0.3 + kept * small_plan.sizes['sensor'] * 0.1:.1f}"
    with pytest.raises(TooLarge, match=rf"a worker takes up to {needed} GB of memory, and each of 2 has .*"):
        build(long, tmp_path / "l.zarr", workers=2)
    assert not (tmp_path / "l.zarr").exists()
    monkeypatch.setattr(disk_space.os, "statvfs", lambda place: SimpleNamespace(f_files=100, f_favail=3))
    with pytest.raises(TooLarge, match=r"needs up to \d+ files and folders and 3 more fit there: use --yes"):
        build(small_plan, tmp_path / "i.zarr", workers=0)


FILLING = """
import subprocess, sys
from sonarsynth import cli
from sonarsynth.cli.running import run

recipe, disk, kept = sys.argv[1:]


def build(*options):
    return run(cli.app, ["build", recipe, f"{disk}/s.zarr", "--workers", "0", "--no-predict", *options])


def shell(command):
    subprocess.run(command, shell=True, check=True)


shell(f"mount -t tmpfs -o size=9m none {disk}")
found = [build("--frames", "0:1", "--yes")]
shell(f"dd if=/dev/zero of={disk}/ballast 2>/dev/null || true")
found.append(build("--yes"))
shell(f"mount -o remount,ro {disk}")
found.append(build("--yes"))
shell(f"mount -o remount,rw {disk}; rm {disk}/ballast")
found.append(build())
shell(f"cp -r {disk}/s.zarr {kept}")
print(*found)
"""
"""One process for all builds: each takes seconds to start."""


def in_namespace(script: str) -> subprocess.CompletedProcess[str]:
    """Run a shell script where it may mount."""
    return subprocess.run(["unshare", "-rm", "sh", "-euc", script], capture_output=True, text=True, check=False)


@pytest.mark.long
def test_a_disk_that_takes_no_more_is_one_line_and_the_build_goes_on(
    tmp_path: Path, small_file: Path, reference: Path
) -> None:
    if shutil.which("unshare") is None or in_namespace(f"mount -t tmpfs none {tmp_path}").returncode:
        pytest.skip("may not mount a disk here")
    disk = tmp_path / "disk"
    disk.mkdir()
    (tmp_path / "filling.py").write_text(FILLING)
    done = in_namespace(f"{sys.executable} {tmp_path}/filling.py {small_file} {disk} {tmp_path}")
    assert done.stdout.splitlines()[-1:] == ["0 1 1 0"], done.stdout + done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("sonarsynth: ")]
    assert len(lines) == 2
    assert "No space left" in lines[0]
    assert "read-only" in lines[1]
    assert all("run the same command again to resume" in line and "are free" in line for line in lines)
    assert "Traceback" not in done.stderr
    assert different(tmp_path / "s.zarr", reference) == []


def test_nothing_is_left_of_a_claim_whose_writer_is_killed_as_the_build_ends(tmp_path: Path) -> None:
    path = tmp_path / "s.zarr"
    writing = (
        "import sys, time\nfrom sonarsynth import store\n"
        "with store.shared_lock(*sys.argv[1:]):\n    print('writes', flush=True)\n    time.sleep(600)"
    )
    claim = store.beside(path, "lock")
    with store.lock(path) as name:
        writer = subprocess.Popen([sys.executable, "-c", writing, str(path), name], stdout=subprocess.PIPE, text=True)
        assert writer.stdout is not None and writer.stdout.readline() == "writes\n"
        killing = threading.Thread(target=lambda: (wait_until(lambda: not claim.read_bytes()), writer.kill()))
        killing.start()
    killing.join()
    writer.communicate()
    assert not claim.exists()


def test_the_next_build_waits_for_a_writer_that_outlived_its_own_and_that_writer_then_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lock, "ENDING", 0.1)
    path = tmp_path / "s.zarr"
    with store.lock(path) as name, store.shared_lock(path, name):
        pass
    with store.lock(path) as name:
        held = store.shared_lock(path, name)
        held.__enter__()
    with pytest.raises(store.StoreLocked, match="still writing"), store.lock(path, wait=0.1):
        pass
    ended: list[bool] = []

    def end() -> None:
        ended.append(True)
        held.__exit__(None, None, None)

    threading.Timer(0.3, end).start()
    with store.lock(path, wait=600.0) as now:
        assert ended
        with pytest.raises(store.BuildEnded, match="has ended"), store.shared_lock(path, name):
            pass
        with store.shared_lock(path, now):
            pass
    with pytest.raises(store.BuildEnded), store.shared_lock(path, now):
        pass


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"frame_timeout": -1.0}, "frame_timeout"),
        ({"frame_timeout": float("nan")}, "frame_timeout"),
        ({"worker_memory": 1000}, "worker_memory"),
        ({"scheduler": "tcp://10.1.2.3:1"}, "--insecure"),
    ],
)
def test_options_that_cannot_be_are_refused(
    tmp_path: Path, small_plan: Plan, options: dict[str, object], what: str
) -> None:
    with pytest.raises(ValueError, match=what):
        build(small_plan, tmp_path / "s.zarr", **options)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_another_code_is_shown_and_refused(tmp_path: Path, small: Recipe, monkeypatch: pytest.MonkeyPatch) -> None:
    build(small, tmp_path / "s.zarr", frames=[0], workers=0)
    monkeypatch.setattr("sonarsynth.store.creating.code_digest", lambda: "f" * 64)
    with pytest.raises(store.Mismatch, match=r"digest of the code: [0-9a-f]{12}, now f{12}"):
        build(small, tmp_path / "s.zarr", workers=0)


def test_a_disk_error_that_is_not_about_room_stays_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with (
        pytest.raises(OSError, match="I/O") as raised,
        disk_space.told_when_full(tmp_path, lambda: disk_space.DiskRoom(1.0, 1)),
    ):
        raise OSError(errno.EIO, "I/O error")
    assert raised.value.errno == errno.EIO
    for number in disk_space.FULL:
        with (
            pytest.raises(OSError, match=r"up to 5 GB more are needed, .* are free"),
            disk_space.told_when_full(tmp_path, lambda: disk_space.DiskRoom(5e9, 1)),
        ):
            raise OSError(number, os.strerror(number))
    monkeypatch.setattr(disk_space.shutil, "disk_usage", lambda place: shutil._ntuple_diskusage(10**15, 0, 10**15))
    monkeypatch.setattr(disk_space.os, "statvfs", lambda place: SimpleNamespace(f_files=100, f_favail=3))
    with (
        pytest.raises(OSError, match="up to 80 more files and folders are needed, 3 more fit"),
        disk_space.told_when_full(tmp_path, lambda: disk_space.DiskRoom(1.0, 80)),
    ):
        raise OSError(errno.ENOSPC, "No space left")


def test_threads_of_this_process_are_not_limited(tmp_path: Path, small_plan: Plan, reference: Path) -> None:
    """A worker without a nanny keeps no diary: its process is not its own."""
    with LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", host="127.0.0.1", dashboard_address=":0"
    ) as threads:
        report = build(small_plan, tmp_path / "s.zarr", scheduler=threads.scheduler_address, frame_timeout=1e-3)
    assert report.ok
    assert different(tmp_path / "s.zarr", reference) == []


def test_a_machine_without_loopback_is_told_so(
    tmp_path: Path, small_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object, **__: object) -> None:
        raise OSError(errno.EADDRNOTAVAIL, "Cannot assign requested address")

    monkeypatch.setattr(connecting.socket, "create_server", none)
    with pytest.raises(connecting.NoScheduler, match=r"need a loopback interface.*--workers 0"):
        build(small_plan, tmp_path / "s.zarr", workers=1)
