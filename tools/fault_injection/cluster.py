"""A Dask scheduler and a worker as processes of their own, started again after they were killed."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

import psutil


class Cluster:
    """Starts when its address is first asked for; ends with its context."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        self.found = ""

    def address(self) -> str:
        """Address of the scheduler."""
        if not self.processes:
            self._start()
        return self.found

    def kill_scheduler(self) -> None:
        """SIGKILL; the worker goes after it."""
        self.processes[0].kill()
        self._end()

    def _start(self) -> None:
        file = self.folder / "scheduler.json"
        file.unlink(missing_ok=True)
        kinds = {"dask_scheduler": ["--port", "0"], "dask_worker": ["--nthreads", "1"]}
        for name, options in kinds.items():
            module = [sys.executable, "-W", "ignore", "-m", f"distributed.cli.{name}"]
            common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]
            with (self.folder / f"{name}.txt").open("a") as log:
                self.processes.append(subprocess.Popen([*module, *common, *options], stdout=log, stderr=log))
        until = time.monotonic() + 600.0
        while time.monotonic() < until:
            try:
                self.found = json.loads(file.read_text())["address"]
                return
            except (OSError, ValueError):
                time.sleep(0.05)
        raise RuntimeError("no Dask scheduler started")

    def _end(self) -> None:
        for process in reversed(self.processes):
            with suppress(psutil.NoSuchProcess):
                children = psutil.Process(process.pid).children(recursive=True)
                process.kill()
                for child in children:
                    with suppress(psutil.NoSuchProcess):
                        child.kill()
                psutil.wait_procs(children)
            process.wait()
        self.processes = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._end()
