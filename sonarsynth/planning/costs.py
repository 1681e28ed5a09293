"""What a plan costs: rows that `sonarsynth plan` prints.

Each method says what it costs (`Method.cost`): counts of work times seconds per unit of work, measured on one core of a
2-core AVX-512 machine (`tools/bench build`), here scaled by how fast this machine does a fixed set of transforms. What
no method owns is counted here. No frame is made: `schedule.predicting` makes some, and knows better.
"""

from __future__ import annotations

import time
from functools import lru_cache

import numpy as np

from sonarsynth.description.method import FrameSize
from sonarsynth.planning.choices import OF_BEAMS
from sonarsynth.planning.noise_rows import SIGNAL_TO_NOISE, SNR_BEAMS, noise_rows
from sonarsynth.planning.plan_tables import Stage
from sonarsynth.planning.plans import Plan
from sonarsynth.planning.reverberation_rows import reverberation_rows

REFERENCE_TRANSFORM = 1.42e-3
"""Seconds of the transforms in `machine_factor` on the machine where the constants below were measured."""

SECONDS = {
    "trace facet": 0.6e-6,  # straight rays, lit and seen, ray casting both ways, scattering law over the aperture
    "trace coherent facet": 2.2e-6,  # none of them is too faint
    "label beam": 0.25e-6,
    "label facet": 0.28e-6,
    "chorus path sensor": 11e-9,  # a pulse of 40 samples
    "chorus sensor sample": 10e-9,  # the filter behind all pulses
    "measure path": 1.3e-3,  # alone, at one hydrophone
    "remove sensor": 36e-6,
    "transform sensor sample": 1.6e-9,
    "steer beam bin": 4.5e-8,
    "envelope delay": 2e-8,
    "range cell": 1.2e-8,
    "write byte": 2e-9,
}
"""Seconds per unit of work."""
ILLUMINATED_FRACTION, COHERENT = 0.22, 0.35
"""Share of the facets of a closed body that are paths: lit, seen and not too faint; and of coherent ones."""
FILTERED_PULSE_COST = 1.9
"""Cost of synthesising a path whose pulse its facet reshapes, over that of one that repeats the snap."""


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


def _paths(plan: Plan) -> float:
    """Paths of one snap and family, each with the weight of its cost in the synthesis."""
    pairs = zip(plan.scene.laws, plan.scene.meshes, strict=True)
    shares = {True: COHERENT * FILTERED_PULSE_COST, False: ILLUMINATED_FRACTION}
    return _loose(plan) + sum(len(mesh.faces) * len(law.parts) * shares[law.coherent] for law, mesh in pairs)


def _loose(plan: Plan) -> int:
    """Scatterers that belong to no body."""
    return sum(field.count for field in plan.scene.world.scatterers)


def _tracing(plan: Plan, size: FrameSize) -> float:
    """Seconds to trace every facet once."""
    pairs = zip(plan.scene.laws, plan.scene.meshes, strict=True)
    per_facet = {law: SECONDS["trace coherent facet" if law else "trace facet"] for law in (False, True)}
    seconds = sum(len(mesh.faces) * per_facet[law.coherent] for law, mesh in pairs) + plan.propagation.cost(size)
    seconds += _loose(plan) * per_facet[False]
    return seconds


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


def frame_size(plan: Plan) -> FrameSize:
    """The sizes that the cost of methods grows with, of a frame of the plan's sequence."""
    sizes, sonar = plan.sizes, plan.scene.sonar
    gate = plan.windows.echo_duration
    return FrameSize(
        emissions=sizes["emission"],
        sensors=sizes["sensor"],
        samples=sizes["sample"],
        bins=max(round((sonar.band.high - sonar.band.low) * gate), 1) if np.isfinite(gate) else 1,
        beams=sizes["azimuth"] * sizes["elevation"],
        facets=sum(len(mesh.faces) for mesh in plan.scene.meshes) + _loose(plan),
        paths=_paths(plan) * max(sizes["emission"], 1) * _ways(plan),
        solid_angle=_solid_angle(plan),
        on_lattice=plan.elements.on_lattice,
        layers=len(plan.profile.depth),
    )


def _synthesis(plan: Plan, size: FrameSize) -> Row:
    """The row of the synthesis, in seconds of the reference machine."""
    scene = plan.scene
    work = plan.choices.synthesis.cost(size)
    if plan.chorus is not None:
        work += _chorus_paths(plan) * size.sensors * SECONDS["chorus path sensor"]
        work += size.sensors * size.samples * SECONDS["chorus sensor sample"]
    stored = size.sensors * size.samples * (2 if scene.sonar.converter else 4) if "signals" in plan.products else 0
    error = f"{plan.errors.synthesis:.1g} of the peak" if plan.errors.synthesis else "rounding"
    error = NOT_STATED if np.isnan(plan.errors.synthesis) else error
    why = (
        "requested"
        if "signals" in plan.products
        else f"needed by the {' and the '.join(sorted(plan.products - {'paths'}))}"
    )
    method = plan.choices.synthesis.row() + "".join(
        f", {noise.row()} noise" for noise in plan.scene.world.environment.noises
    )
    if plan.scene.world.chorus is not None:
        method += f", chorus of {plan.scene.world.chorus.row()}"
    return ("synthesise", method, why, error, work, stored)


def _chorus_paths(plan: Plan) -> float:
    """Paths of the chorus that are heard in a record, about."""
    chorus, reach = plan.scene.world.chorus, plan.chorus
    if chorus is None or reach is None:
        return 0.0
    record = plan.sizes["sample"] / plan.scene.sonar.sampling_frequency
    return float(chorus.rate * record * np.pi * reach.reach**2 * (1 + reach.images))


def _traced(plan: Plan) -> str:
    """How paths are traced, in words."""
    laws = ", ".join(dict.fromkeys(law.kind for law in plan.scene.laws))
    count = plan.choices.subarrays
    to = "the array" if count == 1 else f"each of {count} subarrays"
    if count == plan.elements.count > 1:
        to = "each hydrophone separately"
    if plan.choices.occlusion == "sensors":
        to += ", occlusion from each hydrophone"
    sources = ", ".join(dict.fromkeys(source.row() for source in plan.scene.world.sources))
    loose = ", ".join(field.row() for field in plan.scene.world.scatterers)
    words = [f"{plan.propagation.row()} to {to}", f"{plan.propagation.bounces} bounces", laws, sources, loose]
    return ", ".join(word for word in words if word)


def _why_so_traced(plan: Plan) -> str:
    """Why rays are straight or bent, in words."""
    if plan.propagation == plan.scene.physics.tracing:
        return "requested"
    if plan.profile.uniform:
        return "the sound speed is uniform"
    return "the sound speed varies" if plan.propagation.bends else "refraction is below the required accuracy"


def _steered(plan: Plan) -> str:
    """What the beamformer errs by, in words."""
    if np.isnan(plan.errors.image):
        return NOT_STATED
    if plan.errors.image == 0.0:
        return "rounding"
    measured = f"{plan.errors.image:.1g} dB rms of beams within 20 dB of the brightest, in the worst frame measured"
    return f"{measured}; others may err two to three times as much"


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


PATH_BYTES = 55
"""Of a stored path."""

Row = tuple[str, str, str, str, float, int]
"""A stage as `Stage` has it, in seconds of the reference machine."""


def _trace_rows(plan: Plan, size: FrameSize) -> list[Row]:
    """Paths, where any product needs them, and truth."""
    rows = list[Row]()
    if plan.products:
        traced = 1 if plan.choices.subarrays == 1 else 1 + plan.choices.subarrays
        seconds = _tracing(plan, size) * max(size.emissions, 1) * _ways(plan) * traced
        stored = PATH_BYTES * plan.sizes["path"] if "paths" in plan.products else 0
        rows.append(("trace", _traced(plan), _why_so_traced(plan), _expanded(plan), seconds, stored))
    seconds = size.beams * SECONDS["label beam"] + size.facets * SECONDS["label facet"] + plan.propagation.cost(size)
    return [*rows, ("label", "one ray per beam", "always", "none", seconds, size.beams * 10 + 4096)]


def _signal_rows(plan: Plan, size: FrameSize) -> list[Row]:
    """Signals, where any product needs them, and paths measured in signals of their own."""
    rows = [_synthesis(plan, size), *reverberation_rows(plan), *noise_rows(plan, size)] if plan.makes_sound else []
    if plan.makes_sound and (parts := plan.scene.sound_parts):
        rows.append(_signal_to_noise(plan, size, len(parts)))
    if "signals" in plan.products:
        seconds = max(size.emissions, 1) * (plan.sizes["target"] + 1) * SECONDS["measure path"]
        rows.append(("measure", "loudest path of each kind alone", "verify compares levels", "none", seconds, 0))
    return rows


def _signal_to_noise(plan: Plan, size: FrameSize, parts: int) -> Row:
    """The parts of the sound in the beams of targets, and the echoes of each of several targets alone."""
    targets, gate = plan.sizes["target"], plan.windows.echo_duration
    spectra = size.sensors * gate * plan.scene.sonar.sampling_frequency * SECONDS["transform sensor sample"]
    seconds = (parts + max(targets, 1)) * spectra + (parts + 1) * targets * 30 * size.bins * SECONDS["steer beam bin"]
    seconds += plan.choices.synthesis.cost(size) if targets > 1 else 0.0
    bound = f"{SNR_BEAMS} beams of a target"
    return (SIGNAL_TO_NOISE, "each part in the beams of each target", "always", bound, seconds, 0)


def _sonar_rows(plan: Plan, size: FrameSize) -> list[Row]:
    """What the sonar makes of signals."""
    if not plan.products & OF_BEAMS:
        return []
    gate = plan.windows.echo_duration
    locating, cancelling = plan.scene.processing.locating, plan.scene.processing.cancelling
    seconds = locating.cost(size)
    rows: list[Row] = [
        ("locate", locating.row(), "the echo window begins at the snap", "predicted, /source_estimates", seconds, 512)
    ]
    image = size.sensors * gate * plan.scene.sonar.sampling_frequency * SECONDS["transform sensor sample"]
    image += plan.choices.beamforming.cost(size)
    if plan.windows.direct_removed:  # and what is left of it imaged
        image = 2 * image + size.sensors * SECONDS["remove sensor"]
    if cancelling is not None:
        image += cancelling.cost(size)
    requested = "image" in plan.products
    why = "requested" if requested else "needed by the cloud"
    without = ", direct pulse removed" if plan.windows.direct_removed else ""
    without += "" if cancelling is None else f", {cancelling.row()} cancelling"
    rows.append(
        ("beamform", plan.choices.beamforming.row() + without, why, _steered(plan), image, 4 * size.beams * requested)
    )
    if "beams" in plan.products:
        delays = len(plan.beam_delays)
        description, count = f"envelopes of beams, {delays} delays", size.beams * delays
        seconds = size.beams * size.bins * SECONDS["steer beam bin"] + count * SECONDS["envelope delay"]
        rows.append(("resolve", description, "requested", "0.005 dB, rounding", seconds, 2 * count))
    rows += _range_image_row(plan, size)
    if "cloud" in plan.products:
        error = "predicted, /cloud/range_error" + _bent(plan)
        seconds = plan.choices.picking.cost(size) + plan.choices.placing.cost(size)
        method = f"{plan.choices.picking.row()}, {plan.choices.placing.row()}"
        rows.append(("range", method, "requested", error, seconds, 66 * plan.sizes["point"]))
    return rows


def _range_image_row(plan: Plan, size: FrameSize) -> list[Row]:
    """A row, where range images are asked for."""
    grid = plan.scene.sonar.ranges
    if "range_image" not in plan.products or grid is None:
        return []
    seconds = size.beams * (size.bins * SECONDS["steer beam bin"] + grid.count * SECONDS["range cell"])
    error, stored = "ranges by the assumed sound speed", 6 * plan.sizes["azimuth"] * grid.count
    return [("range image", f"{grid.count} ranges", "requested", error, seconds, stored)]


def stages(plan: Plan) -> tuple[Stage, ...]:
    """What each stage will do, why, its error, and what it costs in one frame."""
    size, factor = frame_size(plan), machine_factor()
    rows = [*_trace_rows(plan, size), *_signal_rows(plan, size), *_sonar_rows(plan, size)]
    total = sum(row[5] for row in rows)
    rows.append(("write", "zarr, blosc, crc32c", "always", "none", total * SECONDS["write byte"], 0))
    return tuple(Stage(a, b, c, d, seconds * factor, size) for a, b, c, d, seconds, size in rows)
