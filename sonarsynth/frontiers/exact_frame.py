"""A frame the slow, exact way, echoes and direct arrivals apart, in float64: from its description alone, by code that
shares nothing with tracing and synthesis (`references.frame_pressure`), which all errors of signals are against; and
every hydrophone traced by itself, every path, which is where every knob of tracing tends to."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sonarsynth.conventions import Floats, Ints, evenly, scattered
from sonarsynth.frontiers.rows import Point
from sonarsynth.planning import Choices, Plan, arrivals_of, frame_start
from sonarsynth.planning.measured.sampled_arrivals import pressures
from sonarsynth.receiver.subarrays import subarray
from sonarsynth.recipe.scene import Frame
from sonarsynth.signals import DirectSum, GriddedSynthesis
from sonarsynth.signals.auto_synthesis import deposit_for
from sonarsynth.validation.references.frames.frame_pressure import FramePressure

SMALL = 1e-3
"""Error of the exact way's synthesis, over what is allowed."""
AFFORDED = 30.0
"""s: where tracing to every hydrophone would take longer, only `SOME` are."""
COMPUTED = 10.0
"""s: so many hydrophones are computed from the description alone as this affords, from `FEWEST` to `SOME`."""
FEWEST, SOME = 4, 24
TRIED = 3
"""Hydrophones that are timed first."""
CHECKED_HYDROPHONES, CHECKED_PATHS = 2, 200
"""What the exact way's synthesis is itself compared with `DirectSum` on."""

Pressures = tuple[Floats, Floats]
"""Echoes, and direct arrivals (hydrophone, sample), Pa."""


@dataclass(frozen=True, eq=False)
class SensorPressures:
    """What hydrophones hear, each traced by itself."""

    sensor: Ints  # (heard,) live hydrophones, ascending
    pressures: Pressures
    seconds: tuple[float, float]  # tracing and synthesis of all live hydrophones; estimated where not all are heard

    def at(self, sensor: Ints) -> Pressures:
        """What some of them hear."""
        rows = np.searchsorted(self.sensor, sensor)
        return self.pressures[0][rows], self.pressures[1][rows]


@dataclass(frozen=True, eq=False)
class ExactFrame:
    """What hydrophones of a frame hear, exactly."""

    plan: Plan  # that of the frame's sequence
    frame: Frame
    sensor: Ints  # (heard,) live hydrophones, ascending; some of those of `single`
    pressures: Pressures  # from the description alone, where its laws are known there
    seconds: float  # of that, of all live hydrophones: estimated
    single: SensorPressures
    note: str = ""  # why it is not from the description alone

    @property
    def whole(self) -> bool:
        """Whether every live hydrophone is traced by itself."""
        return len(self.single.sensor) == int(np.count_nonzero(self.plan.elements.gain))

    @property
    def partly(self) -> str:
        """At how many hydrophones signals are compared; nothing where at all."""
        all_of_them = len(self.sensor) == int(np.count_nonzero(self.plan.elements.gain))
        return "; ".join(n for n in ("" if all_of_them else f"at {len(self.sensor)} hydrophones", self.note) if n)

    @property
    def pressure(self) -> Floats:
        """(sensor, sample) Pa: everything, at all hydrophones, each traced by itself; 0 at dead ones."""
        out = np.zeros((self.plan.elements.count, self.plan.windows.samples))
        out[self.single.sensor] = self.single.pressures[0] + self.single.pressures[1]
        return out


def exact_plan(plan: Plan) -> Plan:
    """The plan (that of a sequence) with everything done the slow, exact way."""
    paths = plan.propagation if plan.profile.uniform else plan.propagation.exact()
    choices = Choices(
        subarrays=plan.elements.count,
        occlusion="sensors",
        negligible=0.0,
        synthesis=golden(plan),
        beamforming=plan.choices.beamforming.exact(),
        picking=plan.choices.picking,
        placing=plan.choices.placing.exact(),
    )
    return replace(plan, propagation=paths, choices=choices)


def golden(plan: Plan, finer: float = 1.0) -> GriddedSynthesis:
    """The synthesis of the exact way: in float64, and checked against `DirectSum`; finer by a factor where wanted."""
    return replace(deposit_for(finer * SMALL * plan.recipe.accuracy.signal), precision="float64")


def exact_frame(plan: Plan, index: int, hydrophones: int | None = None) -> ExactFrame:
    """A frame at so many hydrophones, spread over the array; left out: at all, or those that can be afforded."""
    plan = plan.at(index)
    frame = plan.recipe.frame(index)[1]
    single = each_hydrophone(exact_plan(plan), frame, hydrophones)
    alone = FramePressure(plan.scene, frame, plan.profile)
    if alone.unknown:
        return ExactFrame(plan, frame, single.sensor, single.pressures, sum(single.seconds), single, alone.unknown)
    start, samples, live = frame_start(plan, frame), plan.windows.samples, int(np.count_nonzero(plan.elements.gain))
    rows: dict[int, Pressures] = {}
    began = time.process_time()
    for sensor in spread(single.sensor, min(TRIED, len(single.sensor))):
        rows[int(sensor)] = alone.pressure([int(sensor)], start, samples)
    mean = (time.process_time() - began) / len(rows)
    wanted = len(single.sensor)
    if hydrophones is None:
        wanted = min(wanted, int(np.clip(COMPUTED / max(mean, 1e-3), FEWEST, SOME)))
    chosen = single.sensor if wanted == len(single.sensor) else np.union1d(list(rows), spread(single.sensor, wanted))
    for sensor in chosen:
        if int(sensor) not in rows:
            rows[int(sensor)] = alone.pressure([int(sensor)], start, samples)
    seconds = (time.process_time() - began) / len(rows) * live
    received = (np.vstack([rows[int(n)][0] for n in chosen]), np.vstack([rows[int(n)][1] for n in chosen]))
    return ExactFrame(plan, frame, chosen, received, seconds, single)


def each_hydrophone(
    plan: Plan, frame: Frame, hydrophones: int | None = None, sensors: Ints | None = None
) -> SensorPressures:
    """So many hydrophones of a frame, each traced by itself with the choices of a plan, by the exact synthesis; left
    out: all, or those that can be afforded. sensors (heard,): these."""
    live = np.flatnonzero(plan.elements.gain)
    rows: dict[int, tuple[Pressures, float, float]] = {}

    def hear(sensor: int) -> None:
        if sensor not in rows:
            single = subarray(plan.elements, np.array([sensor]))
            began = time.process_time()
            arrivals = arrivals_of(plan, frame, single)
            traced = time.process_time()
            received_there = pressures(plan, frame, arrivals, single.elements, golden(plan))
            rows[sensor] = received_there, traced - began, time.process_time() - traced

    chosen = sensors
    if chosen is None:
        wanted = len(live) if hydrophones is None else min(hydrophones, len(live))
        first = spread(live, min(TRIED, wanted))
        for sensor in first:
            hear(int(sensor))
        if hydrophones is None and _mean(rows) * len(live) > AFFORDED:
            wanted = min(SOME, len(live))
        chosen = live if wanted == len(live) else np.union1d(first, spread(live, wanted))
    for sensor in chosen:
        hear(int(sensor))
    computed = [rows[int(sensor)] for sensor in chosen]
    received = (np.vstack([r[0][0] for r in computed]), np.vstack([r[0][1] for r in computed]))
    typical = (float(np.median([r[n] for r in computed])) * len(live) for n in (1, 2))  # the first may compile
    return SensorPressures(chosen, received, (next(typical), next(typical)))


def _mean(rows: dict[int, tuple[Pressures, float, float]]) -> float:
    """Seconds of a hydrophone, without the slowest."""
    seconds = sorted(traced + synthesised for _, traced, synthesised in rows.values())
    return sum(seconds[: max(len(seconds) - 1, 1)]) / max(len(seconds) - 1, 1)


def spread(live: Ints, count: int) -> Ints:
    """So many of the live hydrophones, spread by golden ratio, ascending; not those that a planner measures at."""
    return live[scattered(count, len(live), 0.142)]


def signal_point(plan: Plan, stage: str, knob: str, setting: str, error: float, seconds: float, **more: Any) -> Point:
    """A row whose error is that of signals, relative to them; more: as the fields of `Point`."""
    return Point(stage, knob, setting, error, "relative", plan.recipe.accuracy.signal, seconds, **more)


def differences(measured: Sequence[Floats], exact: Sequence[Floats]) -> tuple[float, float]:
    """Errors of echoes or of direct arrivals, whichever errs more: root of the summed squares, relative; and the
    largest over the peak."""
    square, largest = 0.0, 0.0
    for a, b in zip(measured, exact, strict=True):
        if b.any():
            square = max(square, float(np.linalg.norm(a - b) / np.linalg.norm(b)))
            largest = max(largest, float(np.abs(a - b).max() / np.abs(b).max()))
    return square, largest


def synthesis_check(exact: ExactFrame) -> Point:
    """The exact way's synthesis against `DirectSum`: at a few hydrophones, on the loudest path and some others."""
    plan, frame = exact.plan, exact.frame
    sensor = exact.sensor[:: max(len(exact.sensor) // CHECKED_HYDROPHONES, 1)][:CHECKED_HYDROPHONES]
    few = subarray(plan.elements, sensor)
    arrivals = arrivals_of(exact_plan(plan), frame, few)
    echoes = np.flatnonzero(~arrivals.direct)
    sampled = echoes[evenly(len(echoes), CHECKED_PATHS)]
    arrivals = arrivals.select(np.concatenate([np.flatnonzero(arrivals.direct), sampled]))
    both = [pressures(plan, frame, arrivals, few.elements, method) for method in (golden(plan), DirectSum())]
    error, largest = differences(*both)
    return Point(
        stage="synthesis",
        knob="the exact way's",
        setting="against DirectSum",
        error=error,
        unit="relative",
        allowed=0.1 * plan.recipe.accuracy.signal,
        seconds=exact.single.seconds[1],
        role="check",
        also={"largest": largest, "hydrophones": len(sensor), "paths": len(arrivals.delay)},
    )
