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
from sonarsynth.schedule.making import brief, usable_cores

if TYPE_CHECKING:
    from sonarsynth.schedule.build_report import BuildReport

STARTING: Final = 4.0
"""Seconds of one core until worker processes are at their pace: a scheduler, imports, the plan, compiled kernels."""
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
    starting: float  # s of one core until a worker is at its pace
    waiting: float  # wall-clock time over processor time here and now, of one process
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
        """Seconds of one core to make all frames, without writing."""
        return self.frames * (self.frame_seconds - self.stages.get("write", 0.0))

    @property
    def core_seconds(self) -> float:
        """Seconds of the processor in all, those of starting too."""
        return self.frames * self.frame_seconds + self.workers * self.starting

    @property
    def seconds(self) -> float:
        """Seconds of the wall clock, from the call of `build` to its end, with the machine as busy as it is now."""
        processes = max(self.workers, 1)
        crowded = processes / min(processes, self.cores)  # more than run at the same time
        shards = -(-self.frames // self.shard_frames)
        busiest = min(self.frames, -(-shards // processes) * self.shard_frames)
        return self.waiting * crowded * (busiest * self.frame_seconds + (self.starting if self.workers else 0.0))

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
) -> Prediction:
    """Predict a build of a plan, by making some of its frames, which takes a second or two.

    `frames`: how many (left out: all); `workers`: as for `build`; `folder`: where a scratch store may be laid out and
    removed again (left out: that of temporary files). Never raises for a frame or a disk that fails: costs are by
    counts of work then, and `basis` says why.
    """
    cores = usable_cores()
    counted = {stage.stage: stage.seconds for stage in plan.stages}
    raw = sum(stage.bytes for stage in plan.stages)
    result = Prediction(
        frames=plan.recipe.frames,
        workers=cores,
        cores=cores,
        shard_frames=min(plan.shard_frames, plan.recipe.frames),
        basis="counts of operations",
        stages=counted,
        raw_bytes_a_frame=raw,
        starting=STARTING * machine_factor(),
        waiting=1.0,
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
    wanted = plan.recipe.frames if frames is None else frames
    if workers is None and wanted <= result.shard_frames and brief(plan, range(wanted)):
        workers = 0  # as `build` has it
    return result.of(frames=wanted, workers=workers)


def _from(prediction: Prediction, trial: Trial) -> Prediction:
    """A prediction with what a trial has shown."""
    stages = {name: seconds for name, seconds in trial.cpu.items() if name != "collect"}
    stages["write"] = trial.writing / prediction.shard_frames + trial.cpu.get("collect", 0.0)
    return replace(
        prediction,
        basis=f"timing frames on this machine (number {', '.join(map(str, sorted(trial.frames)))})",
        stages=stages,
        waiting=trial.waiting,
        sizes=(trial.fixed, trial.shard),
        failures=trial.failures,
        odds=trial.odds,
    )
