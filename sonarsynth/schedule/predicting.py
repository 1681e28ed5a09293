"""How long a build will take and how large its store will be; and what came of it.

The plan alone gives costs by counts of work. A prediction is better: it makes some frames
(`schedule.benchmark_frames`). Where that cannot be, it goes by the counts, and says why.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sonarsynth import store
from sonarsynth.labels.odds import NO_ODDS, Odds
from sonarsynth.planning import Plan
from sonarsynth.planning.costs import machine_factor
from sonarsynth.schedule.benchmark_frames import Sizes, Trial, disk_use, try_frames
from sonarsynth.schedule.making import usable_cores

if TYPE_CHECKING:
    from sonarsynth.schedule.build_report import BuildReport

PREPARED: Final = 3.0
"""Seconds of one core until a process has a plan, where that was not measured: imports, reading, compiled kernels."""
CLUSTER: Final = 0.35
"""Share of that to start and to end a scheduler and its client."""
WORKER: Final = 0.75
"""Share of it that a worker takes until it is at its pace: to join its scheduler, to have the plan, kernels."""
PER_FRAME: Final = 3e-3
"""Seconds of one core for the scheduler to see to the tasks of a frame."""
CLOSING: Final = 0.3
"""Seconds that nothing happens in while processes start and end."""
LAYING_OUT: Final = 0.1
"""Seconds of one core to lay a store out, where that was not tried."""
COMPRESSED: Final = 0.4
"""Bytes after compression over those before, where that was not tried."""


@dataclass(frozen=True)
class Prediction:
    """What a build of so many frames on so many workers will take."""

    frames: int
    workers: int  # 0: in the process that builds
    cores: int  # that these have
    shard_frames: int
    basis: str  # what it is known from, in words
    stages: Mapping[str, float]  # s of one core a frame, by stage; `write` with it
    raw_bytes_a_frame: int  # before compression
    loading: float  # s of one core, before the first frame of a process is at the pace of the others
    prepared: float  # s of one core until a process has the plan
    waiting: float  # wall-clock time over processor time here and now, of one process
    writing_wait: float  # s a frame that writing takes longer than its processor time
    laying_out: tuple[float, float]  # s: processor, wall clock
    sizes: tuple[Sizes, Sizes]  # of the store without frames; that a whole shard adds
    files: int  # and folders, at most
    failures: tuple[str, ...] = ()  # frames that could not be tried, a line each
    odds: Odds = NO_ODDS  # of finding targets in those that were

    def of(self, *, frames: int | None = None, workers: int | None = None) -> Prediction:
        """The prediction for other numbers of frames or workers (never more of these than shards)."""
        frames = self.frames if frames is None else frames
        workers = self.workers if workers is None else workers
        return replace(self, frames=frames, workers=min(workers, -(-frames // self.shard_frames)))

    @property
    def frame_seconds(self) -> float:
        """Seconds of one core to make a frame and to write it, all warm."""
        return sum(self.stages.values())

    @property
    def frames_seconds(self) -> float:
        """Seconds of one core for all frames: making (what workers load with it), without writing."""
        return self.frames * (self.frame_seconds - self.stages.get("write", 0.0)) + self.workers * self.loading

    @property
    def core_seconds(self) -> float:
        """Seconds of the processor in all, those of starting too."""
        work = self.frames * self.frame_seconds + self.workers * self.loading
        if self.workers:
            work += (CLUSTER + self.workers * WORKER) * self.prepared + self.frames * PER_FRAME
        return self.laying_out[0] + work

    @property
    def seconds(self) -> float:
        """Seconds of the wall clock, from the call of `build` to its end, with the machine as busy as it is now."""
        if not self.frames:
            return self.laying_out[1]
        parallel = max(min(self.workers, self.cores), 1)  # workers that run at the same time
        crowded = max(self.workers, 1) / parallel
        shards = -(-self.frames // self.shard_frames)
        busiest = min(self.frames, -(-shards // max(self.workers, 1)) * self.shard_frames)
        work = busiest * self.frame_seconds + (self.loading if self.workers else 0.0)
        wall = self.laying_out[1] + work * crowded * self.waiting + busiest * self.writing_wait
        if self.workers:
            seeing_to = self.frames * PER_FRAME / (self.cores if self.workers >= self.cores else 1)
            wall += self.waiting * ((CLUSTER + crowded * WORKER) * self.prepared + seeing_to) + CLOSING
        return wall

    @property
    def raw_bytes(self) -> int:
        """Bytes of all frames before compression."""
        return self.frames * self.raw_bytes_a_frame

    @property
    def file_bytes(self) -> int:
        """Bytes of all files of the store."""
        fixed, shard = self.sizes
        return round(fixed.files + shard.files * self.frames / self.shard_frames)

    @property
    def bytes(self) -> int:
        """Bytes that the store takes on the disk, as `du` counts them: files, folders and unfilled blocks."""
        fixed, shard = self.sizes
        shards = -(-self.frames // self.shard_frames)
        return round(self.file_bytes + fixed.disk - fixed.files + shards * max(shard.disk - shard.files, 0.0))

    def tried(self, plan: Plan) -> Plan:
        """The plan with the seconds of this prediction, and the odds of finding targets, for printing."""
        stages = tuple(replace(row, seconds=self.stages.get(row.stage, row.seconds)) for row in plan.stages)
        return replace(plan, stages=stages, odds=self.odds.line)

    def as_json(self) -> dict[str, Any]:
        """For a program: wall-clock seconds on `workers`, bytes on the disk; seconds of cores, bytes otherwise."""
        return {
            "predicted_seconds": self.seconds,
            "predicted_bytes": self.bytes,
            "predicted_core_seconds": self.core_seconds,
            "predicted_frame_seconds": self.frame_seconds,
            "predicted_file_bytes": self.file_bytes,
            "predicted_raw_bytes": self.raw_bytes,
            "predicted_files": self.files,
            "predicted_for": {"frames": self.frames, "workers": self.workers, "cores": self.cores},
            "predicted_from": self.basis,
            "not_tried": list(self.failures),
            "odds": vars(self.odds),
        }

    def against(self, report: BuildReport) -> dict[str, Any]:
        """Prediction and measurement of a build that has ended: for what it did, and for the store as it is."""
        built, full = self.of(frames=report.written, workers=report.workers), self.of(frames=_there(report))
        size = disk_use(report.store)
        measured = {
            "seconds": (built.seconds, report.seconds),
            "frames_core_seconds": (built.frames_seconds, sum(report.stage_cpu.values())),
            "bytes": (float(full.bytes), size.disk),
            "file_bytes": (float(full.file_bytes), size.files),
        }
        rows: dict[str, Any] = {"frames": report.written, "workers": report.workers, "predicted_from": self.basis}
        for name, (predicted, actual) in measured.items():
            rows[f"predicted_{name}"], rows[f"measured_{name}"] = predicted, actual
            rows[f"{name}_ratio"] = predicted / actual if actual > 0.0 else None
        return rows


def _there(report: BuildReport) -> int:
    return min(report.there + report.written, report.frames)


def predict(
    plan: Plan,
    *,
    frames: int | None = None,
    workers: int | None = None,
    folder: Path | str | None = None,
    prepared: float | None = None,
) -> Prediction:
    """Predict a build of a plan, by making some of its frames, which takes a second or two.

    `frames`: how many (left out: all); `workers`: as for `build`; `folder`: where a scratch store may be laid out and
    removed again (left out: that of temporary files); `prepared`: seconds of the processor that a process like this
    one takes until it has the plan, where that was measured (much more of it was for choices, that workers are
    given, or for a compiler, whose work is kept). Never raises for a frame or a disk that fails: costs are
    by counts of work then, and `basis` says why.
    """
    cores = usable_cores()
    counted = {stage.stage: stage.seconds for stage in plan.stages}
    usual = PREPARED * machine_factor()
    raw = sum(stage.bytes for stage in plan.stages)
    result = Prediction(
        frames=plan.recipe.frames,
        workers=cores,
        cores=cores,
        shard_frames=min(plan.shard_frames, plan.recipe.frames),
        basis="counts of operations",
        stages=counted,
        raw_bytes_a_frame=raw,
        loading=0.0,
        prepared=usual if prepared is None else min(prepared, 1.25 * usual),
        waiting=1.0,
        writing_wait=0.0,
        laying_out=(LAYING_OUT, LAYING_OUT),
        files=store.layout_of(plan).files(),
        sizes=(Sizes(3e5, 1.1e6), Sizes(1.0, 1.6) * (COMPRESSED * raw * plan.shard_frames)),
    )
    try:
        trial = try_frames(plan, None if folder is None else Path(folder))
    except Exception as error:
        line = " ".join(f"{error}".split()) or type(error).__name__
        result = replace(result, basis=f"counts of operations: no frame could be timed ({line})", failures=(line,))
    else:
        result = _from(result, trial)
    return result.of(frames=frames, workers=workers)


def _from(prediction: Prediction, trial: Trial) -> Prediction:
    """A prediction with what a trial has shown."""
    stages = {name: seconds for name, seconds in trial.cpu.items() if name != "collect"}
    stages["write"] = trial.writing[0] / prediction.shard_frames + trial.cpu.get("collect", 0.0)
    return replace(
        prediction,
        basis=f"timing frames on this machine (number {', '.join(map(str, sorted(trial.frames)))})",
        stages=stages,
        loading=min(trial.loading, 0.2 * prediction.prepared),  # not what a compiler did, which is kept
        waiting=trial.waiting,
        writing_wait=max(trial.writing[1] - trial.waiting * trial.writing[0], 0.0) / prediction.shard_frames,
        laying_out=trial.laying_out,
        sizes=(trial.fixed, trial.shard),
        failures=trial.failures,
        odds=trial.odds,
    )
