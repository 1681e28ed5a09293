"""A worker may die at the one moment when its shard is done and nobody has fetched what it gives."""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import Client, LocalCluster, Worker, WorkerPlugin
from distributed.client import AllExit

from sonarsynth.planning import Plan
from sonarsynth.schedule import build
from sonarsynth.schedule.cluster import register
from sonarsynth.schedule.connecting import waited_for
from sonarsynth.store.files.place import record
from sonarsynth.store.marks import all_files, load_mark, marked
from tests.waiting import HANGING, wait_until
from tools.fault_injection.processes import workers_of


class Striking:
    """Progress of a build that, once, stops its only worker when all shards are on the disk, and kills it later."""

    def __init__(self, path: Path, shards: int) -> None:
        self.path, self.shards, self.struck = path, shards, 0

    def __call__(self, done: int, total: int, failed: int) -> None:
        if self.struck or not done:
            return
        wait_until(lambda: len(marked(self.path)) >= self.shards)
        time.sleep(0.5)  # the scheduler hears that they are done
        (worker,) = workers_of(psutil.Process())
        worker.send_signal(signal.SIGSTOP)
        threading.Timer(2.0, worker.kill).start()
        self.struck = worker.pid


@pytest.mark.long
def test_a_worker_that_dies_with_what_its_last_shards_gave_does_not_hold_the_build_up(
    tmp_path: Path, small_plan: Plan
) -> None:
    whole, path = tmp_path / "whole.zarr", tmp_path / "s.zarr"
    assert build(small_plan, whole, workers=0).ok
    strike = Striking(path, len(marked(whole)))
    assert strike.shards > 1
    reports: list[Any] = []
    thread = threading.Thread(
        target=lambda: reports.append(build(small_plan, path, workers=1, progress=strike)), daemon=True
    )
    thread.start()
    thread.join(HANGING)
    assert not thread.is_alive(), "the build hangs"
    assert strike.struck
    assert reports[0].ok
    assert {shard: load_mark(path, shard) for shard in marked(path)} == {
        shard: load_mark(whole, shard) for shard in marked(whole)
    }
    chunks = {name for name in all_files(whole) if not name.endswith("zarr.json")}
    assert {name: record(path, name) for name in chunks} == {name: record(whole, name) for name in chunks}


class Ending(WorkerPlugin):
    """Ends the first worker process that it is given to."""

    def __init__(self, struck: Path) -> None:
        self.struck = struck

    def setup(self, worker: Worker) -> None:
        """End this process, if none has ended yet."""
        try:
            self.struck.touch(exist_ok=False)
        except FileExistsError:
            return
        os._exit(1)


@pytest.mark.long
def test_a_worker_that_ends_as_it_is_given_the_plan_ends_no_build(tmp_path: Path) -> None:
    """The others have it, and the one in its place."""
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        register(client, Ending(tmp_path / "struck"))
        assert (tmp_path / "struck").exists()
        wait_until(lambda: len(client.scheduler_info()["workers"]) == 2)
        assert all(
            client.run(lambda dask_worker: any("Ending" in str(type(p)) for p in dask_worker.plugins.values())).values()
        )


@pytest.mark.parametrize(("error", "told"), [(AllExit(), 0), (ValueError("ours"), 1)])
def test_a_task_of_dask_that_nobody_waits_for_any_more_is_no_traceback(
    error: Exception, told: int, caplog: pytest.LogCaptureFixture
) -> None:
    async def fail() -> None:
        raise error

    async def leave() -> None:
        asyncio.ensure_future(fail())  # noqa: RUF006  collected, and logged, without being asked for
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        gc.collect()

    log = logging.getLogger("asyncio")
    log.addFilter(waited_for)
    try:
        asyncio.run(leave())
        gc.collect()
    finally:
        log.removeFilter(waited_for)
    assert len(caplog.records) == told
