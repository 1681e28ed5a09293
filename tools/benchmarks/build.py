"""`tools/bench build`: where the time of the remus dataset goes, stage by stage and as built by 2 workers. A table.

Stages: processor time of one process, warm, median of `FRAMES` frames that follow each other, beside that of a product
of matrices in the same run; of all products, and of image and cloud alone. Built: wall time, the best
of `BUILDS`; steady from when every worker has written its first shard; start-up is the rest. `--json` has more.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import RECIPE, gemm, markdown
from sonarsynth import pipeline, planning, schedule, store
from sonarsynth.planning import Plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import tasks
from sonarsynth.schedule.making import job_of
from sonarsynth.schedule.tasks import StageResult
from sonarsynth.store.encoding import encoded

WARM, FRAMES, BUILDS, STARTS = 8, 32, 3, 3
FEW = {"image", "cloud"}


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


def made(plan: Plan, frames: Sequence[int]) -> list[StageResult]:
    """Some frames, as a worker makes those of a task."""
    job = job_of("nowhere", plan, "")
    tasks.remember(job, plan)
    return tasks.render_frames(job, frames)


def stages(plan: Plan, folder: Path) -> tuple[dict[str, float], float]:
    """Processor time (ms) of each stage of a frame, the median of frames, of writing it, the mean; and of compressing
    and writing it in shards of `FRAMES`, as large datasets have them."""
    shards = [range(first, first + WARM) for first in range(0, WARM + FRAMES, WARM)]
    laps = [step.parts for shard in shards for step in made(plan, shard)][WARM:]
    values = [step.value for step in made(plan, range(WARM, WARM + FRAMES))]
    ms = {stage: 1e3 * float(np.median([lap[stage] for lap in laps])) for stage in pipeline.STAGES if stage in laps[0]}
    compressing, writing = written(plan, folder, values)
    many = written(replace(plan, shard_frames=FRAMES), folder, values)
    return ms | {"compress": compressing, "digest and write": writing}, sum(many)


def written(plan: Plan, folder: Path, values: list[pipeline.Values]) -> tuple[float, float]:
    """Processor time (ms) a frame to compress some frames, as if they were the first, and to write them besides."""
    path, step = folder / f"{len(plan.products)} {plan.shard_frames}.zarr", plan.shard_frames
    store.create(path, plan)
    layout = store.layout_of(plan)
    writing = compressing = 0.0
    for first in range(0, len(values), step):
        began = time.process_time()
        frames = {index: layout.check(values[index]) for index in range(first, first + step)}
        store.write_shard(path, plan, first // step, frames)
        done = time.process_time()
        for array in (a for a in layout.arrays if not a.empty):
            encoded(array, layout.chunks(array, first // step, frames))
        compressing += time.process_time() - done
        writing += done - began
    return 1e3 * compressing / len(values), 1e3 * (writing - compressing) / len(values)


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
        by_stage, many = stages(plan, Path(folder))
        few, few_many = stages(planning.plan(plan.recipe, FEW), Path(folder))
        paths = {workers: Path(folder) / f"{workers}.zarr" for workers in (1, 2)}
        alone = built(plan, paths[1], 1)
        runs = [built(plan, paths[2], 2) for _ in range(BUILDS)]
        one_frame = started(
            "-m", "sonarsynth", "build", str(RECIPE), f"{folder}/one.zarr", "--frames", "0:1", "--restart"
        )
        return {
            "gemm_ms": gemm(),
            "stages_ms": by_stage,
            "stages_ms of image and cloud": few,
            "large_shards_ms": [many, few_many],
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
    stages, few, two = result["stages_ms"], result["stages_ms of image and cloud"], result["2 workers"]
    rows = [("a frame of `configs/remus.yaml`, written, one core, ms", "all products", "image and cloud")]
    rows += [(name, f"{ms:.1f}", f"{few[name]:.1f}" if name in few else "") for name, ms in stages.items()]
    whole = [sum(some.values()) for some in (stages, few)]
    rows.append(("all", *(f"{ms:.1f}" for ms in whole)))
    rows.append((f"compress and write, shards of {FRAMES} frames", *(f"{ms:.1f}" for ms in result["large_shards_ms"])))
    rows.append(
        (
            f"over a product of matrices of 1024 ({result['gemm_ms']:.1f} ms)",
            *(f"{ms / result['gemm_ms']:.1f}" for ms in whole),
        )
    )
    return "\n".join([
        *markdown(rows),
        "",
        f"64 frames by 2 workers: {two['frames_per_second']:.1f} frames/s, and {result['start_up_seconds']:.1f} s to "
        f"start; one frame alone {result['one_frame_seconds']:.1f} s, --help {result['help_seconds']:.2f} s, "
        f"import {result['import_seconds']:.2f} s; {two['stored_bytes'] / 64e3:.0f} kB a frame; "
        f"arrays that differ from those by 1 worker: {len(result['different_arrays'])}",
    ])  # fmt: skip
