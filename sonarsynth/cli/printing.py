"""What people see: progress, tables and reports."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    SpinnerColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
)
from rich.text import Text

from sonarsynth.conventions import Pace, counted, format_bytes

if TYPE_CHECKING:
    from sonarsynth.conventions import Progress as Report
    from sonarsynth.planning import Plan
    from sonarsynth.schedule import BuildReport, Prediction
    from sonarsynth.store import Report as StoreReport

SECONDS_BETWEEN_LINES: Final = 10.0
"""Where progress does not go to a terminal, a line this often."""


def console(*, stderr: bool = False) -> Console:
    """A console: as wide as the terminal, or 140 columns where there is none."""
    terminal = (sys.stderr if stderr else sys.stdout).isatty()
    return Console(stderr=stderr, width=None if terminal else 140, highlight=False, soft_wrap=not terminal)


@contextmanager
def progress(waiting: str = "starting workers") -> Iterator[Report]:
    """A callback that shows progress on stderr: a bar on a terminal, else a line now and then.

    waiting: what is done before the first frame.
    """
    if not sys.stderr.isatty():
        yield _Lines()
        return
    columns = (SpinnerColumn(), BarColumn(), MofNCompleteColumn(), TextColumn("frames{task.fields[pace]}"))
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("frames", total=None, pace=f", {waiting}")
        pace = Pace()

        def update(done: int, total: int, failed: int) -> None:
            said = _pace(done, total, failed, pace) if done + failed else f", {waiting}"
            bar.update(task, completed=done + failed, total=total, pace=said)

        yield update


@contextmanager
def planning(activity: str = "planning") -> Iterator[None]:
    """Shows that something is being made: a spinner on a terminal, else a line now and then; and that kernels are
    compiled, where they are."""
    began, done = time.monotonic(), threading.Event()
    if sys.stderr.isatty():
        columns = SpinnerColumn(), _Activity(), TimeElapsedColumn()
        with Progress(*columns, console=console(stderr=True), transient=True) as bar:
            bar.add_task(activity, total=None)
            yield
        return

    def say() -> None:
        while not done.wait(SECONDS_BETWEEN_LINES):
            sys.stderr.write(f"{activity}{_compiling()}, {time.monotonic() - began:.0f} s\n")
            sys.stderr.flush()

    thread = threading.Thread(target=say, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


class _Activity(ProgressColumn):
    def render(self, task: Task) -> Text:
        """The activity, as it is now."""
        return Text(f"{task.description}{_compiling()}")


def _compiling() -> str:
    """What takes the first call of a machine long: kernels are compiled, and kept."""
    anew = getattr(sys.modules.get("sonarsynth.compiling"), "anew", [])
    return f" ({counted(len(anew), 'kernel')} compiled so far, once for this machine)" if anew else ""


def overwrite(text: str) -> None:
    """What is being done, in place of what was said so before; on a terminal alone."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\033[K{text}")
        sys.stderr.flush()


def announce(dashboard: str) -> None:
    """Say where the dashboard is."""
    console(stderr=True).print(f"dashboard: {dashboard}", markup=False)


class _Lines:
    """Progress as lines."""

    def __init__(self) -> None:
        self.pace, self.said = Pace(), time.monotonic()

    def __call__(self, done: int, total: int, failed: int) -> None:
        now, said = time.monotonic(), _pace(done, total, failed, self.pace)
        if now - self.said >= SECONDS_BETWEEN_LINES:
            self.said = now
            sys.stderr.write(f"{done + failed} of {total} frames{said}\n")
            sys.stderr.flush()


def _pace(done: int, total: int, failed: int, pace: Pace) -> str:
    """Frames per second and time left, once other frames than the first have shown these; frames that failed."""
    finished = done + failed
    rate = pace.rate(finished)
    text = "" if rate is None else f", {rate:.3g} frames/s, {duration((total - finished) / rate)} left"
    return text + (f", {failed} failed" if failed else "")


def duration(seconds: float) -> str:
    """A time in a unit that suits it."""
    if seconds < 100:
        return f"{seconds:.3g} s"
    minutes, hours = seconds / 60, seconds / 3600
    return f"{minutes:.3g} min" if minutes < 100 else f"{hours:.3g} h" if hours < 72 else f"{hours / 24:.3g} days"


def _milliseconds(seconds: float) -> str:
    """A time without an exponent, in ms to three figures."""
    return f"{1e3 * seconds:.3g} ms" if seconds < 0.9995 else f"{1e3 * seconds:.0f} ms"


def build_report(report: BuildReport) -> None:
    """What a build did, in a few lines."""
    out = console()
    if report.written:
        rate = report.written / report.seconds
        out.print(
            f"{report.store}: {counted(report.written, 'frame')} written in {duration(report.seconds)} "
            f"({rate:.3g} frames/s, {format_bytes(report.bytes)}), {report.there} of {report.wanted} were already built"
        )
        times = ", ".join(f"{stage} {_milliseconds(s / report.written)}" for stage, s in report.stage_cpu.items())
        workers = (
            f"{counted(report.workers, 'worker')} with at most {format_bytes(report.worker_peak_bytes)} of memory each"
            if report.workers
            else "no worker processes"
        )
        out.print(f"CPU time per frame: {times}; {workers}, {format_bytes(report.client_peak_bytes)} in this process")
    elif not report.failures:
        out.print(f"{report.store}: all {report.wanted} frames were already built")
    if report.prediction and report.written:
        for line in _compared(report.prediction):
            out.print(line)
    for note in report.notes:
        out.print(f"note: {note}", markup=False)
    for warning in report.warnings:
        out.print(f"warning: {warning}", markup=False)
    for failure in report.failures[:10]:
        out.print(f"frame {failure.frame} failed in {failure.stage}: {failure.error}", markup=False)
    if report.failures:
        out.print(
            f"{counted(len(report.failures), 'frame')} failed; tracebacks in {report.store}.failed.jsonl", markup=False
        )


def _compared(prediction: dict[str, Any]) -> Iterator[str]:
    """Prediction and measurement of a build, a line each."""
    for name, verb, shown in (("seconds", "took", duration), ("bytes", "the store takes", format_bytes)):
        if prediction[f"{name}_ratio"] is not None:
            measured, predicted = (shown(prediction[f"{which}_{name}"]) for which in ("measured", "predicted"))
            yield f"{verb} {measured} (predicted {predicted})"


def plan_report(plan: Plan, prediction: Prediction) -> None:
    """Stages, what is left out, sizes and predicted cost."""
    from sonarsynth.planning.plan_tables import as_tables

    out = console()
    for table in as_tables(plan.recipe.title, plan.stages, plan.left_out):
        out.print(table)
    for warning in plan.warnings:
        out.print(f"note: {warning}", markup=False)
    for line in _spanned(plan.as_json()):
        out.print(line, markup=False)
    out.print(", ".join(counted(count, name) for name, count in plan.sizes.items()))
    p = prediction
    made = f"with {counted(p.workers, 'worker')}" if p.workers else "in one process"
    out.print(
        f"predicted: {duration(p.seconds)} for {counted(p.frames, 'frame')} {made}, "
        f"{duration(p.core_seconds)} of CPU time; {format_bytes(p.bytes)} on disk, {format_bytes(p.raw_bytes)} before "
        "compression"
    )
    out.print(
        f"at most {p.files} files and folders for all frames, {plan.shard_frames} frames in a file; "
        f"a worker takes up to {format_bytes(plan.memory_bytes)} of memory"
    )
    out.print(f"estimated from {p.basis}", markup=False)
    if plan.odds:
        out.print(f"in these: {plan.odds}", markup=False)


def _spanned(plan: dict[str, Any]) -> Iterator[str]:
    """Sequences, grid, variations and splits of a plan, where there is more than one sequence."""
    if not (plan["grid"] or plan["variations"] or plan["sequences"] > 1):
        return
    grid = [f"{' with '.join(entry['names'])} ({entry['values']})" for entry in plan["grid"]]
    grid += [f"{plan['repeats']} repeats"] if plan["repeats"] > 1 else []
    spans = f": {' x '.join(grid)}" if grid else ""
    low, high = plan["frames_of_a_sequence"]
    yield f"{plan['sequences']} sequences of {low if low == high else f'{low} to {high}'} frames{spans}"
    if plan["variations"]:
        yield "drawn for each: " + ", ".join(f"{v['name']} ({v['kind']})" for v in plan["variations"])
    yield "splits: " + ", ".join(f"{name} {count}" for name, count in plan["splits"].items()) + " sequences"


def verify_report(report: StoreReport) -> None:
    """Damage and checks, one line each."""
    from sonarsynth.store import ranges

    out = console()
    out.print(
        f"{report.store}: {len(report.complete)} of {report.frames} frames, {report.files} files, "
        f"{format_bytes(report.bytes)}",
        markup=False,
    )
    for problem in report.problems[:50]:
        out.print(f"DAMAGE {problem.where}: {problem.what}", markup=False)
    if len(report.problems) > 50:
        out.print(f"and {len(report.problems) - 50} more")
    spoiled = sorted({frame for problem in report.problems for frame in problem.frames})
    if report.problems and spoiled:
        out.print(f"damaged frames: {ranges(spoiled)}; run 'sonarsynth repair' to rebuild them", markup=False)
    for check in report.checks:
        word = {True: "ok", False: "FAILED", None: "info"}[check.ok]
        expected = "" if check.ok is None else f" (expected: {check.expected})"
        out.print(f"{word}: {check.name}: {check.got}{expected}", markup=False)
        if check.ok is False and check.frames:
            out.print(f"    in frames {ranges(check.frames)}", markup=False)
    for check in report.checks:
        if check.warning:
            out.print(f"warning: {check.warning}", markup=False)
    if report.building:
        out.print(f"being built by {report.building}: only the complete part was checked", markup=False)
    if report.ok:
        out.print("store is intact" if not report.quick else "all files match their digests")
