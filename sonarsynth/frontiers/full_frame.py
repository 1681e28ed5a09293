"""A whole frame: the plan's choices, all of them, against everything done exactly."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.frontiers.exact_frame import ExactFrame, differences, exact_plan, signal_point
from sonarsynth.frontiers.image_knobs import apart, image_point, imaged
from sonarsynth.frontiers.rows import Point
from sonarsynth.frontiers.tracing_knobs import TracedBySensor
from sonarsynth.pipeline import BeamformedFrame, cloud_of, digitise, locate_and_image
from sonarsynth.planning import frame_start, receiver_of, survey_of
from sonarsynth.planning.measured.sampled_arrivals import pressures
from sonarsynth.planning.notes.source_notes import locator
from sonarsynth.products import Signals
from sonarsynth.validation.run_time import timed


@dataclass(frozen=True, eq=False)
class FullFrame:
    """What the sonar makes of a frame, of the plan's signals and of exact ones."""

    exact: ExactFrame
    beamformed: BeamformedFrame  # the plan's way
    seconds: float  # CPU of locating and all else that nothing is chosen for

    @staticmethod
    def of(exact: ExactFrame, signals: Signals) -> FullFrame:
        """Process the plan's signals (without noise)."""
        plan, frame = exact.plan, exact.frame
        recorded = digitise(plan, frame, signals)
        beamformed = locate_and_image(plan, frame, recorded)
        locating, receiver, survey = locator(plan.scene), receiver_of(plan, frame), survey_of(plan, frame)
        _, seconds = timed(lambda: locating.locate(recorded, receiver, survey, plan.sizes["emission"]))
        return FullFrame(exact, beamformed, seconds)


def whole_points(full: FullFrame, traced: TracedBySensor, seconds: float) -> Iterator[Point]:
    """Signals, image and cloud of the plan against exact ones; seconds: of the plan's whole frame.

    Image and cloud are compared with those of every hydrophone traced by itself, where all were. Noise is the same in
    both.
    """
    exact, plan, accuracy = full.exact, full.exact.plan, full.exact.plan.recipe.accuracy
    synthesised = _signals(exact, traced)
    error, largest = differences(synthesised, exact.pressures)
    yield signal_point(
        plan,
        "frame",
        "signals",
        "the plan",
        error,
        seconds,
        chosen=True,
        also={"largest": largest, "hydrophones": len(exact.sensor)},
        note=exact.partly,
    )
    if not (exact.whole and imaged(full.beamformed)):
        return
    slow, frame = exact_plan(plan), exact.frame
    rate, start = plan.scene.sonar.sampling_frequency, frame_start(plan, frame)
    signals = Signals(exact.pressure.astype(np.float32), start, rate, 0.0, 0, 0)
    began = time.process_time()
    best = locate_and_image(slow, frame, digitise(plan, frame, signals))
    if not imaged(best):
        return
    cloud = cloud_of(slow, frame, best)
    slowest = time.process_time() - began + sum(exact.single.seconds)
    yield Point("frame", "exact", "everything exact", 0.0, "relative", accuracy.signal, slowest)
    assert full.beamformed.image is not None and best.image is not None
    energies = full.beamformed.image.energy, best.image.energy
    yield replace(image_point(plan, *energies, "image", "the plan", seconds, chosen=True), stage="frame")
    metres, angle, alone = apart(cloud_of(plan, frame, full.beamformed), cloud)
    yield Point(
        stage="frame",
        knob="range",
        setting="the plan",
        error=float(np.median(metres)) if len(metres) else 0.0,
        unit="m",
        allowed=accuracy.range_m,
        seconds=seconds,
        chosen=True,
        also={
            "largest": float(np.max(metres, initial=0.0)),
            "direction_rad": float(np.max(angle, initial=0.0)),
            "points": len(metres),
            "in_one_alone": alone,
        },
        note="median: a beam may take another of its echoes",
    )


def _signals(exact: ExactFrame, traced: TracedBySensor) -> tuple[np.ndarray, np.ndarray]:
    """Echoes and direct arrivals (heard, sample) by the plan's own synthesis."""
    out = tuple(np.zeros((len(exact.sensor), exact.plan.windows.samples)) for _ in range(2))
    for subarray, arrivals in traced.pieces:
        rows = np.flatnonzero(np.isin(exact.sensor, subarray.sensor))
        own = np.searchsorted(subarray.sensor, exact.sensor[rows])
        received = pressures(exact.plan, exact.frame, arrivals, subarray.elements, exact.plan.choices.synthesis)
        for total, values in zip(out, received, strict=True):
            total[rows] = values[own]
    return out[0], out[1]
