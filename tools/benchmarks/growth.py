"""`tools/bench growth`: how the time of planning and of a frame grows with what there is of everything. A table.

Processor time of one process, warm; a row for each size, of the remus recipe with one thing changed; the exponent is
that between the last two sizes of each: 1 is in proportion.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks.build import made
from benchmarks.timing import RECIPE, gemm, markdown
from sonarsynth import pipeline, planning
from sonarsynth.planning import choosing
from sonarsynth.recipe import reading

FRAMES = range(30, 35)
TARGET, SONAR = "scene.world.targets.0.shape", "scene.sonar"
TRACING = "scene.physics.tracing={{kind: auto, bounces: {0}}}"
LATTICE = "{{kind: planar_lattice, columns: {0}, rows: {0}, pitch: 5 cm}}"
SHRIMP = "{{kind: snapping_shrimp, name: s{0}, position: [{1}, {2}]}}"
BODY = (
    "{{name: b{0}, shape: {{kind: remus100, edge: 18 mm}}, "
    "motion: {{kind: line, start: [20, 4.5, {1}], stop: [20, -4.5, {1}], duration: 6.3 s}}}}"
)


def shrimp(count: int) -> str:
    """So many on the bottom about the one of the recipe, all of which snap in each frame."""
    places = [(n, 14.0 - 1.5 * (n % 4), -5.0 + 2.0 * (n // 4)) for n in range(count)]
    return f"scene.world.sources=[{', '.join(SHRIMP.format(*place) for place in places)}]"


def bodies(count: int) -> str:
    """So many above each other, none of which hides another from the array."""
    depths = np.linspace(-4.5, -1.5, count) if count > 1 else [-4.5]
    return f"scene.world.targets=[{', '.join(BODY.format(n, z) for n, z in enumerate(depths))}]"


GROWTHS = {
    "frames": [(f"scene.trajectory.frames={n}", f"scene.trajectory.interval={6.3 / n} s") for n in (64, 640, 6400)],
    "snaps": [(shrimp(n),) for n in (1, 4, 8)],
    "targets": [(bodies(n),) for n in (1, 2, 4, 8)],
    "facets": [(f"{TARGET}.edge={edge} mm",) for edge in (28, 18, 9)],
    "beams": [(f"{SONAR}.beams.azimuths={n}", f"{SONAR}.beams.elevations={n}") for n in (51, 101, 201)],
    "paths": [(TRACING.format(bounces),) for bounces in (0, 1, 2)],
    "hydrophones": [(f"{SONAR}.array={LATTICE.format(n)}",) for n in (13, 26, 46, 64)],
}
"""What grows, and the settings of each size; paths by how often their ways bounce."""


def measured(sets: tuple[str, ...]) -> dict[str, Any]:
    """Sizes of a recipe, seconds of planning, and ms of each stage of a frame, the median of a few."""
    recipe = reading.load(RECIPE, list(sets))
    choosing._CHOSEN.clear()  # what the process remembers of another plan
    began = time.process_time()
    plan = planning.plan(recipe, {"image", "cloud"})
    planned = time.process_time() - began
    made(plan, FRAMES)
    laps = [step.parts for step in made(plan, FRAMES)]
    stages = {stage: 1e3 * float(np.median([lap[stage] for lap in laps])) for stage in laps[0]}
    beams = plan.scene.sonar.beams
    sizes = {
        "facets": sum(len(mesh.faces) for mesh in plan.scene.meshes),
        "beams": beams.azimuths * beams.elevations,
        "hydrophones": plan.elements.count,
        "frames": recipe.frames,
        "snaps": plan.sizes["emission"],
        "targets": plan.sizes["target"],
        "paths": pipeline.trace_frame(plan, FRAMES[0]).arrivals.delay.size,
    }
    return {"sizes": sizes, "plan_seconds": planned, "stages_ms": stages, "frame_ms": sum(stages.values())}


def exponent(rows: list[dict[str, Any]], what: str, name: str) -> float:
    """Of a time, between the last two sizes of something."""
    (size, spent), (more, longer) = ((row["sizes"][what], row[name]) for row in rows[-2:])
    return float(np.log(longer / spent) / np.log(more / size))


def bench() -> dict[str, Any]:
    """Every growth, with exponents of planning and of a frame."""
    measured(())  # all is loaded
    found: dict[str, Any] = {"gemm_ms": gemm()}
    for what, settings in GROWTHS.items():
        rows = [measured(sets) for sets in settings]
        names = ("plan_seconds", "frame_ms")
        found[what] = {"rows": rows, "exponents": {name: exponent(rows, what, name) for name in names}}
    return found


def table(result: dict[str, Any]) -> str:
    """The result in Markdown."""
    rows = [["", "size", "plan, s", "frame, ms", "its longest stage, ms"]]
    for what in GROWTHS:
        for row in result[what]["rows"]:
            stage, longest = max(row["stages_ms"].items(), key=lambda item: item[1])
            size, planned = f"{row['sizes'][what]}", f"{row['plan_seconds']:.1f}"
            rows.append([what, size, planned, f"{row['frame_ms']:.0f}", f"{stage} {longest:.0f}"])
        plan, frame = result[what]["exponents"].values()
        rows.append(["exponent", "", f"{plan:.2f}", f"{frame:.2f}", ""])
    return "\n".join([
        *markdown(rows), "", f"A product of float32 matrices of 1024 by 1024: {result['gemm_ms']:.1f} ms",
    ])  # fmt: skip
