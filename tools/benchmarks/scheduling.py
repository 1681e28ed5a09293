"""`tools/bench scheduling`: what scheduling and writing cost beside frames of 30 ms, and memory as frames go by.

A tiny scene; each frame's beamforming is padded to 30 ms of the worker's time by sleeping, so that what is measured
besides is ours. Overhead: time of all workers that no frame had, over the frames' own.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import dask
from fault_injection.kills import RECIPE

from sonarsynth import config, planning, schedule
from sonarsynth.schedule.tasks import peak_memory

FRAMES = int(os.environ.get("SCHEDULING_FRAMES", "2000"))
PAD = """\
import time
from sonarsynth import render
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


def bench() -> dict[str, Any]:
    """Build the frames on one worker; overhead, and peak memory of client (with its scheduler) and worker."""
    made = planning.plan(
        config.loads(RECIPE.replace("frames: 40, interval: 0.02", f"frames: {FRAMES}, interval: 4e-4"))
    )
    result: dict[str, Any] = {"frames": FRAMES}
    for shard in sorted({8, made.shard_frames}):
        memory: dict[int, float] = {}
        with tempfile.TemporaryDirectory() as folder:
            pad = Path(folder) / "pad.py"
            pad.write_text(PAD)

            def note(done: int, total: int, aside: int, memory: dict[int, float] = memory) -> None:
                if done // 250 > len(memory):
                    memory[done] = peak_memory() / 1e6

            with dask.config.set({"distributed.worker.preload": [str(pad)]}):
                report = schedule.build(
                    replace(made, shard_frames=shard), Path(folder) / "s.zarr", workers=1, progress=note
                )
        frames = sum(report.stage_seconds.values())
        result[f"{shard} frames a shard"] = {
            "seconds": report.seconds,
            "frames_seconds": frames,
            "writing_seconds": report.writing_seconds,
            "overhead": (report.seconds * report.workers - frames) / frames,
            "writing_over_frames": report.writing_seconds / frames,
            "client_peak_megabytes_at": memory,
            "worker_peak_megabytes": report.worker_peak_bytes / 1e6,
        }
    return result
