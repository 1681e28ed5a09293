"""Building a dataset: which shards are missing, who makes them, and what came of it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from sonarsynth import store
from sonarsynth.planning import PRODUCTS, Plan, choices_from, chosen_products, plan
from sonarsynth.recipe import Recipe
from sonarsynth.schedule import tasks
from sonarsynth.schedule.tasks import STAGES, Failure, Job, Written

__all__ = ["BuildReport", "Failure", "Progress", "build", "usable_cores"]

Progress = Callable[[int, int, int], None]
"""Called with the frames done, the frames to do, and the frames set aside, as shards are written."""


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
    stage_seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    stage_cpu: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    worker_peak_bytes: int = 0  # largest of any worker
    client_peak_bytes: int = 0
    failures: list[Failure] = field(default_factory=list)
    notes: tuple[str, ...] = ()  # what the plan warns of

    @property
    def ok(self) -> bool:
        """True where no frame was set aside."""
        return not self.failures

    def add(self, written: Written) -> None:
        """Count a shard in."""
        self.written += len(written.frames)
        self.shards += bool(written.frames)
        self.bytes += written.bytes
        self.writing_seconds += written.seconds
        self.worker_peak_bytes = max(self.worker_peak_bytes, written.peak_bytes)
        self.failures.extend(written.failures)
        for row in written.times:
            for stage, seconds in row["seconds"].items():
                self.stage_seconds[stage] += seconds
                self.stage_cpu[stage] += row["cpu"][stage]

    def as_json(self) -> dict[str, Any]:
        """The report for a program."""
        return {**asdict(self), "ok": self.ok}


def build(
    what: Recipe | Plan,
    path: Path | str,
    *,
    frames: Iterable[int] | None = None,
    products: Iterable[str] = PRODUCTS,
    workers: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
    progress: Progress | None = None,
) -> BuildReport:
    """Build the frames (left out: all) of a recipe that a store lacks, laying it out if it is not there.

    On `workers` processes of this machine (left out: one a usable core; 0: in this process), or on the workers of a
    running Dask scheduler. `products` counts where a recipe is given; a Plan has its own. The arrays are the same
    whatever the number of workers, the order, the interruptions. Beside the store: run times in `<store>.times.jsonl`,
    frames set aside in `<store>.aside.jsonl`. From a script, call it under `if __name__ == "__main__":`, as all
    multiprocessing needs.

    Raises FieldError for a scene that cannot be, IndexError for frames that are not there, store.Mismatch for a store
    of something else, store.Locked while another build runs, store.Damage where the store cannot go on, OSError where
    it cannot be written, RuntimeError where workers do not start. After any of these, and after an interruption, the
    same call goes on where it ended.
    """
    began = time.perf_counter()
    if workers is not None and workers < 0:
        raise ValueError(f"workers must be 0 or more, not {workers}")
    made = what if isinstance(what, Plan) else plan(what, chosen_products(products))
    path = Path(os.path.abspath(path))
    with store.lock(path):
        made = made if restart else _as_begun(path, made)
        store.create(path, made, restart=restart)
        chosen = range(made.recipe.frames) if frames is None else sorted(set(frames))
        todo = store.missing(path, made, chosen)
        lacking = {frame for some in todo.values() for frame in some}
        there = sum(frame not in lacking for frame in chosen)
        report = BuildReport(str(path), made.recipe.frames, len(chosen), there, notes=made.warnings)
        _tidy(path, lacking, restart)
        done = _counter(path, report, len(lacking), progress)
        job = Job(str(path), made.digest, tuple(sorted(made.products)))
        tasks.remember(job, made)
        try:
            _run(job, todo, workers, scheduler, report, done)
        finally:
            report.seconds = time.perf_counter() - began
            report.client_peak_bytes = tasks.peak_memory()
    return report


def _as_begun(path: Path, made: Plan) -> Plan:
    """The plan, with the choices that a store of the same recipe was begun with: another machine may choose others."""
    there = store.root_attributes(path)
    if there.get("recipe_digest") != made.digest or "choices" not in there:
        return made
    return replace(made, choices=choices_from(there["choices"]))


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _run(
    job: Job,
    todo: Mapping[int, tuple[int, ...]],
    workers: int | None,
    scheduler: str | None,
    report: BuildReport,
    done: Callable[[Written], None],
) -> None:
    if not todo:
        return
    if scheduler is None and workers == 0:
        for shard, frames in todo.items():
            done(tasks.write(job, shard, [tasks.render_frame(job, frame) for frame in frames]))
        return
    from sonarsynth.schedule import cluster

    count = min(usable_cores() if workers is None else workers, len(todo))
    with cluster.connected(count, scheduler) as client:
        report.workers = len(client.nthreads())
        cluster.run(client, job, todo, done)


def _counter(path: Path, report: BuildReport, total: int, progress: Progress | None) -> Callable[[Written], None]:
    """What is done with a shard that is written: counted, its run times and failures put beside the store."""

    def done(written: Written) -> None:
        report.add(written)
        tasks.append_lines(store.beside(path, "times.jsonl"), written.times)
        if written.failures:
            tasks.append_lines(store.beside(path, "aside.jsonl"), [asdict(f) for f in written.failures])
        if progress is not None:
            progress(report.written, total, len(report.failures))

    if progress is not None:
        progress(0, total, 0)
    return done


def _tidy(path: Path, again: set[int], restart: bool) -> None:
    """Forget the failures of frames that are tried again, and, on a restart, old run times."""
    aside, times = store.beside(path, "aside.jsonl"), store.beside(path, "times.jsonl")
    if restart:
        times.unlink(missing_ok=True)
    if aside.exists():
        rows = [row for row in map(json.loads, aside.read_text("utf-8").splitlines()) if row["frame"] not in again]
        aside.unlink()
        if rows and not restart:
            tasks.append_lines(aside, rows)
