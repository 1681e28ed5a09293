"""`tools/bench images`: what images err by, against exact delays and all frequencies of the same signals. A table.

Errors are those of beams within 20 dB of the brightest. Of `remus.yaml` other settings than the plan's are tried too.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.timing import CONFIGS, markdown, once
from sonarsynth.conventions import Floats
from sonarsynth.frontiers.exact_frame import exact_plan
from sonarsynth.frontiers.image_knobs import image_of, imaged, off_by
from sonarsynth.pipeline import BeamformedFrame, beamform_frame, trace_frame
from sonarsynth.planning import Plan, plan
from sonarsynth.recipe import reading

STEPS = {"remus": 1, "thermocline": 2, "reef": 2, "crowd": 1, "tank": 1, "deep": 1, "grid": 6}
"""Recipes, and every which of their frames is looked at."""
SETTINGS: tuple[dict[str, Any], ...] = (
    {"bins": "all"},
    {"subarrays": (2, 2)},
    {"subarrays": (3, 3)},
)
"""Of `remus.yaml`, in place of the plan's."""


def bench() -> dict[str, Any]:
    """Errors of each recipe and setting."""
    rows = []
    for name, step in STEPS.items():
        made = plan(reading.load(CONFIGS / f"{name}.yaml"), {"image"})
        heard = [_heard(made, index) for index in range(0, made.recipe.frames, step)]
        pairs = [
            (of, frame, image_of(of, frame, exact_plan(of).choices.beamforming).energy)
            for of, frame in heard
            if imaged(frame)
        ]
        chosen: Any = made.choices.beamforming
        for method in (chosen, *(replace(chosen, **some) for some in (SETTINGS if name == "remus" else ()))):
            errors, spent = list[Floats](), list[float]()
            for of, frame, exact in pairs:
                image, seconds = once(lambda of=of, frame=frame, method=method: image_of(of, frame, method))
                errors.append(off_by(image.energy, exact))
                spent.append(seconds)
            each = np.array([np.sqrt(np.mean(error**2)) for error in errors])
            rows.append({
                "recipe": name, "frames": len(errors), "setting": method.row(), "bins": getattr(method, "bins", ""),
                "rms_db": float(np.sqrt(np.mean(each**2))), "least_frame_db": float(each.min()),
                "worst_frame_db": float(each.max()), "worst_beam_db": float(max(np.abs(e).max() for e in errors)),
                "ms": 1e3 * float(np.median(spent)),
            })  # fmt: skip
    return {"rows": rows}


def _heard(made: Plan, index: int) -> tuple[Plan, BeamformedFrame]:
    """The plan of the sequence of a frame, and what the frame heard."""
    of = made.at(index)
    return of, beamform_frame(of, index, trace_frame(of, index))


def table(result: dict[str, Any]) -> str:
    """A row for each recipe and setting."""
    rows = [("recipe, frames", "beamforming", "frequencies", "rms, dB", "frame by frame", "worst beam", "ms")]
    for row in result["rows"]:
        frames = f"{row['least_frame_db']:.3f} to {row['worst_frame_db']:.3f}"
        figures = f"{row['rms_db']:.3f}", frames, f"{row['worst_beam_db']:.2f}", f"{row['ms']:.1f}"
        rows.append((f"`{row['recipe']}.yaml`, {row['frames']}", row["setting"], row["bins"], *figures))
    return "\n".join(markdown(rows))
