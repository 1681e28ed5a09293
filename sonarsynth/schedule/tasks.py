"""What runs for frames and for a shard, in whatever process: the same functions without a scheduler and on a cluster.

A task is a stage of a frame; where frames are short, all stages of a block of them; another writes them. It knows the
store and the recipe's digest, and finds the recipe in the store: nothing large travels to it. What a plan resolved is
given to each process once: to plan is to look at up to 2000 frames, which takes seconds, and leaves 400 MB of memory. A
stage of a frame that raises gives its failure as its result, so that one bad frame costs only itself.
"""

from __future__ import annotations

import resource
import time
import traceback
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

from sonarsynth import pipeline, planning, store
from sonarsynth.pipeline.synthesis import prepared_sound
from sonarsynth.planning import Plan, choices_from
from sonarsynth.recipe import reading
from sonarsynth.schedule import worker_status
from sonarsynth.store.layout import layout_of
from sonarsynth.threads import in_one_thread

WARM_UP: Final = 300.0
"""Seconds that the first stage of its kind may take longer."""


@dataclass(frozen=True)
class Job:
    """What is built, small enough to send with every task."""

    path: str  # of the store, absolute, or its URL
    digest: str  # of the recipe
    products: tuple[str, ...]
    build: str = ""  # the build that this is for, as its lock names it; "": not under a lock
    frame_timeout: float = 0.0  # s that a stage of a frame may take; 0: no limit
    shard_frames: int = 0  # frames of a shard; 0: as planned
    block: int = 1  # frames of a task
    together: int = 1  # of these, that go through each stage one after the other


@dataclass(frozen=True)
class Failure:
    """Why a frame failed."""

    frame: int
    stage: str
    error: str  # one line
    traceback: str

    @property
    def transient(self) -> bool:
        """True where the frame may well come out when it is tried alone."""
        return self.error.startswith(("MemoryError", "numpy._core._exceptions._ArrayMemoryError", "_ArrayMemoryError"))


@dataclass(frozen=True, eq=False)
class StageResult:
    """A stage of a frame: what it made, or the failure of this or an earlier stage; and what all stages so far cost."""

    frame: int
    value: Any = None
    failure: Failure | None = None
    seconds: Mapping[str, float] = field(default_factory=dict)  # by stage, wall clock
    cpu: Mapping[str, float] = field(default_factory=dict)  # by stage, of the thread
    parts: Mapping[str, float] = field(default_factory=dict)  # of that, by what was done: `pipeline.STAGES`


@dataclass(frozen=True)
class WrittenShard:
    """A shard that is in the store."""

    shard: int
    frames: tuple[int, ...]
    failures: tuple[Failure, ...]
    times: tuple[dict[str, Any], ...]  # a row a frame
    seconds: float  # of writing
    bytes: int  # of its files
    peak_bytes: int  # of memory of this process so far


def tasks_of(job: Job) -> list[list[str]]:
    """The stages of each task of a block of frames, in order: a task each where a frame is a block. Short frames have
    one chain of them as a task, so that little is scheduled and no block of signals is held between two."""
    stages = stages_of(job.products)
    return [stages] if job.block > 1 else [[stage] for stage in stages]


@in_one_thread
def run_stages(job: Job, stages: Sequence[str], before: Sequence[StageResult]) -> list[StageResult]:
    """Task <stages>-<token>-<first frame>: what some stages make of some frames, of a few before the next few; of the
    last one, values in the types of the store."""
    done: list[StageResult] = []
    with worker_status.diary(job.path) as note:
        for first in range(0, len(before), job.together):
            some = list(before[first : first + job.together])
            for name in stages:
                for step in STAGES[name]:
                    some = [_step(job, name, step, so_far, note) for so_far in some]
            done += some
    return done


def render_frames(job: Job, frames: Sequence[int]) -> list[StageResult]:
    """All stages of some frames, here and now."""
    return run_stages(job, stages_of(job.products), [StageResult(frame) for frame in frames])


def stages_of(products: Iterable[str]) -> list[str]:
    """Those of frames with such products: truth and paths are traced, and the last is for what takes single beams."""
    asked = set(products)
    return list(STAGES)[: 1 if asked <= {"paths"} else 3 if asked & {"cloud", "beams", "range_image"} else 2]


def _trace(plan: Plan, frame: int, before: Any) -> Any:
    """The frame and its paths, where anything is heard."""
    return pipeline.trace_paths(plan, frame) if plan.makes_sound else None


def _label(plan: Plan, frame: int, paths: Any) -> Any:
    """What was traced; where nothing is heard, truth."""
    if plan.makes_sound:
        return pipeline.trace_at(plan.at(frame), *paths)
    return layout_of(plan).check(pipeline.silent_frame(plan, frame))


def _prepare(plan: Plan, frame: int, traced: pipeline.TracedFrame) -> Any:
    """What was traced, and its sound."""
    return traced, prepared_sound(plan.at(frame), traced.frame, traced.arrivals)


def _beamform(plan: Plan, frame: int, before: tuple[pipeline.TracedFrame, Any]) -> Any:
    """What was traced with what was heard; values, where that is the last stage."""
    traced, sound = before
    both = traced, pipeline.beamform_frame(plan, frame, traced, sound)
    return both if len(stages_of(plan.products)) == 3 else _values(plan, frame, both)


def _range(plan: Plan, frame: int, before: tuple[pipeline.TracedFrame, pipeline.BeamformedFrame]) -> Any:
    """What was traced and heard, with the points where these are asked for."""
    traced, beamformed = before
    return *before, pipeline.cloud_of(plan.at(frame), traced.frame, beamformed) if "cloud" in plan.products else None


def _values(plan: Plan, frame: int, before: Any) -> Any:
    """The values of the frame."""
    return layout_of(plan).check(pipeline.range_frame(plan, frame, *before))


Step = Callable[[Plan, int, Any], Any]
"""A part of a stage: of the plan, the number of a frame and what the step before made of it, what this one makes."""
STAGES: Final[Mapping[str, Sequence[Step]]] = {
    "trace": (_trace, _label, pipeline.measured),
    "beamform": (_prepare, _beamform),
    "range": (_range, _values),
}
"""Steps of each stage, in order."""


def write(job: Job, shard: int, blocks: Sequence[Sequence[StageResult]]) -> WrittenShard:
    """Task shard-<token>-<shard>: one whole shard of every array, from the frames that came out well."""
    start = time.perf_counter()
    steps = [step for block in blocks for step in block]
    good = {step.frame: step.value for step in steps if step.failure is None}
    size = 0
    if good:
        with store.shared_lock(job.path, job.build) if job.build else nullcontext(lambda: None) as still:
            mark = store.write_shard(job.path, plan_of(job), shard, good, still)
        size = sum(max(size, 0) for size, _ in mark.files.values())
    return WrittenShard(
        shard=shard,
        frames=tuple(sorted(good)),
        failures=tuple(step.failure for step in steps if step.failure is not None),
        times=tuple(
            {"frame": s.frame, "seconds": dict(s.seconds), "cpu": dict(s.cpu), "parts": dict(s.parts)} for s in steps
        ),
        seconds=time.perf_counter() - start,
        bytes=size,
        peak_bytes=peak_memory(),
    )


def plan_of(job: Job) -> Plan:
    """The plan of a job, of the recipe in its store: as it was given to this process, else made, once.

    Raises store.Damage where the recipe, or a file that it names, is not the one to build.
    """
    if job not in _plans:
        stored = store.root_attributes(job.path)
        recipe = reading.loads(stored.get("recipe", ""), job.path, resolved=True)
        if recipe.digest != job.digest:
            raise store.Damage(f"{job.path}: a file that the recipe names is not the same on this worker")
        if job in _given:
            plan = Plan(recipe=recipe, **_given[job])
        else:
            plan = planning.plan(recipe, frozenset(job.products), choices_from(stored.get("choices")))
        remember(job, replace(plan, shard_frames=job.shard_frames or plan.shard_frames))
    return _plans[job]


def resolved(plan: Plan) -> dict[str, Any]:
    """All of a plan but its recipe, which a worker has from the store, with the files that it names."""
    return {name: value for name, value in ((f.name, getattr(plan, f.name)) for f in fields(plan)) if name != "recipe"}


def give(job: Job, of_plan: Mapping[str, Any]) -> None:
    """Give this process what `resolved` is of the plan of a job, in place of the last one."""
    _given.clear()
    _given[job] = of_plan


def remember(job: Job, plan: Plan) -> None:
    """Keep the plan of a job in this process, in place of the last one."""
    _plans.clear()
    _plans[job] = plan


_plans: dict[Job, Plan] = {}
_given: dict[Job, Mapping[str, Any]] = {}


def peak_memory() -> int:
    """Largest resident memory of this process so far (bytes).

    From /proc where there is one: `ru_maxrss` counts the parent's memory in a process that it started.
    """
    try:
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    except OSError:
        pass
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _step(job: Job, name: str, step: Step, before: StageResult, note: worker_status.Note) -> StageResult:
    """A step of the stage `name` of a frame."""
    if before.failure is not None:
        return before
    wall, cpu, begun = time.perf_counter(), time.thread_time(), before.seconds.get(name, 0.0)
    with pipeline.stage_timer(before.parts) as parts:  # labels come twice
        try:
            note(before.frame, name, _limit(job, step, begun), begun)
            value, failure = step(plan_of(job), before.frame, before.value), None
            _warm.add(step)
        except Exception as error:
            value, failure = None, failure_of(before.frame, name, error)
    seconds = {**before.seconds, name: begun + time.perf_counter() - wall}
    spent = {**before.cpu, name: before.cpu.get(name, 0.0) + time.thread_time() - cpu}
    return StageResult(before.frame, value, failure, seconds, spent, parts)


_warm: set[Step] = set()


def _limit(job: Job, step: Step, spent: float) -> float:
    """Seconds that a step may take of a stage that has taken some already: the first of its kind in a process loads and
    compiles what it needs."""
    if not job.frame_timeout:
        return 0.0
    return max(job.frame_timeout - spent, 0.01) + (0.0 if step in _warm else WARM_UP)


def failure_of(frame: int, stage: str, error: BaseException) -> Failure:
    """A failure from the exception that was raised."""
    line = " ".join(f"{type(error).__name__}: {error}".split())
    return Failure(frame, stage, line, "".join(traceback.format_exception(error)))
