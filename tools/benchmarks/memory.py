"""`tools/bench memory`: peak resident memory of every stage on large meshes, and of a worker over many frames.

Every measurement is a process of its own, for a peak never falls; stages within one are told apart by clearing the
kernel's mark of the peak before each (Linux), and where that cannot be done peaks are those so far.
"""

from __future__ import annotations

import contextlib
import gc
import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import RECIPE

FACETS = (100_000, 1_000_000, 10_000_000)
COUNTS = (10, 20, 50, 100, 200, 500, 1000)
"""Frames after which the memory of a worker is read."""
MB = 1e6


def resident() -> float:
    """Resident memory of this process (MB)."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / MB


def peak() -> float:
    """Largest resident memory since the last `forget_peak` (MB)."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024 / MB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MB


def forget_peak() -> None:
    """Begin a new peak."""
    gc.collect()
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


class Stages:
    """Peaks of stages, one after the other."""

    def __init__(self) -> None:
        self.rows: dict[str, dict[str, float]] = {}

    def run(self, name: str, work: Callable[[], Any]) -> Any:
        """Result of a stage whose peak, memory left and CPU seconds are noted under its name."""
        forget_peak()
        began = time.process_time()
        made = work()
        seconds = time.process_time() - began
        self.rows[name] = {"peak_mb": round(peak()), "after_mb": round(resident()), "cpu_s": round(seconds, 2)}
        return made


def sphere_recipe(facets: int, *changes: tuple[str, Any]) -> Any:
    """The remus scene with a sphere of 1 m, of about so many facets, in place of the vehicle."""
    from sonarsynth.recipe import reading

    edge = 1.0 / np.sqrt(facets / 20.0) * np.arccos(1 / np.sqrt(5)) * 1.178  # the longest is 1.175 times the mean arc
    shape = {"kind": "sphere", "radius": 1.0, "edge": float(edge)}
    sets = {"scene.world.targets.0.shape": shape, "scene.trajectory.frames": 2, **dict(changes)}
    return reading.load(RECIPE, tuple(f"{path}={json.dumps(value)}" for path, value in sets.items()))


def of_mesh(facets: int, refracted: bool = False) -> dict[str, Any]:
    """Peaks of a plan and a frame of a sphere of so many facets, by stage.

    The frame is made by the choices of a sphere of few facets; those of this one are made last.
    """
    from sonarsynth import planning

    changes = []
    if refracted:
        changes = [
            ("scene.world.environment.sound_speed", {"kind": "linear", "surface_speed": 1540.0, "gradient": 0.5})
        ]
    few = planning.plan(sphere_recipe(10_000, *changes)).choices
    recipe, stages = sphere_recipe(facets, *changes), Stages()
    start = resident()
    mesh = stages.run("mesh", lambda: recipe.scene_of(0).meshes[0])
    plan = stages.run("plan, choices given", lambda: planning.plan(recipe, choices=few))
    paths = _frame(stages, plan)
    stages.run("plan, choosing", lambda: planning.plan(recipe))
    worst = max(row["peak_mb"] for row in stages.rows.values())
    return {
        "facets": len(mesh.faces), "paths": paths, "import_mb": round(start), "peak_mb": worst,
        "stages": stages.rows,
    }  # fmt: skip


def _frame(stages: Stages, plan: Any) -> int:
    """Make the first frame of a plan by stages; how many paths it has."""
    from sonarsynth import pipeline
    from sonarsynth.labels import label
    from sonarsynth.planning import context_of
    from sonarsynth.signals.filtered_pulse import snap_levels

    traced = stages.run("trace and label", lambda: pipeline.trace_frame(plan, 0))
    found, frame = traced.arrivals, traced.frame
    context, levels = context_of(plan, frame), snap_levels(frame.moment.snaps)
    stages.run("label", lambda: label(context, plan.propagation, levels))
    stages.run("synthesise", lambda: pipeline.synthesise(plan, traced))
    heard = stages.run("beamform", lambda: pipeline.beamform_frame(plan, 0, replace(traced)))
    stages.run("range", lambda: pipeline.range_frame(plan, 0, traced, heard))
    return len(found.delay)


def of_worker(frames: int) -> dict[str, Any]:
    """Memory of one process that makes so many frames of the remus scene, none of them twice."""
    from sonarsynth import pipeline, planning
    from sonarsynth.recipe import reading

    interval = 6.3 / frames
    plan = planning.plan(
        reading.load(RECIPE, (f"scene.trajectory.frames={frames}", f"scene.trajectory.interval={interval}"))
    )
    read: dict[int, float] = {0: round(resident(), 1)}
    began = time.process_time()
    for index in range(frames):
        traced = pipeline.trace_frame(plan, index)
        pipeline.range_frame(plan, index, traced, pipeline.beamform_frame(plan, index, traced))
        if index + 1 in COUNTS or index + 1 == frames:
            read[index + 1] = round(resident(), 1)
    late = [(n, mb) for n, mb in read.items() if n >= min(100, frames // 2)]
    slope = float(np.polyfit(*zip(*late, strict=True), 1)[0]) if len(late) > 1 else float("nan")
    return {
        "frames": frames,
        "peak_mb": round(peak()),
        "resident_mb": read,
        "slope_mb_per_1000_frames": 1e3 * slope,
        "cpu_s": time.process_time() - began,
    }


def measured(call: str) -> dict[str, Any]:
    """What a call in this module gives in a process of its own."""
    code = f"import json; from benchmarks import memory; print(json.dumps(memory.{call}))"
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def bench() -> dict[str, Any]:
    """Every measurement."""
    return {
        "worker": [measured(f"of_worker({n})") for n in (10, 100, 1000)],
        "sphere": [measured(f"of_mesh({n})") for n in FACETS],
        "sphere, refracted": [measured(f"of_mesh({n}, True)") for n in FACETS[:2]],
    }
