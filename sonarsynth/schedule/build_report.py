"""What came of a build: the report that grows while it runs, the files beside the store, and who is told."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from sonarsynth import store
from sonarsynth.conventions import Pace, Progress
from sonarsynth.planning import Plan
from sonarsynth.schedule import tasks
from sonarsynth.schedule.tasks import Failure, WrittenShard
from sonarsynth.store import Folder
from sonarsynth.store.files.json_lines import append_lines

PROGRESS_EVERY: Final = 10.0
"""Seconds between two events `progress` of the log."""


@dataclass
class BuildReport:
    """What a build did. Grows while it runs."""

    store: str
    frames: int  # of the dataset
    wanted: int  # frames that this build was asked for
    there: int  # of those, complete before it began
    workers: int = 0  # 0: in this process
    written: int = 0  # frames written (a shard that had some frames is written again whole)
    shards: int = 0
    bytes: int = 0
    seconds: float = 0.0
    writing_seconds: float = 0.0  # of workers, in writing
    stage_seconds: dict[str, float] = field(default_factory=dict)  # of the tasks that ran, by name
    stage_cpu: dict[str, float] = field(default_factory=dict)
    workers_lost: int = 0
    dashboard: str = ""  # address
    worker_peak_bytes: int = 0  # largest of any worker
    client_peak_bytes: int = 0
    failures: list[Failure] = field(default_factory=list)
    notes: tuple[str, ...] = ()  # what the plan warns of
    warnings: tuple[str, ...] = ()  # what the finished store warns of (`evaluation.warnings`), where that is asked
    prediction: dict[str, Any] = field(default_factory=dict)  # predicted and measured, where a prediction was given

    @property
    def ok(self) -> bool:
        """True where no frame failed."""
        return not self.failures

    def add(self, written: WrittenShard) -> None:
        """Count a shard in."""
        self.written += len(written.frames)
        self.shards += bool(written.frames)
        self.bytes += written.bytes
        self.writing_seconds += written.seconds
        self.worker_peak_bytes = max(self.worker_peak_bytes, written.peak_bytes)
        self.failures.extend(written.failures)
        for row in written.times:
            for stage, seconds in row["seconds"].items():
                self.stage_seconds[stage] = self.stage_seconds.get(stage, 0.0) + seconds
                self.stage_cpu[stage] = self.stage_cpu.get(stage, 0.0) + row["cpu"][stage]

    def as_json(self) -> dict[str, Any]:
        """The report for a program."""
        return {**asdict(self), "ok": self.ok}


class Log:
    """The log of a build: JSON lines beside the store, one an event, each with the time (UTC)."""

    def __init__(self, file: Path) -> None:
        self.file, self.pace, self.said = file, Pace(), time.monotonic()

    def event(self, event: str, **facts: Any) -> None:
        """Add an event."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        append_lines(self.file, [{"time": now, "event": event, **facts}])

    def progress(self, done: int, total: int, failed: int) -> None:
        """Say how far it is, now and then."""
        now, rate = time.monotonic(), self.pace.rate(done + failed)
        if now - self.said >= PROGRESS_EVERY:
            self.said = now
            eta = (total - done - failed) / rate if rate else None
            self.event("progress", done=done, of=total, failed=failed, frames_per_second=rate, seconds_left=eta)


class BuildProgress:
    """What is done as shards are written: counted, run times and failures put beside the store, progress told."""

    def __init__(
        self,
        path: Folder,
        report: BuildReport,
        total: int,
        progress: Progress | None,
        announce: Callable[[str], None] | None,
    ) -> None:
        self.path, self.report, self.total = path, report, total
        self.progress, self.announce = progress, announce
        self.before = len(report.failures)
        self.log = Log(store.here(path, "log.jsonl"))
        self._tell()

    def _tell(self) -> None:
        counts = (self.report.written, self.total, len(self.report.failures) - self.before)
        self.log.progress(*counts)
        if self.progress is not None:
            self.progress(*counts)

    def started(self, workers: int, dashboard: str) -> None:
        """Workers are there."""
        self.report.workers, self.report.dashboard = workers, dashboard
        self.log.event("workers", workers=workers, dashboard=dashboard)
        if self.announce is not None and dashboard:
            self.announce(dashboard)

    def done(self, written: WrittenShard) -> None:
        """A shard is written."""
        self.report.add(written)
        append_lines(store.here(self.path, "times.jsonl"), written.times)
        append_lines(store.beside(self.path, "failed.jsonl"), [asdict(f) for f in written.failures])
        for failure in written.failures:
            self.log.event("failed", frame=failure.frame, stage=failure.stage, error=failure.error)
        self._tell()

    def lost(self, worker: str, why: str) -> None:
        """A worker ended."""
        self.report.workers_lost += 1
        self.log.event("worker lost", worker=worker, doing=why)

    @contextmanager
    def logged(self, plan: Plan) -> Iterator[None]:
        """Put the beginning and the end of the build into the log."""
        r = self.report
        self.log.event(
            "build", digest=plan.digest, frames=r.frames, wanted=r.wanted, there=r.there, to_do=self.total,
            process=os.getpid(), host=socket.gethostname(),
        )  # fmt: skip
        outcome, began = "done", time.perf_counter()
        try:
            yield
        except BaseException as error:
            outcome = "interrupted" if isinstance(error, KeyboardInterrupt) else f"{type(error).__name__}: {error}"
            raise
        finally:
            r.seconds, r.client_peak_bytes = time.perf_counter() - began, tasks.peak_memory()
            with suppress(OSError):
                self.log.event(
                    "end", how=outcome, written=r.written, failed=len(r.failures), workers_lost=r.workers_lost,
                    seconds=r.seconds,
                )  # fmt: skip
