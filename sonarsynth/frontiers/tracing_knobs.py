"""Knobs of tracing: into how many parts the array is cut, how faint paths may be, and whether rays bend.

A knob is varied with all others exact, so that what they leave out does not hide it: its errors, against the frame from
its description alone, tend to that of every hydrophone traced by itself. What would cost less than the plan's choice is
measured with the rest as chosen, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile

import numpy as np

from sonarsynth.conventions import Ints, evenly
from sonarsynth.frontiers.exact_frame import (
    ExactFrame,
    Pressures,
    SensorPressures,
    differences,
    each_hydrophone,
    exact_plan,
    golden,
    signal_point,
)
from sonarsynth.frontiers.rows import Point
from sonarsynth.planning import Plan, arrivals_of
from sonarsynth.planning.measured.sampled_arrivals import pressures, reception_of
from sonarsynth.products import Arrivals
from sonarsynth.propagation import Straight
from sonarsynth.receiver.subarrays import Subarray, subarrays
from sonarsynth.recipe.scene import Frame
from sonarsynth.tracing.facet_paths import way_to_array
from sonarsynth.validation.run_time import timed

DYNAMIC_RANGES = (30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 100.0)
"""dB: levels under which the faintest echoes of each target are left out."""
TIMED = 6
"""Parts that the synthesis is timed on."""
FINER = 0.05
"""Where a cut errs by so much of what is allowed, finer ones are not walked."""
EACH = 3
"""Hydrophones at which what is traced to each by itself is compared."""
LONGEST, SLOWER = 3.0, 4.0
"""Cuts that would take longer a frame than so many s, and so many times the plan's own, are not walked."""


@dataclass(frozen=True, eq=False)
class TracedBySensor:
    """A frame traced to those parts of an array that hold some hydrophones."""

    plan: Plan
    frame: Frame
    pieces: tuple[tuple[Subarray, Arrivals], ...]
    parts: int  # of the whole array
    seconds: float  # of all parts; and of the whole array, which truth and link budget need

    @staticmethod
    def of(plan: Plan, frame: Frame, sensor: Ints) -> TracedBySensor:
        """Trace with the subarrays, the faintest paths and the propagation of a plan (that of the sequence)."""
        count, elements = plan.choices.subarrays, plan.elements
        traced, seconds = timed(lambda: _traced_anew(plan, frame))
        if count == 1:
            every = Subarray(np.arange(elements.count), np.zeros(3), elements)
            return TracedBySensor(plan, frame, ((every, traced),), 1, seconds)
        cut = subarrays(elements, count)
        needed = [piece for piece in cut if np.isin(piece.sensor, sensor).any()]
        pieces, spent = timed(lambda: tuple((piece, arrivals_of(plan, frame, piece)) for piece in needed), 1)
        return TracedBySensor(plan, frame, pieces, len(cut), seconds + spent / len(needed) * len(cut))

    def pressures(self, sensor: Ints) -> Pressures:
        """Echoes and direct arrivals at some hydrophones, by the exact way's synthesis."""
        out = tuple(np.zeros((len(sensor), self.plan.windows.samples)) for _ in range(2))
        for piece, traced in self.pieces:
            rows = np.flatnonzero(np.isin(sensor, piece.sensor))
            own = np.searchsorted(piece.sensor, sensor[rows])
            arrivals = traced.for_sensors(own, piece.elements.count)
            received = pressures(self.plan, self.frame, arrivals, piece.elements.select(own), golden(self.plan))
            for total, values in zip(out, received, strict=True):
                total[rows] = values
        return out[0], out[1]

    @property
    def few(self) -> list[tuple[Subarray, Arrivals]]:
        """Some of the parts, spread."""
        return [self.pieces[n] for n in evenly(len(self.pieces), TIMED)]

    def synthesis_seconds(self) -> float:
        """CPU seconds of the plan's synthesis at all parts."""
        plan, total = self.plan, 0.0
        for piece, arrivals in self.few:
            reception = reception_of(plan, self.frame)._replace(elements=piece.elements)
            total += timed(partial(plan.choices.synthesis.signals, arrivals, self.frame.moment.snaps, reception))[1]
        return total * self.parts / len(self.few)


def trace_points(exact: ExactFrame, traced: TracedBySensor) -> Iterator[Point]:
    """Walk the knobs of tracing; `traced`: by the plan's own choices."""
    plan = exact.plan
    yield _point(exact, traced, "subarrays", f"{_cut(plan)}, as chosen", chosen=True)
    for setting, cheaper in _cheaper(plan):
        yield _point(exact, TracedBySensor.of(cheaper, exact.frame, exact.sensor), "cheaper", setting)
    yield from _cuts(exact, traced)
    best = exact_plan(plan)
    usual = replace(best, choices=replace(best.choices, subarrays=plan.choices.subarrays))
    if plan.choices.subarrays < plan.elements.count:
        view = replace(usual, choices=replace(usual.choices, occlusion="centre"))
        from_centre = TracedBySensor.of(view, exact.frame, exact.sensor)
        yield _point(exact, from_centre, "occlusion", f"from the centre, {_cut(plan)}")
    for level in DYNAMIC_RANGES:
        share = 10.0 ** (-level / 10.0)
        varied = replace(best, choices=replace(best.choices, negligible=share))
        yield _each_point(exact, varied, "dynamic range", f"{level:.0f} dB")
    if not plan.profile.uniform:
        varied = replace(best, propagation=Straight(bounces=plan.propagation.bounces))
        yield _each_point(exact, varied, "rays", "straight")
    yield exact_point(exact)


def _cheaper(plan: Plan) -> Iterator[tuple[str, Plan]]:
    """What would cost less than the choices of a plan, one at a time."""
    choices = plan.choices
    for count in _counts(plan):
        if count < choices.subarrays:
            yield f"{count} part{'s' if count > 1 else ''}", replace(plan, choices=replace(choices, subarrays=count))
    if choices.occlusion == "sensors":
        yield "seen from the centre", replace(plan, choices=replace(choices, occlusion="centre"))
    for level in DYNAMIC_RANGES:
        share = 10.0 ** (-level / 10.0)
        if share > 1.001 * choices.negligible:
            yield f"dynamic range {level:.0f} dB", replace(plan, choices=replace(choices, negligible=share))
    if plan.propagation.bends:
        yield "straight rays", replace(plan, propagation=Straight(bounces=plan.propagation.bounces))


def _cuts(exact: ExactFrame, traced: TracedBySensor) -> Iterator[Point]:
    """The array cut into more and more parts, all else exact, and at last into hydrophones."""
    best, spent = exact_plan(exact.plan), 0.0
    for count in _counts(exact.plan)[:-1]:
        if 2.0 * spent > max(LONGEST, SLOWER * traced.seconds):
            break
        varied = replace(best, choices=replace(best.choices, subarrays=count))
        yield (point := _point(exact, TracedBySensor.of(varied, exact.frame, exact.sensor), "subarrays", _cut(varied)))
        spent = point.seconds
        if point.error < FINER * point.allowed:
            break
    yield _of_each(exact, exact.single, exact.sensor, "subarrays", "each hydrophone, every path")


def _each_point(exact: ExactFrame, plan: Plan, knob: str, setting: str) -> Point:
    """Of a plan that traces each hydrophone by itself: at a few."""
    few = exact.sensor[:: max(len(exact.sensor) // EACH, 1)][:EACH]
    return _of_each(exact, each_hydrophone(plan, exact.frame, sensors=few), few, knob, setting)


def _of_each(exact: ExactFrame, single: SensorPressures, sensor: Ints, knob: str, setting: str) -> Point:
    rows = np.searchsorted(exact.sensor, sensor)
    error, largest = differences(single.at(sensor), [received[rows] for received in exact.pressures])
    few = f"at {len(sensor)} hydrophones" if len(sensor) < len(exact.sensor) else exact.partly
    return signal_point(
        exact.plan,
        "trace",
        knob,
        setting,
        error,
        sum(single.seconds),
        also={"trace_s": single.seconds[0], "synthesis_s": single.seconds[1], "largest": largest},
        note=few,
    )


def _counts(plan: Plan) -> list[int]:
    """Powers of two below the number of hydrophones, and that; without it where there are live ones alone."""
    count = plan.elements.count
    return [*takewhile(lambda n: n < count, (2**n for n in range(count))), count]


def exact_point(exact: ExactFrame) -> Point:
    """What all are compared with: no error, and what it costs."""
    return signal_point(
        exact.plan,
        "trace",
        "exact",
        exact.note or "from the description alone",
        0.0,
        exact.seconds,
        also={"trace_s": exact.seconds, "synthesis_s": 0.0, "largest": 0.0},
        note=f"cost from {len(exact.sensor)} hydrophones" if exact.partly else "",
    )


def _point(exact: ExactFrame, traced: TracedBySensor, knob: str, setting: str, *, chosen: bool = False) -> Point:
    error, largest = differences(traced.pressures(exact.sensor), exact.pressures)
    synthesis_seconds = traced.synthesis_seconds()
    paths = max(len(arrivals.delay) for _, arrivals in traced.pieces)
    several = f", {len(traced.pieces)} of {traced.parts} parts" if len(traced.pieces) < traced.parts else ""
    return signal_point(
        exact.plan,
        "trace",
        knob,
        setting,
        error,
        traced.seconds + synthesis_seconds,
        chosen=chosen,
        also={
            "largest": largest,
            "trace_s": traced.seconds,
            "synthesis_s": synthesis_seconds,
            "paths": paths,
            "hydrophones": len(exact.sensor),
        },
        note=f"{exact.partly}{several}",
    )


def _traced_anew(plan: Plan, frame: Frame) -> Arrivals:
    """The arrivals of a frame, as of one that shares nothing with the frame before."""
    way_to_array.cache_clear()
    return arrivals_of(plan, frame)


def _cut(plan: Plan) -> str:
    count = plan.choices.subarrays
    return "each hydrophone" if count >= plan.elements.count else f"{count} part{'s' if count > 1 else ''}"
