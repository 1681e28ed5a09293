"""Shards on Dask workers: a window of them at a time, all tasks of a shard on one worker, memory bounded."""

from __future__ import annotations

import hashlib
import logging
import signal
import threading
import uuid
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from queue import Empty, SimpleQueue
from typing import Any, Final

import dask
from distributed import Client, Future, KilledWorker, LocalCluster

from sonarsynth.schedule import tasks
from sonarsynth.schedule.tasks import Failure, Job, Step, Written

SHARDS_AHEAD: Final = 3
"""Shards in flight for each worker: one being written, one being rendered, one to come."""

MAX_LOSSES: Final = 2
"""A shard whose workers died this often is put off to the end, and its frames are tried alone."""

ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
"""Environment of workers: frames run side by side, so a frame runs on one thread (and sums in one order)."""

KEEP_MEMORY: Final = {"MALLOC_TRIM_THRESHOLD_": str(2**28), "MALLOC_MMAP_THRESHOLD_": str(2**28)}
"""Environment of workers: a frame takes its arrays from memory that the last one left. Dask would give that
back (from 64 kB up), and the kernel clear it anew: half of the CPU time of a frame."""

_SETTINGS: Final = {
    "distributed.nanny.pre-spawn-environ": ONE_THREAD | KEEP_MEMORY,
    "distributed.scheduler.work-stealing": False,  # a shard stays where it is
    "distributed.scheduler.allowed-failures": 1,  # workers that a task may take with it, less one
    "distributed.worker.memory.target": False,  # no spilling: the window bounds memory
    "distributed.worker.memory.spill": False,
}


@contextmanager
def connected(workers: int, scheduler: str | None = None) -> Iterator[Client]:
    """A client of the scheduler at an address, or of `workers` fresh processes on this machine (loopback only)."""
    if scheduler is not None:
        with Client(scheduler, set_as_default=False) as client:
            yield client
        return
    with dask.config.set(_SETTINGS):
        with _interrupts_put_off() as interrupted:
            cluster = _local_cluster(workers)
            client = Client(cluster, set_as_default=False)
        try:
            if interrupted:
                raise KeyboardInterrupt
            yield client
        finally:
            with _interrupts_put_off():
                client.close(timeout=2)
                cluster.close(timeout=5)


def _local_cluster(workers: int) -> LocalCluster:
    try:
        return LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
            env=ONE_THREAD,
        )
    except RuntimeError as error:  # workers import the script that builds, which must not build again
        raise RuntimeError(
            'no worker process could start: in a script, build under `if __name__ == "__main__":`, or with workers=0'
        ) from error


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
    resource_tracker.ensure_running()  # its start, in whichever thread, unblocks SIGINT
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield came
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number, handler in handlers.items():
            if handler is not None:
                signal.signal(number, handler)


@dataclass(frozen=True)
class _Flight:
    """A shard in flight."""

    shard: int
    frames: tuple[int, ...]
    worker: str = ""
    losses: int = 0  # workers that died with it
    aside: tuple[Failure, ...] = ()  # frames that are left out because they end their worker


class _Builder:
    """Submits shards of one job in a window, and hands over what comes back."""

    def __init__(self, client: Client, job: Job, done: Callable[[Written], None]) -> None:
        self.client, self.job, self.done = client, job, done
        self.token = hashlib.sha256(f"{job} {uuid.uuid4()}".encode()).hexdigest()[:12]
        self.frames = 0  # submitted so far: earlier ones go first
        self.submitted = 0  # shards, with those submitted again
        self.flights: dict[Future[Any], _Flight] = {}
        self.landed: SimpleQueue[Future[Any]] = SimpleQueue()

    def run(self, todo: Mapping[int, tuple[int, ...]]) -> None:
        """Build all shards. Those that lost workers come again at the end, without the frames that end a worker."""
        for suspect in self._pass([_Flight(shard, frames) for shard, frames in todo.items()]):
            aside = tuple(failure for frame in suspect.frames if (failure := self._alone(frame)) is not None)
            good = tuple(sorted(set(suspect.frames) - {failure.frame for failure in aside}))
            for again in self._pass([_Flight(suspect.shard, good, aside=aside)]):
                died = [Failure(f, "shard", "its worker died while the shard was written", "") for f in again.frames]
                self.done(Written(again.shard, (), (*aside, *died), (), 0.0, 0, 0))

    def _pass(self, flights: Sequence[_Flight]) -> list[_Flight]:
        """Run shards through the window. Returns those that lost their workers, raises what went wrong in writing."""
        waiting = deque(flights)
        suspects: list[_Flight] = []
        while waiting or self.flights:
            workers = self._workers()
            for future, flight in list(self.flights.items()):
                if flight.worker not in workers:
                    self.flights.pop(future)
                    future.cancel()
                    again = replace(flight, losses=flight.losses + 1)
                    (suspects if again.losses >= MAX_LOSSES else waiting).append(again)
            while waiting and workers and len(self.flights) < SHARDS_AHEAD * len(workers):
                self._launch(waiting.popleft(), workers)
            landed = self._next()
            if landed is None or landed not in self.flights:
                continue
            flight = self.flights.pop(landed)
            try:
                written: Written = landed.result()
            except KilledWorker:
                suspects.append(flight)
            else:
                self.done(replace(written, failures=(*flight.aside, *written.failures)))
        return suspects

    def _next(self) -> Future[Any] | None:
        """The next shard that came back; None after a moment without any."""
        try:
            return self.landed.get(timeout=1.0)
        except Empty:
            return None

    def _workers(self) -> list[str]:
        return sorted(self.client.nthreads())

    def _launch(self, flight: _Flight, workers: Sequence[str]) -> None:
        load = Counter(f.worker for f in self.flights.values())
        flight = replace(flight, worker=min(workers, key=lambda w: load[w]))
        future = self._submit(flight)
        self.flights[future] = flight
        future.add_done_callback(self.landed.put)

    def _submit(self, flight: _Flight) -> Future[Any]:
        """The tasks of a shard, all on its worker, later stages of earlier frames first."""
        self.submitted += 1
        token, steps = f"{self.token}.{self.submitted}", []
        for frame in flight.frames:
            self.frames += 1
            first = -len(tasks.STAGES) * self.frames
            traced = self._task(tasks.trace, frame, key=f"trace-{token}-{frame}", priority=first, flight=flight)
            heard = self._task(
                tasks.beamform, traced, key=f"beamform-{token}-{frame}", priority=first + 1, flight=flight
            )
            steps.append(
                self._task(tasks.range_, heard, key=f"range-{token}-{frame}", priority=first + 2, flight=flight)
            )
        return self._task(
            tasks.write, flight.shard, steps, key=f"shard-{token}-{flight.shard}", priority=1, flight=flight
        )

    def _task(
        self, function: Callable[..., Any], *arguments: Any, key: str, priority: int, flight: _Flight
    ) -> Future[Any]:
        return self.client.submit(
            function, self.job, *arguments, key=key, priority=priority, workers=[flight.worker], pure=False
        )

    def _alone(self, frame: int) -> Failure | None:
        """Render a frame with nothing else in flight: the failure where it ends its worker."""
        future = self.client.submit(_probe, self.job, frame, key=f"alone-{self.token}-{frame}", pure=False)
        error = future.exception()
        if error is None:
            return None
        return Failure(frame, "frame", "it ends its worker process: out of memory, or a crash", str(error))


def _probe(job: Job, frame: int) -> None:
    """Render a frame and forget it."""
    step: Step = tasks.render_frame(job, frame)
    del step


def run(client: Client, job: Job, todo: Mapping[int, tuple[int, ...]], done: Callable[[Written], None]) -> None:
    """Build shards on the workers of a client; `done` is called as each is written. Raises what writing raises."""
    _Builder(client, job, done).run(todo)
