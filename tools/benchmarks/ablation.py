"""`tools/bench ablation`: what each part of the array expansion is worth, in every shipped recipe. A table.

A frame is traced in one view from the middle of the array, and each part is left out by itself. Echoes: error at a few
hydrophones that the planner does not measure at, against each of them traced by itself, every path. Image: root mean
square, in dB, of what leaving the part out changes, over the beams within 20 dB of the brightest. Time: processor time
of tracing and synthesis. Two scenes are in no recipe: a fast target and a fast sonar.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from same_numbers import harbour

from benchmarks.timing import CONFIGS, once
from sonarsynth.conventions import Floats
from sonarsynth.frontiers.exact_frame import differences, each_hydrophone, golden, pressures, spread
from sonarsynth.frontiers.image_knobs import imaged, off_by
from sonarsynth.pipeline import digitise, locate_and_image
from sonarsynth.pipeline.synthesis import array_signals, true_elements
from sonarsynth.planning import Plan, arrivals_of, plan
from sonarsynth.products import Arrivals
from sonarsynth.products.array_expansion import QUANTITIES
from sonarsynth.recipe import reading
from sonarsynth.recipe.scene import Frame

FAST = {
    "remus, target at 10 m/s": ("remus", "scene.world.targets.0.motion.duration=0.9 s", "scene.trajectory.frames=8"),
    "remus, sonar at 5 m/s": (
        "remus",
        "scene.trajectory.sonar={kind: course, start: [0, 0, -5], heading: 90 deg, speed: 5 m/s}",
        "scene.trajectory.frames=8",
    ),
}
HYDROPHONES, TIMES = 8, 3


def without(arrivals: Arrivals, part: str) -> Arrivals:
    """Arrivals of which all sensors have what the centre has of a part; of the motion of an array, no delay is left."""
    terms = getattr(arrivals.expansion, part).copy()
    kept = arrivals.expansion.first(2) if part == "delay" else 0
    terms[:, kept:] = 0.0
    return replace(arrivals, expansion=replace(arrivals.expansion, **{part: terms}))


def fastest(work: Callable[[], Any]) -> tuple[Any, float]:
    """What it gives, and the least processor time (s) of a few runs."""
    runs = [once(work) for _ in range(TIMES)]
    return runs[-1][0], min(seconds for _, seconds in runs)


def echoes_at(made: Plan, frame: Frame, arrivals: Arrivals, sensor: Any) -> tuple[Floats, Floats]:
    """Echoes and direct arrivals at some hydrophones, of arrivals at the whole array."""
    there = arrivals.for_sensors(sensor, made.elements.count)
    return pressures(made, frame, there, made.elements.select(sensor), golden(made))


def energy(made: Plan, frame: Frame, arrivals: Arrivals) -> Floats | None:
    """The image of a frame, of arrivals at the whole array."""
    signals = digitise(made, frame, array_signals(made, frame, arrivals, true_elements(made, frame)))
    beamformed = locate_and_image(made, frame, signals)
    return np.asarray(beamformed.image.energy) if imaged(beamformed) and beamformed.image is not None else None


def frame_rows(made: Plan, index: int) -> list[dict[str, Any]]:
    """A row of each part of the expansion, of a frame."""
    made = made.at(index)
    frame = made.recipe.frame(index)[1]
    choices = made.choices
    whole = replace(made, choices=replace(choices, subarrays=1))
    sensor = spread(np.flatnonzero(made.elements.gain), HYDROPHONES)
    every = replace(made, choices=replace(choices, negligible=1e-3 * choices.negligible))
    exact = each_hydrophone(every, frame, sensors=sensor).pressures
    rows: list[dict[str, Any]] = []

    def row(part: str, of: Plan, arrivals: Arrivals, seconds: float) -> None:
        _, made_in = fastest(lambda: array_signals(of, frame, arrivals, of.elements))
        error, picture = differences(echoes_at(of, frame, arrivals, sensor), exact)[0], energy(of, frame, arrivals)
        if not rows:
            rows.append({"image": picture, "ms": 1e3 * (seconds + made_in)})
        full = rows[0]["image"]
        off = None if full is None or picture is None else off_by(picture, full)
        rows.append({
            "frame": index, "part": part, "echoes": error, "ms": 1e3 * (seconds + made_in),
            "db": float(np.sqrt(np.mean(off**2))) if off is not None else float("nan"),
        })  # fmt: skip

    arrivals, seconds = fastest(lambda: arrivals_of(whole, frame))
    row("nothing", whole, arrivals, seconds)
    for part in QUANTITIES:
        if getattr(arrivals.expansion, part).any():
            row(part, whole, without(arrivals, part), seconds)
    if choices.occlusion == "sensors":
        centre = replace(whole, choices=replace(whole.choices, occlusion="centre"))
        row("own occlusion", centre, *fastest(lambda: arrivals_of(centre, frame)))
    return rows[1:]


def bench() -> dict[str, Any]:
    """Every part in every recipe, at errors of signals of 1e-3 and of 1e-2."""
    found: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        given = {"harbour": ("harbour", *harbour.written(Path(folder)))}
        scenes = {path.stem: (path.stem,) for path in sorted(CONFIGS.glob("*.yaml"))} | given | FAST
        for name, (recipe, *sets) in scenes.items():
            for signal in ("1e-3", "1e-2"):
                made = plan(reading.load(CONFIGS / f"{recipe}.yaml", [*sets, f"accuracy.signal={signal}"]), {"image"})
                frames = sorted({int(share * made.recipe.frames) for share in (0.37, 0.81)})
                found[f"{name}, {signal}"] = {
                    "chosen": {k: getattr(made.choices, k) for k in ("subarrays", "occlusion")},
                    "rows": [row for index in frames for row in frame_rows(made, index)],
                }
    return found


def table(found: dict[str, Any]) -> str:
    """A line of each row."""
    lines = []
    for name, scene in found.items():
        lines.append(f"{name}: {scene['chosen']}")
        lines += [
            f"  frame {r['frame']:5d}  without {r['part']:20s} echoes {r['echoes']:8.1e}  image {r['db']:6.3f} dB"
            f"  {r['ms']:7.1f} ms"
            for r in scene["rows"]
        ]
    return "\n".join(lines)
