"""Knobs of tracing: into how many parts the array is cut, how faint paths may be, and whether rays bend."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import takewhile
from typing import Literal

import numpy as np

from sonarsynth.accuracy.recipe.exact import Exact, Heard, differences, golden, pressures
from sonarsynth.accuracy.recipe.points import Point, timed
from sonarsynth.conventions import Ints
from sonarsynth.planning import Plan, arrivals_of, frame_start
from sonarsynth.products import Arrivals
from sonarsynth.scene import Frame
from sonarsynth.sonar.subarrays import Subarray, subarrays, with_rim
from sonarsynth.tracing import Refracted, Straight, Visibility

FAINTEST = (30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 100.0)
"""dB: levels under which the faintest echoes of each target are left out."""
TIMED = 6
"""Parts that the synthesis is timed on."""
FINER = 0.05
"""Where a cut errs by so much of what is allowed, finer ones are not walked."""
LONGEST, SLOWER = 3.0, 4.0
"""Cuts that would take longer a frame than so many s, and so many times the plan's own, are not walked."""


@dataclass(frozen=True, eq=False)
class Traced:
    """A frame traced to those parts of an array that hold some hydrophones."""

    plan: Plan
    frame: Frame
    pieces: tuple[tuple[Subarray, Arrivals], ...]
    parts: int  # of the whole array
    seconds: float  # of all parts; and of the whole array, which truth and ledger need

    @staticmethod
    def of(plan: Plan, frame: Frame, sensor: Ints) -> Traced:
        """Trace with the subarrays, the faintest paths and the propagation of a plan (that of the sequence)."""
        count, elements = plan.choices.subarrays, plan.elements
        whole, seconds = timed(lambda: arrivals_of(plan, frame))
        if count == 1:
            every = Subarray(np.arange(elements.count), np.zeros(3), elements)
            return Traced(plan, frame, ((every, whole),), 1, seconds)
        parts = subarrays(elements, count)
        needed = [part for part in parts if np.isin(part.sensor, sensor).any()]
        began = time.process_time()
        pieces = tuple((part, arrivals_of(plan, frame, part)) for part in needed)
        of_parts = (time.process_time() - began) / len(needed) * len(parts)
        return Traced(plan, frame, pieces, len(parts), seconds + of_parts)

    def heard(self, sensor: Ints) -> Heard:
        """Echoes and direct arrivals at some hydrophones, by the exact way's synthesis."""
        out = tuple(np.zeros((len(sensor), self.plan.windows.samples)) for _ in range(2))
        for part, traced in self.pieces:
            rows = np.flatnonzero(np.isin(sensor, part.sensor))
            own = np.searchsorted(part.sensor, sensor[rows])
            some, place = with_rim(part, own)
            arrivals = traced.heard_by(place, part.elements.count)
            made = pressures(self.plan, self.frame, arrivals, some, golden(self.plan))
            for total, one in zip(out, made, strict=True):
                total[rows] = one[: len(rows)]
        return out[0], out[1]

    @property
    def few(self) -> list[tuple[Subarray, Arrivals]]:
        """Some of the parts, spread."""
        count = len(self.pieces)
        return [self.pieces[n] for n in np.unique(np.linspace(0, count - 1, min(TIMED, count)).astype(int))]

    def synthesis_seconds(self) -> float:
        """CPU seconds of the plan's synthesis at all parts."""
        plan, total = self.plan, 0.0
        start, samples = frame_start(plan, self.frame), plan.windows.samples
        for part, arrivals in self.few:
            make = partial(plan.choices.synthesis.signals, arrivals, self.frame.moment.snaps, part.elements)
            total += timed(partial(make, plan.scene.sonar, plan.absorption, start, samples))[1]
        return total * self.parts / len(self.few)


def trace_points(exact: Exact, traced: Traced) -> Iterator[Point]:
    """Walk the knobs of tracing; `traced`: by the plan's own choices."""
    plan = exact.plan
    yield _point(exact, traced, "subarrays", _cut(plan), chosen=True)
    for count in _counts(plan):
        if count != plan.choices.subarrays:
            if count / traced.parts * traced.seconds > max(LONGEST, SLOWER * traced.seconds):
                break
            yield (point := _walked(exact, replace(plan, choices=replace(plan.choices, subarrays=count)), "subarrays"))
            if count > plan.choices.subarrays and point.error < FINER * point.allowed:
                break
    view: Visibility = "centre" if plan.choices.visibility == "hydrophones" else "hydrophones"
    yield _walked(exact, replace(plan, choices=replace(plan.choices, visibility=view)), "visibility")
    if plan.choices.subarrays < plan.elements.count:
        degree: Literal[3, 5] = 3 if plan.choices.degree == 5 else 5
        yield _walked(exact, replace(plan, choices=replace(plan.choices, degree=degree)), "degree")
    for level in FAINTEST:
        share = 10.0 ** (-level / 10.0)
        if not np.isclose(share, plan.choices.negligible, rtol=1e-6):
            yield _walked(exact, replace(plan, choices=replace(plan.choices, negligible=share)), "faintest")
    if not plan.profile.uniform:
        other = Straight if isinstance(plan.propagation, Refracted) else Refracted
        yield _walked(exact, replace(plan, propagation=other(bounces=plan.propagation.bounces)), "rays")
    yield exact_point(exact)


def _counts(plan: Plan) -> list[int]:
    """Powers of two below the number of hydrophones, and that; without it where there are live ones alone."""
    count = plan.elements.count
    return [*takewhile(lambda n: n < count, (2**n for n in range(count))), count]


def exact_point(exact: Exact) -> Point:
    """Everything exact: no error, and what it costs."""
    return Point(
        stage="trace",
        knob="exact",
        setting="every hydrophone, every path",
        error=0.0,
        unit="relative",
        allowed=exact.plan.recipe.accuracy.signal,
        seconds=sum(exact.seconds),
        also={"trace_s": exact.seconds[0], "synthesis_s": exact.seconds[1], "largest": 0.0},
        note="" if exact.whole else f"cost from {len(exact.sensor)} hydrophones",
    )


def _walked(exact: Exact, plan: Plan, knob: str) -> Point:
    traced = Traced.of(plan, exact.frame, exact.sensor)
    setting = {
        "subarrays": _cut(plan),
        "degree": f"of degree {plan.choices.degree} over the aperture",
        "visibility": f"seen from the {plan.choices.visibility}",
        "faintest": _faint(plan),
        "rays": type(plan.propagation).__name__.lower(),
    }
    return _point(exact, traced, knob, setting[knob])


def _point(exact: Exact, traced: Traced, knob: str, setting: str, *, chosen: bool = False) -> Point:
    error, largest = differences(traced.heard(exact.sensor), exact.heard)
    made = traced.synthesis_seconds()
    paths = max(len(arrivals.delay) for _, arrivals in traced.pieces)
    several = f", {len(traced.pieces)} of {traced.parts} parts" if len(traced.pieces) < traced.parts else ""
    return Point(
        stage="trace",
        knob=knob,
        setting=setting,
        error=error,
        unit="relative",
        allowed=exact.plan.recipe.accuracy.signal,
        seconds=traced.seconds + made,
        chosen=chosen,
        also={
            "largest": largest,
            "trace_s": traced.seconds,
            "synthesis_s": made,
            "paths": paths,
            "hydrophones": len(exact.sensor),
        },
        note="" if exact.whole else f"at {len(exact.sensor)} hydrophones{several}",
    )


def _cut(plan: Plan) -> str:
    count = plan.choices.subarrays
    return "each hydrophone" if count >= plan.elements.count else f"{count} part{'s' if count > 1 else ''}"


def _faint(plan: Plan) -> str:
    return f"{-10.0 * np.log10(plan.choices.negligible):.0f} dB"
