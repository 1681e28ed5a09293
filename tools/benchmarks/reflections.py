"""`tools/bench reflections`: what paths by surface and bottom cost a frame of the crossing over a thermocline."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

from sonarsynth.pipeline import beamform_frame, range_frame, synthesise, trace_frame
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import reading

RECIPE, FRAMES, SEEN = "configs/thermocline.yaml", (12, 24, 36, 48, 54), (10, 15, 20, 30, 40, 50)
DIRECT = ["scene.physics.tracing={kind: auto, bounces: 0}", "scene.processing.cancelling=null"]


def seconds(work: Callable[[], Any]) -> tuple[float, Any]:
    began = time.process_time()
    result = work()
    return time.process_time() - began, result


def frame(made: Plan, index: int) -> dict[str, float]:
    """Milliseconds of each stage of one frame; beamform holds synthesis, locating, cancelling and imaging."""
    trace, traced = seconds(lambda: trace_frame(made, index))
    beamform, heard = seconds(lambda: beamform_frame(made, index, traced))
    ranging, _ = seconds(lambda: range_frame(made, index, traced, heard))
    synthesis, _ = seconds(lambda: synthesise(made, traced))
    found = {"trace_and_label": trace, "synthesise_again": synthesis, "beamform": beamform, "range": ranging}
    total = trace + beamform + ranging
    return {f"{name}_ms": 1e3 * s for name, s in (found | {"frame": total}).items()} | {
        "paths": float(len(traced.arrivals.delay))
    }


def of(settings: list[str]) -> dict[str, float]:
    made = plan(reading.recipe_of(reading.read(RECIPE, settings)))
    for index in SEEN:  # compiles, and fills the tables that frames share
        frame(made, index)
    rows = [frame(made, index) for index in FRAMES]
    return {name: statistics.median(row[name] for row in rows) for name in rows[0]}


def bench() -> dict[str, Any]:
    """Medians over some frames on one core, and the ratio of whole frames."""
    direct, bounced = of(DIRECT), of([])
    return {
        "recipe": RECIPE,
        "direct": direct,
        "two_bounces": bounced,
        "ratio": bounced["frame_ms"] / direct["frame_ms"],
    }
