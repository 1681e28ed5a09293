"""Some frames of a recipe made and written here, then thrown away: what they cost, and how many bytes they are.

The surest model of a frame is the frame. Where one would take too long, counts of its work have to do."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth import store
from sonarsynth.equations.arrays.apertures import whole_beams_per_width
from sonarsynth.labels.odds import NO_ODDS, Odds, odds
from sonarsynth.pipeline import Values
from sonarsynth.pipeline.labelled_estimates import beam_widths
from sonarsynth.planning import Plan
from sonarsynth.schedule.making import job_of
from sonarsynth.schedule.tasks import StageResult, remember, render_frames
from sonarsynth.store.layout import layout_of

LONGEST: Final = 5.0
"""Seconds that a frame may take, by counts of its work, for any to be tried."""
TRIED: Final = 0.6
"""Seconds of processor time after which no further frame is tried."""
FRAMES: Final = 8
"""Frames that are tried at most."""


@dataclass(frozen=True)
class Sizes:
    """Bytes of a store: of its files, and of the disk that it takes, folders and unfilled blocks with it."""

    files: float
    disk: float

    def __add__(self, other: Sizes) -> Sizes:
        return Sizes(self.files + other.files, self.disk + other.disk)

    def __mul__(self, factor: float) -> Sizes:
        return Sizes(self.files * factor, self.disk * factor)


@dataclass(frozen=True)
class Trial:
    """What trying some frames has shown."""

    frames: tuple[int, ...]  # those that were made
    cpu: Mapping[str, float]  # s of one core a frame, by stage
    waiting: float  # wall-clock time over processor time, of frames
    writing: float  # s of one core to write a whole shard
    fixed: Sizes  # of the store without frames
    shard: Sizes  # that a whole shard adds
    failures: tuple[str, ...]  # of frames that could not be made, a line each
    odds: Odds  # of finding targets in these


def try_frames(plan: Plan, folder: Path | None = None) -> Trial:
    """Make some frames of a plan, as a worker does, and write them below a folder (left out: that of temporary files).

    Each is made twice, for what it loads is there for all that are like it. Raises RuntimeError where no frame can be
    made, or one would take long; OSError where there is no room.
    """
    if sum(stage.seconds for stage in plan.stages) > LONGEST:
        raise RuntimeError(f"one would take more than {LONGEST:g} s")
    job = job_of(Path(), plan, "")
    remember(job, plan)
    made, failures = list[StageResult](), list[str]()
    for index in _spread(plan.recipe.frames):
        if sum(_seconds(frame) for frame in made) > TRIED:
            break
        _, frame = (render_frames(job, [index])[0] for _ in range(2))
        if frame.failure is None:
            made.append(frame)
        else:
            failures.append(f"frame {index}: {frame.failure.error}")
    if not made:
        raise RuntimeError(failures[0])
    fixed, writing, shard = _write(plan, [frame.value for frame in made], folder)
    names = dict.fromkeys(name for frame in made for name in frame.parts)
    wall, spent = sum(sum(frame.seconds.values()) for frame in made), sum(_seconds(frame) for frame in made)
    return Trial(
        frames=tuple(frame.frame for frame in made),
        cpu={name: sum(frame.parts.get(name, 0.0) for frame in made) / len(made) for name in names},
        waiting=max(wall / max(spent, 1e-9), 1.0),
        writing=writing,
        fixed=fixed,
        shard=shard,
        failures=tuple(failures),
        odds=sum((_odds(plan, frame.value) for frame in made), NO_ODDS),
    )


def _seconds(frame: StageResult) -> float:
    """Of the processor, in all stages."""
    return sum(frame.cpu.values())


def _odds(plan: Plan, values: Values) -> Odds:
    """Of finding targets in a frame that was made."""
    energy, beams = values.get(("/image", "energy")), plan.scene.sonar.beams
    if energy is None:
        return NO_ODDS
    reach = whole_beams_per_width(beam_widths(plan), beams.azimuth, beams.elevation)
    clutter = values["/truth/targets", "clutter"] != 0
    snr = values.get(("/truth/targets", "snr"))
    return odds(energy, values["/truth/beams", "target"], clutter, snr, reach)


def _spread(frames: int) -> list[int]:
    """Frames to try, by golden ratio: spread over a dataset, however many of them are tried."""
    places = np.mod((np.arange(1, FRAMES + 1)) * 0.6180339887498949, 1.0)
    return list(dict.fromkeys(int(frame) for frame in places * frames))


def _write(plan: Plan, tried: Sequence[Values], folder: Path | None) -> tuple[Sizes, float, Sizes]:
    """Lay the store out in a folder that is removed, and write its first shard from frames that were tried."""
    with tempfile.TemporaryDirectory(prefix=".sonarsynth-", dir=folder) as scratch:
        path = Path(scratch) / "store"
        store.create(path, plan)
        fixed = disk_use(path)
        frames = {frame: tried[frame % len(tried)] for frame in layout_of(plan).region(0)}
        writing = min(_timed(partial(store.write_shard, path, plan, 0, frames)) for _ in range(2))
        disk = disk_use(path)
        return fixed, writing, disk + fixed * -1.0


def _timed(work: Callable[[], object]) -> float:
    """Seconds of the processor."""
    began = time.process_time()
    work()
    return time.process_time() - began


def disk_use(location: store.Folder | str) -> Sizes:
    """Bytes below a folder, itself too: those of files, and as `du` counts them; at a URL both are those of objects."""
    path = store.folder_of(location)
    if isinstance(path, store.Remote):
        objects = float(sum(path.sizes().values()))
        return Sizes(objects, objects)
    files = disk = 0
    for folder, _, names in os.walk(path):
        for entry in (Path(folder), *(Path(folder) / name for name in names)):
            status = entry.lstat()
            disk += status.st_blocks * 512
            files += status.st_size if entry != Path(folder) else 0
    return Sizes(float(files), float(disk))
