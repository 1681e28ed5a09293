"""Knobs of the synthesis: width, tolerance, precision and oversampling of the deposit, and the direct sum.

That of reverberation: fewer scatterers in place of many, which change its contrast and not its mean.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from sonarsynth.conventions import evenly
from sonarsynth.frontiers.exact_frame import Pressures, differences, golden, signal_point
from sonarsynth.frontiers.rows import Point
from sonarsynth.frontiers.tracing_knobs import TracedBySensor
from sonarsynth.pipeline.frame_reverberation import frame_reverberation, with_reverberation
from sonarsynth.planning import Plan
from sonarsynth.planning.measured.sampled_arrivals import pressures, reception_of
from sonarsynth.products import Signals
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import DirectSum, GriddedSynthesis, Synthesis
from sonarsynth.signals.auto_synthesis import PRECISIONS, deposit_for
from sonarsynth.signals.gridded_synthesis import kernel_error
from sonarsynth.tracing.reverberation.families import contrast_error
from sonarsynth.validation.run_time import timed

WIDEST = 14
OVER_KERNEL = (1.0, 10.0, 100.0)
"""Tolerances that are walked with each width, over the error of its kernel."""
FROM, TO = 1e-3, 30.0
"""Tolerances are walked from here to there, over the error that is allowed."""
OVERSAMPLINGS = (1.25, 2.0)
AUTO = tuple(10.0**e for e in (-1.5, -2, -2.5, -3, -3.5, -4, -5, -6, -7))
"""Errors that the planner's own choice is walked over."""
SPECKLES = (1.0, 0.3, 0.1, 0.03, 0.01)
"""Errors of the contrast of reverberation that are walked."""
FINER = 0.01
"""Error of what is compared with, over that of the exact way's synthesis."""
SUMMED_HYDROPHONES, SUMMED_PATHS = (1, 8), 50
"""What the direct sum is timed on."""


def synthesis_points(traced: TracedBySensor) -> Iterator[Point]:
    """Walk the knobs of the synthesis on the arrivals that the plan's choices give."""
    plan, chosen = traced.plan, traced.plan.choices.synthesis
    finest = golden(plan, FINER)
    exact = [_synthesised(traced, finest, n) for n in range(len(traced.few))]
    yield _point(traced, exact, chosen, "chosen", chosen=True)
    if isinstance(chosen, GriddedSynthesis):
        for knob, method in _settings(chosen, plan.recipe.accuracy.signal):
            yield _point(traced, exact, method, knob)
    if len(traced.few[0][1].delay):
        yield direct_sum_point(traced)


def _settings(chosen: GriddedSynthesis, allowed: float) -> Iterator[tuple[str, GriddedSynthesis]]:
    """Every setting that is walked, with the name of its knob."""
    yielded = {chosen}
    for knob, method in (
        *(("auto", deposit_for(error)) for error in AUTO),
        *(
            (f"width {width}, {precision}", _rounded(replace(chosen, width=width, precision=precision), times))
            for precision, least in zip(PRECISIONS, (4, 8), strict=True)
            for width in range(least, WIDEST + 1, 2)
            for times in OVER_KERNEL
        ),
        *(("oversampling", replace(chosen, oversampling=times)) for times in OVERSAMPLINGS),
        ("precision", replace(chosen, precision="float64" if chosen.precision == "float32" else "float32")),
    ):
        fits = FROM * allowed <= method.tolerance <= TO * allowed
        if method not in yielded and fits and (method.precision == "float64" or method.tolerance > 1e-7):
            yielded.add(method)
            yield knob, method


def _rounded(method: GriddedSynthesis, times: float) -> GriddedSynthesis:
    """A method with a tolerance of so many times the error of its kernel."""
    wanted = times * kernel_error(method.width, method.oversampling)
    return replace(method, tolerance=float(f"{min(max(wanted, 1e-10), 0.05):.0e}"))


def _synthesised(traced: TracedBySensor, method: Synthesis, n: int) -> Pressures:
    piece, arrivals = traced.few[n]
    return pressures(traced.plan, traced.frame, arrivals, piece.elements, method)


def _point(
    traced: TracedBySensor, exact: list[Pressures], method: Synthesis, knob: str, *, chosen: bool = False
) -> Point:
    plan, few = traced.plan, traced.few
    received = [_synthesised(traced, method, n) for n in range(len(few))]
    error, largest = differences(
        [np.vstack([m[n] for m in received]) for n in (0, 1)], [np.vstack([e[n] for e in exact]) for n in (0, 1)]
    )
    seconds = replace(traced, plan=replace(plan, choices=replace(plan.choices, synthesis=method))).synthesis_seconds()
    return signal_point(
        plan,
        "synthesis",
        knob,
        named(method),
        error,
        seconds,
        chosen=chosen,
        also={"largest": largest},
        note="" if len(few) == traced.parts else f"on {len(few)} of {traced.parts} parts",
    )


def named(method: Synthesis) -> str:
    """A method in a few words."""
    if not isinstance(method, GriddedSynthesis):
        return "direct sum"
    return f"width {method.width}, {method.tolerance:g}, {method.precision}, x {method.oversampling:g}"


def direct_sum_point(traced: TracedBySensor) -> Point:
    """The direct sum: no error; its cost from a few hydrophones and paths."""
    plan, (piece, arrivals) = traced.plan, traced.few[0]
    arrivals = arrivals.seen_from_centre  # they have as many terms at hydrophones that miss some
    paths = np.array(evenly(len(arrivals.delay), SUMMED_PATHS))
    seconds = []
    for count in SUMMED_HYDROPHONES:
        elements = subarray(piece.elements, np.resize(np.arange(piece.elements.count), count)).elements
        reception = reception_of(plan, traced.frame)._replace(elements=elements)
        summed = partial(DirectSum().pressure, arrivals.select(paths), traced.frame.moment.snaps, reception)
        seconds.append(timed(summed, 1)[1])
    few, more = SUMMED_HYDROPHONES
    per_hydrophone = max(seconds[1] - seconds[0], 0.0) / (more - few)  # of a hydrophone; the pulses' spectra serve all
    live = int(np.count_nonzero(plan.elements.gain))
    once = max(seconds[0] - few * per_hydrophone, 0.0)
    return signal_point(
        plan,
        "synthesis",
        "direct sum",
        "direct sum",
        0.0,
        (once * traced.parts + per_hydrophone * live) * len(arrivals.delay) / len(paths),
        chosen=isinstance(plan.choices.synthesis, DirectSum),
        note=f"cost from {len(paths)} paths at {few} and {more} hydrophones",
    )


def speckle_points(plan: Plan, frame: Frame, signals: Signals) -> Iterator[Point]:
    """The contrast that a frame's scatterers err by, counted, and how far their energy is from that of the most of
    them, beside the CPU time of finding and hearing them; nothing where nothing scatters."""
    if plan.scene.world.reverberation is None:
        return
    chosen = plan.recipe.accuracy.speckle
    band, rows = plan.scene.sonar.band, []
    for speckle in sorted({*SPECKLES, chosen}, reverse=True):
        accuracy = replace(plan.recipe.accuracy, speckle=speckle)
        other = replace(plan, recipe=replace(plan.recipe, accuracy=accuracy))
        began = time.process_time()
        try:
            arrivals = frame_reverberation(other, frame)
        except ValueError:  # more scatterers than a frame may have
            break
        with_reverberation(other, frame, signals, arrivals)
        if arrivals is None or not len(arrivals.delay):
            return
        rows.append((speckle, arrivals, time.process_time() - began))
    most = float(rows[-1][1].energy.sum())
    for speckle, arrivals, seconds in rows:
        level = float(10.0 * np.log10(arrivals.energy.sum() / most))
        yield Point(
            stage="reverberation",
            knob="speckle",
            setting=f"{speckle:g}",
            error=contrast_error(arrivals, band.high - band.low),
            unit="of the contrast",
            allowed=chosen,
            seconds=seconds,
            chosen=speckle == chosen,
            also={"scatterers": float(len(arrivals.delay)), "level_db": level},
        )
