"""`tools/bench build`: where the time of the remus dataset goes, stage by stage and as built by 2 workers. A table.

Stages: processor time of one process, warm, mean of `FRAMES` frames that follow each other. Built: wall time, the best
of `BUILDS`; steady from when every worker has written its first shard; start-up is the rest. `--json` has more.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.frame import RECIPE
from sonarsynth import pipeline, planning, schedule, store
from sonarsynth.labels import label
from sonarsynth.planning import Plan
from sonarsynth.recipe import reading
from sonarsynth.signals.filtered_pulse import snap_levels
from sonarsynth.store.encoding import encoded

WARM, FRAMES, BUILDS, STARTS = 8, 32, 3, 3


def different(first: Path, second: Path) -> list[str]:
    """Variables whose stored arrays are not identical, bit for bit."""
    import zarr

    a, b = zarr.open_group(first, mode="r"), zarr.open_group(second, mode="r")
    arrays = dict(a.members(max_depth=None))
    return [
        name
        for name, array in arrays.items()
        if isinstance(array, zarr.Array) and np.asarray(array[...]).tobytes() != np.asarray(b[name][...]).tobytes()
    ]


class Clock:
    """Processor seconds of calls, by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)

    def __call__(self, name: str, work: Callable[[], Any]) -> Any:
        began = time.process_time()
        made = work()
        self.seconds[name] += time.process_time() - began
        return made


def one(plan: Plan, index: int, clock: Clock) -> pipeline.Values:
    """A frame, with its parts again where they are part of a task."""
    traced = clock("trace, label", lambda: pipeline.trace_frame(plan, index))
    context, levels = planning.context_of(plan, traced.frame), snap_levels(traced.frame.moment.snaps)
    clock("label", lambda: label(context, plan.propagation, levels))
    heard = clock("hear", lambda: pipeline.beamform_frame(plan, index, traced))
    clock("synthesise", lambda: pipeline.synthesise(plan, traced))
    clock("measure paths alone", lambda: pipeline.measure_isolated(plan, traced))
    values = clock("range", lambda: pipeline.range_frame(plan, index, traced, heard))
    return clock("write", lambda: store.layout_of(plan).check(values))


def stages(plan: Plan, path: Path) -> dict[str, float]:
    """Processor time (ms) of each stage of a frame."""
    store.create(path, plan)
    layout, step = store.layout_of(plan), plan.shard_frames
    clock = Clock()
    for index in range(WARM):
        one(plan, index, Clock())
    for first in range(WARM, WARM + FRAMES, step):
        frames = {index: one(plan, index, clock) for index in range(first, first + step)}
        shard = first // step
        clock("write", lambda shard=shard, frames=frames: store.write_shard(path, plan, shard, frames))
        blocks = [(a, layout.block(a, shard, frames)) for a in layout.arrays if not a.empty]
        clock("compress", lambda blocks=blocks: [encoded(*block) for block in blocks])
    ms = {name: 1e3 * seconds / FRAMES for name, seconds in clock.seconds.items()}
    return {
        "trace, with the link budget": ms["trace, label"] - ms["label"],
        "label": ms["label"],
        "synthesise": ms["synthesise"],
        "measure paths alone": ms["measure paths alone"],
        "locate and beamform": ms["hear"] - ms["synthesise"] - ms["measure paths alone"],
        "range": ms["range"],
        "compress": ms["compress"],
        "digest and write": ms["write"] - ms["compress"],
    }


def built(plan: Plan, path: Path, workers: int) -> dict[str, Any]:
    """A build: frames per second once it is under way, what remains of its time, memory."""
    landed: list[tuple[float, int]] = []
    report = schedule.build(
        plan, path, workers=workers, restart=True,
        progress=lambda done, total, failed: landed.append((time.perf_counter(), done)),
    )  # fmt: skip
    start, end = landed[workers], landed[-1]  # the first is before any shard
    rate = (end[1] - start[1]) / (end[0] - start[0])
    size = sum(f.stat().st_size for f in path.rglob("*") if f.is_file())
    rest = report.seconds - report.written / rate
    return {**report.as_json(), "frames_per_second": rate, "start_up_seconds": rest, "stored_bytes": size}


def started(*command: str) -> float:
    """Wall time (s) of a fresh process, the median of `STARTS`."""
    seconds = []
    for _ in range(STARTS):
        began = time.perf_counter()
        subprocess.run([sys.executable, *command], check=True, capture_output=True)
        seconds.append(time.perf_counter() - began)
    return float(np.median(seconds))


def bench() -> dict[str, Any]:
    """Stages; the dataset by 1 and by 2 workers, compared; start-up."""
    plan = planning.plan(reading.load(RECIPE))
    with tempfile.TemporaryDirectory() as folder:
        by_stage = stages(plan, Path(folder) / "stages.zarr")
        paths = {workers: Path(folder) / f"{workers}.zarr" for workers in (1, 2)}
        alone = built(plan, paths[1], 1)
        runs = [built(plan, paths[2], 2) for _ in range(BUILDS)]
        one_frame = started(
            "-m", "sonarsynth", "build", str(RECIPE), f"{folder}/one.zarr", "--frames", "0:1", "--restart"
        )
        return {
            "stages_ms": by_stage,
            "1 worker": alone,
            "2 workers": max(runs, key=lambda run: run["frames_per_second"]),
            "start_up_seconds": min(run["start_up_seconds"] for run in runs),
            "one_frame_seconds": one_frame,
            "help_seconds": started("-m", "sonarsynth", "--help"),
            "import_seconds": started("-c", "import sonarsynth"),
            "different_arrays": different(*paths.values()),
        }


def table(result: dict[str, Any]) -> str:
    """The result in Markdown."""
    stages, two = result["stages_ms"], result["2 workers"]
    total = sum(stages.values())
    rows = [("a frame of `configs/remus.yaml`, written, one core", "ms", "share"), ("---", "---", "---")]
    rows += [(name, f"{ms:.1f}", f"{100 * ms / total:.0f} %") for name, ms in stages.items()]
    rows.append(("all", f"{total:.1f}", ""))
    return "\n".join([
        *("| " + " | ".join(row) + " |" for row in rows),
        "",
        f"64 frames by 2 workers: {two['frames_per_second']:.1f} frames/s, and {result['start_up_seconds']:.1f} s to "
        f"start; one frame alone {result['one_frame_seconds']:.1f} s, --help {result['help_seconds']:.2f} s, "
        f"import {result['import_seconds']:.2f} s; {two['stored_bytes'] / 64e3:.0f} kB a frame; "
        f"arrays that differ from those by 1 worker: {len(result['different_arrays'])}",
    ])  # fmt: skip
