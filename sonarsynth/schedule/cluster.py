"""Shards on Dask workers: a window of them at a time, all tasks of a shard on one worker, memory bounded."""

from __future__ import annotations

import errno
import hashlib
import math
import time
import uuid
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from queue import Empty, SimpleQueue
from typing import Any, Final

from distributed import Client, Future, KilledWorker, Worker, WorkerPlugin

from sonarsynth.planning import Plan
from sonarsynth.schedule import tasks, worker_status
from sonarsynth.schedule.tasks import Failure, Job, StageResult, WrittenShard

SHARDS_AHEAD: Final = 3
"""Shards in flight for each worker: one being written, one being rendered, one to come."""

LANDING: Final = 5.0
"""Seconds to wait for what a finished shard gives: where its worker dies just then, Dask waits for that for ever."""

TRIES: Final = 5
"""Times that a plan is given to all workers, while some of them end."""

MAX_LOSSES: Final = 2
"""A shard whose workers died this often is put off to the end, and its frames are tried alone."""


@dataclass(frozen=True)
class _Flight:
    """A shard in flight."""

    shard: int
    frames: tuple[int, ...]
    worker: str = ""
    losses: int = 0  # workers that died with it
    failed: tuple[Failure, ...] = ()  # frames that are left out because they end their worker
    last: bool = False  # it does not come again


def _without(flight: _Flight, entry: worker_status.Entry | None) -> _Flight:
    """A shard after its worker ended."""
    if entry is not None and entry.frame not in flight.frames:
        return flight
    if entry is None or not entry.error:
        return replace(flight, losses=flight.losses + 1)
    failure = Failure(entry.frame, entry.stage, entry.error, entry.traceback)
    frames = tuple(frame for frame in flight.frames if frame != entry.frame)
    return replace(flight, frames=frames, failed=(*flight.failed, failure))


class _Builder:
    """Submits shards of one job in a window, and hands over what comes back."""

    def __init__(
        self,
        client: Client,
        job: Job,
        done: Callable[[WrittenShard], None],
        lost: Callable[[str, str], None] = lambda worker, why: None,
        patience: float = math.inf,
    ) -> None:
        self.client, self.job, self.done, self.lost = client, job, done, lost
        self.patience, self.seen = patience, time.monotonic()  # s without any worker; when there was one
        self.token = hashlib.sha256(f"{job} {uuid.uuid4()}".encode()).hexdigest()[:12]
        self.frames = 0  # submitted so far: earlier ones go first
        self.submitted = 0  # shards, with those submitted again
        self.flights: dict[Future[Any], _Flight] = {}
        self.landed: SimpleQueue[Future[Any]] = SimpleQueue()

    def run(self, todo: Mapping[int, tuple[int, ...]]) -> None:
        """Build all shards. Those that lost workers come again at the end, without the frames that end a worker."""
        for suspect in self._pass([_Flight(shard, frames) for shard, frames in todo.items()]):
            failed = tuple(failure for frame in suspect.frames if (failure := self._alone(frame)) is not None)
            good = tuple(sorted(set(suspect.frames) - {failure.frame for failure in failed}))
            last = _Flight(suspect.shard, good, failed=(*suspect.failed, *failed), last=True)
            for again in self._pass([last]):
                died = [Failure(f, "shard", "its worker died while the shard was written", "") for f in again.frames]
                self.done(WrittenShard(again.shard, (), (*again.failed, *died), (), 0.0, 0, 0))

    def _pass(self, flights: Sequence[_Flight]) -> list[_Flight]:
        """Run shards through the window. Returns those that lost their workers, raises what went wrong in writing."""
        waiting = deque(flights)
        suspects: list[_Flight] = []
        while waiting or self.flights:
            workers = self._workers()
            for worker in {flight.worker for flight in self.flights.values()} - set(workers):
                for again in self._left_by(worker):
                    (suspects if again.losses >= MAX_LOSSES else waiting).append(again)
            while waiting and workers and len(self.flights) < SHARDS_AHEAD * len(workers):
                self._launch(waiting.popleft(), workers)
            landed = self._next()
            if landed is None or landed not in self.flights:
                continue
            flight = self.flights[landed]
            try:
                written = self._given_by(landed)
            except KilledWorker:
                suspects.append(flight)
            except CancelledError:  # the scheduler forgot it: it is gone, or the worker is
                self._workers()
                waiting.append(flight)
            else:
                if written is None:
                    continue
                if not flight.last and any(failure.transient for failure in written.failures):
                    suspects.append(flight)
                else:
                    self.done(replace(written, failures=(*flight.failed, *written.failures)))
            del self.flights[landed]
        return suspects

    def _given_by(self, landed: Future[Any]) -> WrittenShard | None:
        """What a shard gives; None where its worker is slow, or gone, which the next round sees. Raises what it did."""
        try:
            written: WrittenShard = landed.result(timeout=LANDING)
        except TimeoutError:
            if landed.status == "error":
                raise
            self.landed.put(landed)
            return None
        return written

    def _left_by(self, worker: str) -> list[_Flight]:
        """The shards that a worker took with it, without the frame that ended it where its diary tells.

        Where it only tells what the worker was doing, that shard has lost a worker; where not even that, all have.
        """
        entry = worker_status.read(self.job.path, worker)
        doing = "doing nothing" if entry is None else f"frame {entry.frame}, {entry.stage}: {entry.error or 'killed'}"
        self.lost(worker, doing)
        again = []
        for future, flight in [pair for pair in self.flights.items() if pair[1].worker == worker]:
            self.flights.pop(future)
            future.cancel()
            again.append(_without(flight, entry))
        return again

    def _next(self) -> Future[Any] | None:
        """The next shard that came back; None after a moment without any."""
        try:
            return self.landed.get(timeout=1.0)
        except Empty:
            return None

    def _workers(self) -> list[str]:
        """Addresses of the workers. Raises ConnectionError where the scheduler is gone, RuntimeError where they are."""
        try:
            workers = sorted(self.client.nthreads())
        except (OSError, TimeoutError, CancelledError) as error:
            line = "the scheduler is gone; start one and run the same command again to resume"
            raise ConnectionError(errno.ECONNRESET, line, getattr(self.client.scheduler, "address", None)) from error
        now = time.monotonic()
        if workers:
            self.seen = now
        elif now - self.seen > self.patience:
            raise RuntimeError(
                f"no worker process came back in {self.patience:g} s; run the same command again to resume"
            )
        return workers

    def _launch(self, flight: _Flight, workers: Sequence[str]) -> None:
        load = Counter(f.worker for f in self.flights.values())
        flight = replace(flight, worker=min(workers, key=lambda w: load[w]))
        future = self._submit(flight)
        self.flights[future] = flight
        future.add_done_callback(self.landed.put)

    def _submit(self, flight: _Flight) -> Future[Any]:
        """The tasks of a shard, all on its worker, later stages of earlier frames first."""
        self.submitted += 1
        token, blocks = f"{self.token}.{self.submitted}", []
        for begin in range(0, len(flight.frames), self.job.block):
            frames = flight.frames[begin : begin + self.job.block]
            self.frames += len(frames)
            results: Any = [StageResult(frame) for frame in frames]
            for n, stages in enumerate(tasks.tasks_of(self.job)):
                key, priority = f"{'-'.join(stages)}-{token}-{frames[0]}", n - len(tasks.STAGES) * self.frames
                results = self._task(tasks.run_stages, stages, results, key=key, priority=priority, flight=flight)
            blocks.append(results)
        key = f"shard-{token}-{flight.shard}"
        return self._task(tasks.write, flight.shard, blocks, key=key, priority=1, flight=flight)

    def _task(
        self, function: Callable[..., Any], *arguments: Any, key: str, priority: int, flight: _Flight
    ) -> Future[Any]:
        return self.client.submit(
            function, self.job, *arguments, key=key, priority=priority, workers=[flight.worker], pure=False
        )

    def _alone(self, frame: int) -> Failure | None:
        """Render a frame with nothing else in flight: the failure where it ends its worker."""
        before = set(self._workers())
        future = self.client.submit(_probe, self.job, frame, key=f"alone-{self.token}-{frame}", pure=False)
        while not future.done():
            self._workers()  # are there any?
            time.sleep(0.05)
        error = None if future.status == "finished" else future.exception()
        if isinstance(error, CancelledError):
            self._workers()  # is the scheduler gone?
            return None
        if error is None:
            return None
        if not isinstance(error, KilledWorker):
            raise error
        entries = [
            entry for worker in before if (entry := worker_status.read(self.job.path, worker)) and entry.frame == frame
        ]
        for entry in entries:
            if entry.error:
                return Failure(frame, entry.stage, entry.error, entry.traceback)
        stage = entries[0].stage if entries else "frame"
        return Failure(frame, stage, "it ends its worker process: out of memory, or a crash", str(error))


class GivenPlan(WorkerPlugin):
    """Gives each worker, those that come later too, what the plan of a job resolved; the last build's, of several."""

    name = "sonarsynth-plan"

    def __init__(self, job: Job, resolved: Mapping[str, Any]) -> None:
        self.job, self.resolved = job, resolved

    def setup(self, worker: Worker) -> None:
        """Give it to the process."""
        tasks.give(self.job, self.resolved)


def register(client: Client, plugin: WorkerPlugin) -> None:
    """Give a plugin to all workers. Where one ends meanwhile, the scheduler takes the client for gone: then once more.

    Raises OSError where that does not come to an end.
    """
    for left in reversed(range(TRIES)):
        try:
            client.register_plugin(plugin)
            return
        except OSError:
            if not left or client.status != "running":
                raise


def _probe(job: Job, frame: int) -> None:
    """Render a frame and forget it."""
    tasks.render_frames(job, [frame])


def run(
    client: Client,
    job: Job,
    plan: Plan,
    todo: Mapping[int, tuple[int, ...]],
    done: Callable[[WrittenShard], None],
    lost: Callable[[str, str], None] = lambda worker, why: None,
    patience: float = math.inf,
) -> None:
    """Build shards on the workers of a client; `done` is called as each is written, `lost` when a worker ends.

    Raises what writing raises, ConnectionError where the scheduler is gone, RuntimeError where there is no worker for
    `patience` seconds.
    """
    worker_status.open_folder(job.path)
    try:
        register(client, GivenPlan(job, tasks.resolved(plan)))
        _Builder(client, job, done, lost, patience).run(todo)
    finally:
        worker_status.close_folder(job.path)
