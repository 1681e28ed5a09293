"""`tools/bench scheduling`: what scheduling and writing cost beside frames of 30 ms, and memory as frames go by.

A tiny scene, one worker; each frame is padded to 30 ms by sleeping, so that what is measured besides is ours.
Overhead: time of the worker that no frame had, its start too, over the frames' own. Memory: what is resident when so
many frames are done. Once with the shards of a dataset of that many frames, once with those of a small one, and once
on a scheduler of its own, where frames are not padded and client, scheduler and worker are three processes.
SCHEDULING_FRAMES=2000 for fewer frames.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import dask
import psutil
from fault_injection.cluster import Cluster
from fault_injection.kills import RECIPE
from fault_injection.processes import workers_of

from benchmarks.timing import markdown
from sonarsynth import planning, schedule
from sonarsynth.planning import SHARD_FRAMES, Plan
from sonarsynth.recipe import reading

FRAMES = int(os.environ.get("SCHEDULING_FRAMES", "10000"))
LOOKED_AT = sorted({FRAMES // 10, FRAMES // 2, FRAMES})
"""Frames done when memory is looked at."""

PAD = """\
import time
from sonarsynth import pipeline as render
began = {}
def traced(made, index):
    began[index] = time.perf_counter()
    return trace(made, index)
def padded(made, index, *parts):
    values = range_(made, index, *parts)
    time.sleep(max(0.0, 0.030 - (time.perf_counter() - began.pop(index))))
    return values
if not hasattr(render, "padded"):  # preloaded more than once
    trace, range_ = render.trace_frame, render.range_frame
    render.trace_frame, render.range_frame, render.padded = traced, padded, True
"""


class Watch:
    """Resident memory (MB) and processor time (s) of processes, by name, as frames are done."""

    def __init__(self, processes: Callable[[], dict[str, psutil.Process]]) -> None:
        self.processes = processes
        self.memory: dict[str, dict[int, float]] = {}
        self.cpu: dict[str, dict[int, float]] = {}
        self.left = list(LOOKED_AT)

    def __call__(self, done: int, total: int, failed: int) -> None:
        """Look, where it is time."""
        while self.left and done >= self.left[0]:
            at = self.left.pop(0)
            for name, process in self.processes().items():
                used = process.cpu_times()
                self.memory.setdefault(name, {})[at] = process.memory_info().rss / 1e6
                self.cpu.setdefault(name, {})[at] = used.user + used.system

    def cpu_ms(self, name: str) -> float:
        """Processor time of a frame, from when a tenth of them were done."""
        first, last = min(self.cpu[name]), max(self.cpu[name])
        return 1e3 * (self.cpu[name][last] - self.cpu[name][first]) / (last - first)


def here() -> dict[str, psutil.Process]:
    """The processes of a build on workers of its own."""
    me = psutil.Process()
    workers = {f"worker {n}": p for n, p in enumerate(sorted(workers_of(me), key=lambda p: p.pid))}
    return {"client with scheduler": me, **workers}


def built(made: Plan, path: Path, watch: Watch, **options: Any) -> dict[str, Any]:
    """A build; what it took besides the frames."""
    report = schedule.build(made, path, progress=watch, **options)
    frames = sum(report.stage_seconds.values())
    return {
        "shard_frames": made.shard_frames,
        "seconds": report.seconds,
        "frames_seconds": frames,
        "writing_seconds": report.writing_seconds,
        "overhead": (report.seconds * max(report.workers, 1) - frames) / frames,  # a running cluster here has one
        "writing_over_frames": report.writing_seconds / frames,
        "writing_ms_a_frame": 1e3 * report.writing_seconds / report.written,
        "frames_cpu_ms": 1e3 * sum(report.stage_cpu.values()) / report.written,
        "cpu_ms_a_frame": {name: watch.cpu_ms(name) for name in watch.cpu},
        "megabytes_at": watch.memory,
        "peak_megabytes": {"client": report.client_peak_bytes / 1e6, "worker": report.worker_peak_bytes / 1e6},
        "load": os.getloadavg()[0],
    }


def padded(made: Plan) -> dict[str, Any]:
    """Frames of 30 ms on a worker of this process."""
    with tempfile.TemporaryDirectory() as folder:
        pad = Path(folder) / "pad.py"
        pad.write_text(PAD)
        import_module("distributed")  # its settings must be there before one of them is set for a while
        with dask.config.set({"distributed.worker.preload": [str(pad)]}):
            return built(made, Path(folder) / "s.zarr", Watch(here), workers=1)


def apart(made: Plan) -> dict[str, Any]:
    """Frames as short as they are, on a scheduler and a worker of their own."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        os.environ["DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED"] = "False"  # as the README says of such clusters
        cluster = stack.enter_context(Cluster(folder))
        address = cluster.address()

        def processes() -> dict[str, psutil.Process]:
            scheduler, nanny = (psutil.Process(p.pid) for p in cluster.processes)
            return {
                "client": psutil.Process(),
                "scheduler": scheduler,
                "worker": next(p for p in nanny.children(recursive=True) if "spawn_main" in " ".join(p.cmdline())),
            }

        return built(made, folder / "s.zarr", Watch(processes), scheduler=address)


def bench() -> dict[str, Any]:
    """Overhead by two sizes of shard, and memory of every process."""
    text = RECIPE.replace("frames: 40, interval: 0.02", f"frames: {FRAMES}, interval: {0.8 / FRAMES:g}")
    made = planning.plan(reading.loads(text))
    sizes = sorted({made.shard_frames, SHARD_FRAMES}, reverse=True)
    rows = {f"30 ms, {size} frames a shard": padded(replace(made, shard_frames=size)) for size in sizes}
    return {"frames": FRAMES, **rows, f"apart, {made.shard_frames} frames a shard": apart(made)}


def table(result: dict[str, Any]) -> str:
    """The result in Markdown."""
    runs = {name: run for name, run in result.items() if isinstance(run, dict)}
    rows = [[f"{result['frames']} frames", "overhead", "writing", "ms of processor a frame", "load"]]
    for name, run in runs.items():
        overhead, writing = f"{100 * run['overhead']:.1f} %", f"{run['writing_ms_a_frame']:.2f} ms a frame"
        cpu = ", ".join(f"{who} {ms:.2f}" for who, ms in run["cpu_ms_a_frame"].items())
        rows.append([name, overhead, writing, f"{cpu} (frame itself {run['frames_cpu_ms']:.2f})", f"{run['load']:.1f}"])
    marks = sorted({at for run in runs.values() for found in run["megabytes_at"].values() for at in found})
    memory = [["MB resident after", *(f"{at} frames" for at in marks)]]
    for name, run in runs.items():
        for who, found in run["megabytes_at"].items():
            memory.append([f"{name}: {who}", *(f"{found[at]:.1f}" for at in marks if at in found)])
    return "\n".join([*markdown(rows), "", *markdown(memory)])
