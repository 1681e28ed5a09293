"""`tools/bench reef`: what a frame of reef.yaml, a living sea, costs over one of the same scene in a silent sea.

The silent sea is reef.yaml without its chorus, its reverberation and the noise of wind: the same target, snap,
boundaries, array, electronics, errors of sensors and products. Beside it are remus.yaml, which has neither errors of
sensors nor electronics, and the reef without one part at a time. One core; all products; frames of all in turn, so that
what else the machine does falls on all alike; ratios are medians of those of single frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from benchmarks.build import made
from benchmarks.timing import CONFIGS, gemm, markdown, once
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import reading

FRAMES = range(4, 64, 5)
CHORUS, ANSWER, NOISE = (f"scene.world.{name}=null" for name in ("chorus", "reverberation", "environment.noise"))
SEAS: dict[str, tuple[str, ...]] = {
    "reef.yaml": (),
    "in a silent sea": (CHORUS, ANSWER, NOISE),
    "without the chorus": (CHORUS,),
    "without reverberation": (ANSWER,),
}


def bench() -> dict[str, Any]:
    """Measure each sea."""
    plans = {name: _planned("reef.yaml", *settings) for name, settings in SEAS.items()}
    plans["remus.yaml"] = _planned("remus.yaml")
    for sea in plans.values():
        made(sea, FRAMES[:1])  # compiles, and fills tables
    spent = {name: list[Mapping[str, float]]() for name in plans}
    total = {name: list[float]() for name in plans}
    for frame in FRAMES:
        for name, sea in plans.items():
            (step,), seconds = once(partial(made, sea, [frame]))
            spent[name].append(step.parts)
            total[name].append(seconds)
    living = np.array(total["reef.yaml"])
    return {
        "gemm_ms": gemm(),
        "seas": {
            name: {
                "ms": 1e3 * float(np.median(seconds)),
                "reef_over_it": float(np.median(living / np.array(seconds))),
                "stages": {s: 1e3 * float(np.median([x.get(s, 0.0) for x in spent[name]])) for s in spent[name][0]},
            }
            for name, seconds in total.items()
        },
    }


def table(found: dict[str, Any]) -> str:
    """Time of a frame of each sea, and the ratio; stages below."""
    rows = [("sea", "CPU, ms a frame", "reef.yaml over it")]
    rows += [(name, f"{sea['ms']:.0f}", f"{sea['reef_over_it']:.2f}") for name, sea in found["seas"].items()]
    stages = dict.fromkeys(stage for sea in found["seas"].values() for stage in sea["stages"])
    ms = [("stage, ms", *found["seas"])]
    ms += [(s, *(f"{sea['stages'].get(s, 0.0):.1f}" for sea in found["seas"].values())) for s in stages]
    return "\n".join([*markdown(rows), "", *markdown(ms), "", f"a product of 1024 cubed: {found['gemm_ms']:.0f} ms"])


def _planned(name: str, *settings: str) -> Plan:
    return plan(reading.load(CONFIGS / name, list(settings)))
