"""Some frames of a recipe made and written here, then thrown away: what they cost, and how many bytes they are.

The surest model of a frame is the frame. Where whole frames would take too long, frames with two smaller numbers of
facets are made, and each stage is taken to grow with these by a straight line.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth import store
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.labels.odds import NO_ODDS, Odds, odds
from sonarsynth.pipeline import Values, beamform_frame, range_frame, silent_at, stage_timer, trace_at
from sonarsynth.pipeline.labelled_estimates import beam_width
from sonarsynth.pipeline.synthesis import subarray_signals
from sonarsynth.planning import Plan, check_unsampled_frame
from sonarsynth.receiver.subarrays import subarrays
from sonarsynth.recipe.scene import Frame
from sonarsynth.store.layout import layout_of

WHOLE: Final = 0.9
"""Seconds that a frame may take, by counts of its work, for it to be tried whole."""
TRIED: Final = 1.2
"""Seconds of processor time after which no further frame is tried."""
FRAMES: Final = 8
"""Frames that are tried at most."""
THIN: Final = 0.25
"""Seconds, by counts, of a frame that is tried with few facets."""
PARTS: Final = 8
"""Parts of the array that are tried, where it is cut into more."""

Stages = dict[str, float]


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
    every: int  # of that many facets, one was there
    cpu: Mapping[str, float]  # s of one core a frame, by stage, made for the second time
    loading: float  # s of one core that the very first frame took longer
    fresh: tuple[float, ...]  # s of one core that each of the others took longer for the first time
    waiting: float  # wall-clock time over processor time, of frames
    others: float  # processes that ran or waited for a core meanwhile, besides this one
    writing: tuple[float, float]  # s to write a whole shard: processor, wall clock
    laying_out: tuple[float, float]  # s to lay the store out: processor, wall clock
    fixed: Sizes  # of the store without frames
    shard: Sizes  # that a whole shard adds
    failures: tuple[str, ...]  # of frames that could not be made, a line each
    odds: Odds  # of finding targets in these


@dataclass(frozen=True, eq=False)
class _TimedFrame:
    """A frame that was made."""

    frame: int
    values: Values
    cpu: Stages
    wall: float
    spent: float  # s of the processor, for all that was made
    others: int  # processes besides this one that ran then, or waited for a core

    @property
    def seconds(self) -> float:
        """Of the processor, in all stages."""
        return sum(self.cpu.values())


def try_frames(plan: Plan, folder: Path | None = None) -> Trial:
    """Make some frames of a plan and write them below a folder (left out: that of temporary files).

    Raises RuntimeError where no frame can be made, OSError where there is no room.
    """
    predicted = sum(stage.seconds for stage in plan.stages)
    failures: list[str] = []
    pairs, costs, every = _try_small(plan, failures, predicted) if predicted > WHOLE else ([], [], 1)
    if not pairs or (every > 1 and sum(costs[0].values()) <= WHOLE):  # counts thought more of it
        pairs, costs, every = _try_whole(plan, failures)
    if not pairs:
        raise RuntimeError(failures[0])
    failures = list(dict.fromkeys(failures))
    timed = [warm for _, warm in pairs]
    fresh = [max(first.seconds - warm.seconds, 0.0) for first, warm in pairs]
    waiting = sum(frame.wall for frame in timed) / max(sum(frame.spent for frame in timed), 1e-9)
    laying_out, fixed, writing, shard = _write(plan, [frame.values for frame in timed], folder)
    return Trial(
        frames=tuple(frame.frame for frame in timed),
        every=every,
        cpu=_mean(costs),
        loading=fresh[0],
        fresh=tuple(fresh[1:]),
        waiting=max(waiting, 1.0),
        others=float(np.mean([frame.others for pair in pairs for frame in pair])),
        writing=writing,
        laying_out=laying_out,
        fixed=fixed,
        shard=shard,
        failures=tuple(failures),
        odds=sum((_odds(plan, frame.values) for frame in timed), NO_ODDS) if every == 1 else NO_ODDS,
    )


def _odds(plan: Plan, values: Values) -> Odds:
    """Of finding targets in a frame that was made."""
    energy, azimuth = values.get(("/image", "energy")), plan.scene.sonar.beams.azimuth
    if energy is None or len(azimuth) < 2:
        return NO_ODDS
    reach = min(max(round(beam_width(plan) / float(azimuth[1] - azimuth[0])), 1), len(azimuth))
    clutter = values["/truth/targets", "clutter"] != 0
    snr = values.get(("/truth/targets", "snr"))
    return odds(energy, values["/truth/beams", "target"], clutter, snr, reach)


Tried = tuple[list[tuple[_TimedFrame, _TimedFrame]], list[Stages], int]
"""Frames made for the first and for the second time; cost of each whole; and of how many facets one was there."""


def _spread(frames: int) -> list[int]:
    """Frames to try, by golden ratio: spread over a dataset, however many of them are tried."""
    places = np.mod((np.arange(1, FRAMES + 1)) * 0.6180339887498949, 1.0)
    return list(dict.fromkeys(int(frame) for frame in places * frames))


def _try_whole(plan: Plan, failures: list[str]) -> Tried:
    """Whole frames, each twice: its first time fills caches, and that of the first one loads what all need."""
    pairs: list[tuple[_TimedFrame, _TimedFrame]] = []
    for index in _spread(plan.recipe.frames):
        if sum(warm.seconds for _, warm in pairs) > TRIED / 2:
            break
        try:
            pairs.append((_make(plan, index), _make(plan, index)))
        except Exception as error:
            failures.append(_failure(index, error))
    return pairs, [warm.cpu for _, warm in pairs], 1


def _try_small(plan: Plan, failures: list[str], predicted: float) -> Tried:
    """A frame with two smaller numbers of facets, each twice, heard at some parts of the array where these are many."""
    count = max(plan.choices.subarrays, PARTS)
    every = max(1, int(np.ceil(predicted * PARTS / count / THIN)))
    for index in _spread(plan.recipe.frames):
        try:
            pair = (_make(plan, index, every), _make(plan, index, every))
            cost = pair[1].cpu
            if every > 1:
                _make(plan, index, 2 * every)
                cost = _extended(_make(plan, index, 2 * every).cpu, cost, 1 / (2 * every), 1 / every)
        except Exception as error:
            failures.append(_failure(index, error))
        else:
            return [pair], [cost], every
    return [], [], every


def _extended(less: Stages, more: Stages, a: float, b: float) -> Stages:
    """Costs of a whole frame, by straight lines through those with shares a < b of its facets; none less than at b."""
    return {name: more[name] + (1 - b) * max(more[name] - less.get(name, 0.0), 0.0) / (b - a) for name in more}


def _failure(index: int, error: Exception) -> str:
    return f"frame {index}: {' '.join(f'{type(error).__name__}: {error}'.split())}"


def _mean(costs: Sequence[Stages]) -> Stages:
    names = dict.fromkeys(name for cost in costs for name in cost)
    return {name: sum(cost.get(name, 0.0) for cost in costs) / len(costs) for name in names}


def _make(plan: Plan, index: int, every: int = 1) -> _TimedFrame:
    """One frame, with one facet in every `every`.

    Where the array is cut into more than PARTS parts, the undivided array is timed, and PARTS of the parts.
    """
    began, before = time.perf_counter(), time.thread_time()
    with stage_timer() as cpu:
        plan = plan.at(index)
        frame = plan.recipe.frame(index)[1]
        check_unsampled_frame(plan, frame)
        if every > 1:
            frame = _thinned(frame, every)
        count = plan.choices.subarrays
        undivided = replace(plan, choices=replace(plan.choices, subarrays=1)) if count > PARTS else plan
        values = layout_of(undivided).check(
            _stages(undivided, frame) if plan.makes_sound else silent_at(undivided, frame)
        )
    if undivided is not plan and plan.products:
        every_part = subarrays(plan.elements, count)
        timed = every_part[:: -(-len(every_part) // PARTS)]
        start = time.thread_time()
        for subarray in timed:
            subarray_signals(plan, frame, subarray)
        cpu["synthesise"] += (time.thread_time() - start) * len(every_part) / len(timed)
    return _TimedFrame(index, values, dict(cpu), time.perf_counter() - began, time.thread_time() - before, _others())


def _stages(plan: Plan, frame: Frame) -> Values:
    """All stages of a frame that is at hand."""
    traced = trace_at(plan, frame)
    return range_frame(plan, frame.index, traced, beamform_frame(plan, frame.index, traced))


def _others() -> int:
    """Processes besides this one that run or wait for a core now; 0 where nothing tells."""
    try:
        return max(int(Path("/proc/loadavg").read_text().split()[3].partition("/")[0]) - 1, 0)
    except (OSError, ValueError, IndexError):
        return 0


def _thinned(frame: Frame, every: int) -> Frame:
    """A frame whose targets have one facet of so many; their share is spread over each target."""
    bodies = [
        replace(body, mesh=Mesh(body.mesh.vertices, body.mesh.faces[::every])) if len(body.mesh.faces) > every else body
        for body in frame.moment.bodies
    ]
    return replace(frame, moment=replace(frame.moment, bodies=tuple(bodies)))


Times = tuple[float, float]


def _write(plan: Plan, tried: Sequence[Values], folder: Path | None) -> tuple[Times, Sizes, Times, Sizes]:
    """Lay the store out in a folder that is removed, and write its first shard from frames that were tried."""
    with tempfile.TemporaryDirectory(prefix=".sonarsynth-", dir=folder) as scratch:
        path = Path(scratch) / "store"
        laying_out = _timed(partial(store.create, path, plan))
        fixed = disk_use(path)
        frames = {frame: tried[frame % len(tried)] for frame in layout_of(plan).region(0)}
        writing = min(_timed(partial(store.write_shard, path, plan, 0, frames)) for _ in range(2))
        disk = disk_use(path)
        return laying_out, fixed, writing, disk + fixed * -1.0


def _timed(work: Callable[[], object]) -> Times:
    """Seconds of the processor and of the wall clock."""
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


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
