"""Dask clients: of fresh processes on this machine, on loopback alone, or of a running scheduler.

Whoever reaches a Dask scheduler can run code as the one who started it, and every user of a machine reaches its
loopback. So scheduler, workers and client of ours speak TLS, with a key that is made for the run and asked of both
sides; it is handed from process to process through pipes. There is no web server either, unless it is asked for.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import resource
import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import forkserver, resource_tracker
from typing import Any, Final
from urllib.parse import urlsplit

import dask
from distributed import Client, LocalCluster, Security, Worker, WorkerPlugin
from distributed.system import MEMORY_LIMIT

from sonarsynth.store.provenance import differing, numeric_versions

ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of workers: frames run side by side, so a frame runs on one thread (and sums in one order)."""

KEEP_MEMORY: Final = {"MALLOC_TRIM_THRESHOLD_": str(2**28), "MALLOC_MMAP_THRESHOLD_": str(2**28)}
"""Environment of workers: a frame takes its arrays from memory that the last one left. Dask would give that
back (from 64 kB up), and the kernel clear it anew: half of the CPU time of a frame."""

_SETTINGS: Final = {
    "distributed.worker.multiprocessing-method": "forkserver",  # see `_start_forkserver`
    "distributed.nanny.pre-spawn-environ": ONE_THREAD | KEEP_MEMORY,
    "distributed.scheduler.work-stealing": False,  # a shard stays where it is
    "distributed.scheduler.allowed-failures": 1,  # workers that a task may take with it, less one
    "distributed.worker.memory.target": False,  # no spilling: the window bounds memory
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,  # a worker that pauses with finished frames in memory never goes on
    "distributed.worker.memory.terminate": 0.95,
    "distributed.deploy.lost-worker-timeout": "30 days",  # else a worker that is slow to start again is given up
    "distributed.comm.timeouts.connect": "120s",  # all of it is on this machine, which may be very busy
    "distributed.comm.timeouts.tcp": "120s",
    "distributed.admin.log-length": 100,  # logs that would grow for days
    "distributed.admin.low-level-log-length": 100,
    "distributed.admin.system-monitor.log-length": 600,
    "distributed.admin.tick.interval": "1s",  # 20 ms of itself: 3 % of two cores, with the two that follow
    "distributed.admin.system-monitor.interval": "10s",
    "distributed.worker.memory.monitor-interval": "1s",
    "distributed.worker.profile.enabled": False,  # its samples of stacks: 8 MB a worker in each 1000 frames of 13 ms
}

CLOSING: Final = 60.0
"""Seconds for a cluster to close."""

CLOSING_IN_HASTE: Final = 4.0
"""Seconds for a cluster to close when the build was interrupted or failed."""

HEAP: Final = 0.9
"""Part of a worker's memory that its arrays may take: beyond it a frame gets a MemoryError, and the worker lives on."""

NO_PAGES: Final[dict[str, Any]] = {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
"""Settings of a cluster without a dashboard."""


class NoPages(WorkerPlugin):
    """Closes the web server that every worker starts."""

    def setup(self, worker: Worker) -> None:
        """Close it."""
        worker.http_server.stop()


class _Client(Client):
    """A client of a cluster without a dashboard."""

    dashboard_link = ""


class MemoryLimit(WorkerPlugin):
    """Gives a worker process a limit on what it may allocate."""

    def __init__(self, limit: int) -> None:
        self.limit = limit

    def setup(self, worker: Worker) -> None:
        """Set the limit, in a process of the worker's own."""
        if worker.nanny:
            hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
            soft = self.limit if hard == resource.RLIM_INFINITY else min(self.limit, hard)
            resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


class NoScheduler(ConnectionError):
    """Nothing that can be built on answers at an address; str() is one line."""


def check_address(address: str, insecure: bool) -> None:
    """Raise ValueError for a scheduler on another machine without TLS, on which whoever reaches it may run code, and
    for one with TLS where this process has no certificates.
    """
    url = urlsplit(address if "://" in address else f"tcp://{address}")
    if url.scheme in ("tls", "wss"):
        _check_certificates(address)
    elif not insecure and url.scheme != "inproc" and not _loopback(url.hostname or ""):
        raise ValueError(
            f"{address} is not on this machine and not encrypted: use tls://, or --insecure in a network that you trust"
        )


def _check_certificates(address: str) -> None:
    try:
        context = Security().get_connection_args("client").get("ssl_context")
    except (OSError, ValueError) as error:  # ssl.SSLError is one
        raise ValueError(f"{address}: the certificates of Dask's configuration cannot be used: {error}") from None
    if context is None:
        raise ValueError(
            f"{address} needs certificates: ca-file, client.key and client.cert under distributed.comm.tls "
            "in Dask's configuration"
        )


def _loopback(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@contextmanager
def connected(
    workers: int, scheduler: str | None = None, memory: int | None = None, dashboard: bool = False
) -> Iterator[Client]:
    """A client of the scheduler at an address, or of `workers` fresh processes on this machine (loopback only, TLS).

    Each of these may take `memory` bytes (None: its share of the machine's); with `dashboard`, Dask's is shown, HTTP on
    127.0.0.1 for every user of the machine. Raises NoScheduler.
    """
    logging.getLogger("asyncio").addFilter(waited_for)
    if scheduler is not None:
        with _client_of(scheduler) as client:
            yield client
        return
    limit = memory or MEMORY_LIMIT // max(workers, 1)
    with dask.config.set(_SETTINGS | ({} if dashboard else NO_PAGES)):
        with _interrupts_put_off() as interrupted:
            try:
                cluster = _local_cluster(workers, limit, dashboard)
            except RuntimeError:  # a worker was killed while it started; or none can, and the second says so
                cluster = _local_cluster(workers, limit, dashboard)
            kind: Any = Client if dashboard else _Client
            client = kind(cluster, set_as_default=False)
        patience = CLOSING_IN_HASTE
        try:
            if interrupted:
                raise KeyboardInterrupt
            yield client
            patience = CLOSING
        finally:
            with _interrupts_put_off():  # what does not close in time ends with this process
                with suppress(TimeoutError):
                    client.close(timeout=patience)
                with suppress(TimeoutError):
                    cluster.close(timeout=patience)


def waited_for(record: logging.LogRecord) -> bool:
    """Whether a log record is no task of distributed that failed when nobody waited for it any more, as where a build
    is interrupted: Python prints a traceback of these when it collects them."""
    kind = record.exc_info[0] if record.exc_info else None
    return kind is None or kind.__module__.partition(".")[0] != "distributed"


def _client_of(scheduler: str) -> Client:
    try:
        client = Client(scheduler, set_as_default=False)
    except (OSError, ValueError) as error:
        raise NoScheduler(f"{scheduler}: no Dask scheduler answers there: {' '.join(str(error).split())}") from error
    ours = numeric_versions()
    for worker, theirs in client.run(numeric_versions).items():
        odd = differing(theirs, ours)
        if odd:
            client.close()
            raise NoScheduler(f"{worker} has other libraries than this process: {odd}: frames would differ")
    return client


def _local_cluster(workers: int, memory: int, dashboard: bool) -> LocalCluster:
    limit = MemoryLimit(int(HEAP * memory))
    _require_loopback()
    _start_forkserver()
    try:
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            security=Security.temporary(),
            dashboard_address="127.0.0.1:0",
            worker_dashboard_address="127.0.0.1:0",
            scheduler_kwargs={"dashboard": dashboard},
            memory_limit=memory,
            plugins=(limit,) if dashboard else (limit, NoPages()),
            silence_logs=logging.CRITICAL,
            env=dict(os.environ) | ONE_THREAD,
        )
    except RuntimeError as error:  # workers import the script that builds, which must not build again
        raise RuntimeError(
            'no worker process could start: in a script, build under `if __name__ == "__main__":`, or with workers=0'
        ) from error
    if not dashboard:
        started: Any = cluster
        started.loop.add_callback(started.scheduler.http_server.stop)  # every scheduler starts a web server
    return cluster


def _require_loopback() -> None:
    """Raise NoScheduler where this machine has no 127.0.0.1, as containers without a network do not."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as server:  # one that is down takes an address, and no connection
            socket.create_connection(server.getsockname(), timeout=10.0).close()
    except OSError as error:
        raise NoScheduler(
            f"worker processes need a loopback interface, and 127.0.0.1 is not there ({error.strerror}): bring it up "
            "('ip link set lo up'), or build with --workers 0"
        ) from None


@contextmanager
def _interrupts_put_off() -> Iterator[list[int]]:
    """Put SIGINT and SIGTERM off, and give those that came: a cluster half started or half closed leaves processes.

    SIGINT is blocked besides, which workers that start meanwhile inherit: Ctrl-C goes to the whole group.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in handlers.items():
        if handler not in (signal.SIG_IGN, None):
            signal.signal(number, lambda number, frame: came.append(number))
    _start_tracker()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield came
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in handlers.items():
            if handler is not None:
                signal.signal(number, handler)


def _start_forkserver() -> None:
    """Start the process that workers are forked from, once: it has imported what they need, which each would take
    seconds for. It ends with this process. What allocates memory reads its settings when a process starts.
    """
    forkserver.set_forkserver_preload(["distributed", "sonarsynth.schedule.tasks"])
    with _environment(ONE_THREAD | KEEP_MEMORY):
        forkserver.ensure_running()


def _start_tracker() -> None:
    """Start the resource tracker of multiprocessing: its start, in whichever thread, unblocks SIGINT.

    What workers that were ended in haste leave, it removes, and should not warn of after our last line.
    """
    warnings = ",".join(filter(None, [os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker"]))
    with _environment({"PYTHONWARNINGS": warnings}):
        resource_tracker.ensure_running()


@contextmanager
def _environment(changed: dict[str, str]) -> Iterator[None]:
    """Variables that processes started meanwhile have."""
    before = {name: os.environ.get(name) for name in changed}
    os.environ.update(changed)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
