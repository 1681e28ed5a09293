"""What a plan costs: rows that `sonarsynth plan` prints.

Costs are counts of work times seconds per unit of work, measured on one core of a 2-core AVX-512 machine (`tools/bench
frame`), scaled by how fast this machine does a fixed set of transforms. Predictions are for one core, and quick: no
frame is made. `schedule.predicting` makes some, and knows better.
"""

from __future__ import annotations

import time
from functools import lru_cache

import numpy as np

from sonarsynth.planning.plan_tables import Stage
from sonarsynth.planning.plans import Plan

REFERENCE_TRANSFORM = 1.42e-3
"""Seconds of the transforms in `machine_factor` on the machine where the constants below were measured."""

SECONDS = {
    "trace facet": 1.25e-6,  # straight rays, lit and seen, ray casting both ways, scattering law over the aperture
    "trace coherent facet": 2.2e-6,  # none of them is too faint
    "trace refracted facet": 3e-6,  # eigenrays to the centre and to the probes of the aperture
    "label beam": 0.25e-6,
    "label facet": 0.28e-6,
    "label refracted facet": 1.8e-6,
    "synthesise path sensor": 1.0e-9,
    "synthesise path sensor steradian": 3.6e-6,  # the wider a target, the more nodes and tiles
    "synthesise sensor sample": 4.5e-9,
    "measure path": 1.3e-3,  # alone, at one hydrophone
    "remove sensor": 36e-6,
    "transform sensor sample": 1.6e-9,
    "image beam bin": 1.2e-9,
    "range beam": 70e-6,
    "write byte": 12e-9,
}
"""Seconds per unit of work."""
ILLUMINATED_FRACTION, COHERENT = 0.22, 0.35
"""Share of the facets of a closed body that are paths: lit, seen and not too faint; and of coherent ones."""
FILTERED_PULSE_COST = 1.9
"""Cost of synthesising a path whose pulse its facet reshapes, over that of one that repeats the snap."""
RANGED_BEAMS = 60
"""Beams over threshold round one glint."""


@lru_cache(maxsize=1)
def machine_factor() -> float:
    """How much slower this machine is than the one where SECONDS was measured (best of five, about 10 ms in all)."""
    row, best = np.ones(4096, np.float32), np.inf  # short: large arrays cost mostly the pages that they are cleared in
    for _ in range(5):
        began = time.thread_time()
        for _ in range(64):
            np.fft.rfft(row)
        best = min(best, time.thread_time() - began)
    return float(best / REFERENCE_TRANSFORM)


NOT_STATED = "not stated by the method"

QUINTIC_COST = 1.6
"""Times what cubics over the array take, polynomials of the fifth degree take to trace."""


def _facets(plan: Plan) -> int:
    return sum(len(mesh.faces) for mesh in plan.scene.meshes)


def _paths(plan: Plan) -> float:
    """Paths of one snap and family, each with the weight of its cost in the synthesis."""
    pairs = zip(plan.scene.laws, plan.scene.meshes, strict=True)
    shares = {True: COHERENT * FILTERED_PULSE_COST, False: ILLUMINATED_FRACTION}
    return sum(len(mesh.faces) * len(law.parts) * shares[law.coherent] for law, mesh in pairs)


def _tracing(plan: Plan, kind: str) -> float:
    """Seconds to trace every facet once."""
    pairs = zip(plan.scene.laws, plan.scene.meshes, strict=True)
    extra = SECONDS["trace coherent facet"] - SECONDS["trace facet"]
    each = SECONDS[f"trace {kind}facet"]
    whole = sum(len(mesh.faces) * (each + extra * law.coherent) for law, mesh in pairs)
    return whole * (QUINTIC_COST if plan.choices.degree > 3 else 1.0)


def _ways(plan: Plan) -> int:
    """Pairs of families, out and back, with as many reflections in all as are asked for: 1, 5, 13, 25, ..."""
    n = plan.propagation.bounces
    return 2 * n * (n + 1) + 1


def _solid_angle(plan: Plan) -> float:
    """Largest solid angle (sr) of the box round a target, seen from the array in the first frame."""
    frame = plan.recipe.frame(0)[1]
    angles = [0.0]
    for body in frame.moment.bodies:
        sides = np.sort(np.ptp(body.mesh.box, axis=0))
        distance = max(float(np.linalg.norm(body.pose.position - frame.sonar_pose.position)), float(sides[-1]))
        angles.append(float(sides[-1] * sides[-2]) / distance**2)
    return max(angles)


def _synthesis(plan: Plan) -> Row:
    """The row of the synthesis, in seconds of the reference machine."""
    scene, sizes = plan.scene, plan.sizes
    sensor_samples = sizes["sensor"] * sizes["sample"]
    paths = _paths(plan) * max(sizes["emission"], 1) * _ways(plan)
    each = SECONDS["synthesise path sensor"] + _solid_angle(plan) * SECONDS["synthesise path sensor steradian"]
    work = paths * sizes["sensor"] * each + sensor_samples * SECONDS["synthesise sensor sample"]
    noise = scene.world.environment.noise
    if noise is not None:
        work += noise.seconds(sizes["sensor"], sizes["sample"])
    stored = sensor_samples * (2 if scene.sonar.converter else 4) if "signals" in plan.products else 0
    error = f"{plan.errors.synthesis:.1g} of the peak" if plan.errors.synthesis else "rounding"
    error = NOT_STATED if np.isnan(plan.errors.synthesis) else error
    why = "requested" if "signals" in plan.products else f"needed by the {' and the '.join(sorted(plan.products))}"
    method = plan.choices.synthesis.row() + ("" if noise is None else f", {noise.row()} noise")
    return ("synthesise", method, why, error, work, stored)


def _traced(plan: Plan) -> str:
    """How paths are traced, in words."""
    laws = ", ".join(dict.fromkeys(law.kind for law in plan.scene.laws))
    parts = plan.choices.subarrays
    to = "the array" if parts == 1 else f"each of {parts} subarrays"
    if parts == plan.elements.count > 1:
        to = "each hydrophone separately"
    if plan.choices.degree > 3 and parts < plan.elements.count:
        to += f", degree {plan.choices.degree}"
    if plan.choices.occlusion == "sensors":
        to += ", occlusion from each hydrophone"
    sources = ", ".join(dict.fromkeys(source.row() for source in plan.scene.world.sources))
    words = [f"{plan.propagation.row()} to {to}", f"{plan.propagation.bounces} bounces", laws, sources]
    return ", ".join(word for word in words if word)


def _steered(plan: Plan) -> str:
    """What the beamformer errs by, in words."""
    if np.isnan(plan.errors.image):
        return NOT_STATED
    if plan.errors.image == 0.0:
        return "rounding"
    return f"{plan.errors.image:.1g} dB rms of beams within 20 dB of the brightest, measured"


def _bent(plan: Plan) -> str:
    """What straight paths in bending water do to ranges, in words."""
    return f"; bent rays {100.0 * plan.errors.ranging:.1g} cm" if plan.errors.ranging > 0.0 else ""


def _expanded(plan: Plan) -> str:
    """What tracing errs by, in words."""
    if np.isnan(plan.errors.expansion):
        return "not measured"
    if plan.errors.expansion == 0.0:
        return "none"
    return f"{plan.errors.expansion:.1g} of the signals, measured at some hydrophones"


Row = tuple[str, str, str, str, float, int]
"""A stage as `Stage` has it, in seconds of the reference machine."""


def _trace_rows(plan: Plan) -> list[Row]:
    """Paths, where any product needs them, and truth."""
    sizes = plan.sizes
    straight = not plan.propagation.bends
    kind, rows = "" if straight else "refracted ", list[Row]()
    if plan.products:
        traced = 1 if plan.choices.subarrays == 1 else 1 + plan.choices.subarrays
        why = "refraction is below the required accuracy" if straight else "the sound speed varies with depth"
        seconds = _tracing(plan, kind) * max(sizes["emission"], 1) * _ways(plan) * traced
        rows.append(("trace", _traced(plan), why, _expanded(plan), seconds, 0))
    beams = sizes["azimuth"] * sizes["elevation"]
    seconds = beams * SECONDS["label beam"] + _facets(plan) * SECONDS[f"label {kind}facet"]
    return [*rows, ("label", "one ray per beam", "always", "none", seconds, beams * 10 + 4096)]


def _signal_rows(plan: Plan) -> list[Row]:
    """Signals, where any product needs them, and paths measured in signals of their own."""
    rows = [_synthesis(plan)] if plan.products else []
    if "signals" in plan.products:
        seconds = max(plan.sizes["emission"], 1) * (plan.sizes["target"] + 1) * SECONDS["measure path"]
        rows.append(("measure", "loudest path of each kind alone", "verify compares levels", "none", seconds, 0))
    return rows


def _sonar_rows(plan: Plan) -> list[Row]:
    """What the sonar makes of signals."""
    if not plan.products & {"image", "cloud"}:
        return []
    sonar, sizes = plan.scene.sonar, plan.sizes
    beams, gate = sizes["azimuth"] * sizes["elevation"], plan.windows.echo_stop - plan.windows.echo_start
    locating, cancelling = plan.scene.processing.locating, plan.scene.processing.cancelling
    seconds = locating.seconds(sizes["sensor"])
    rows: list[Row] = [
        ("locate", locating.row(), "the echo window begins at the snap", "predicted, /source_estimates", seconds, 512)
    ]
    image = sizes["sensor"] * gate * sonar.sampling_frequency * SECONDS["transform sensor sample"]
    image += beams * (sonar.band.high - sonar.band.low) * gate * SECONDS["image beam bin"]
    if plan.windows.direct_removed:  # and what is left of it imaged
        image = 2 * image + sizes["sensor"] * SECONDS["remove sensor"]
    if cancelling is not None:
        image += cancelling.seconds(sizes["sensor"])
    asked = "image" in plan.products
    why = "requested" if asked else "needed by the cloud"
    without = ", direct pulse removed" if plan.windows.direct_removed else ""
    without += "" if cancelling is None else f", {cancelling.row()} cancelling"
    rows.append(("beamform", plan.choices.beamforming.row() + without, why, _steered(plan), image, 4 * beams * asked))
    if "cloud" in plan.products:
        error, seconds = "predicted, /cloud/range_error" + _bent(plan), RANGED_BEAMS * SECONDS["range beam"]
        method = f"{plan.choices.picking.row()}, {plan.choices.placing.row()}"
        rows.append(("range", method, "requested", error, seconds, 66 * sizes["point"]))
    return rows


def stages(plan: Plan) -> tuple[Stage, ...]:
    """What each stage will do, why, its error, and what it costs in one frame."""
    rows, factor = [*_trace_rows(plan), *_signal_rows(plan), *_sonar_rows(plan)], machine_factor()
    total = sum(row[5] for row in rows)
    rows.append(("write", "zarr, blosc-zstd, crc32c", "always", "none", total * SECONDS["write byte"], 0))
    return tuple(Stage(a, b, c, d, seconds * factor, size) for a, b, c, d, seconds, size in rows)
