"""Making shards: in this process, on processes of this machine, or on the workers of a running scheduler."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any, Final

from sonarsynth import store
from sonarsynth.planning import MANY_FRAMES, Plan
from sonarsynth.schedule import tasks, worker_status
from sonarsynth.schedule.tasks import Job, WrittenShard
from sonarsynth.store import Folder, Remote, Unreachable
from sonarsynth.store.files.place import read_json

PATIENCE: Final = 600.0
"""Seconds that a stage of a frame may always take (a first one compiles), and a worker to start again."""

BRIEF: Final = 5.0
"""Seconds of one core, by counts of work, that a build takes for it to be predicted and to have worker processes."""

BLOCK_SECONDS: Final = 3.0
"""A task is of as many frames as take so long, by counts of work: each costs some 10 ms to schedule."""


def reachable_by_workers(path: Folder, workers: int | None) -> Folder:
    """The place itself; raises Unreachable where worker processes would not see it."""
    if isinstance(path, Remote) and not path.shared and workers != 0:
        raise Unreachable(f"{path}: is of this process alone: give workers=0 (--workers 0)")
    return path


def with_shards_of(path: Folder, plan: Plan, attributes: Mapping[str, Any]) -> Plan:
    """The plan, with as many frames a shard as a store of it was begun with: today's rule may be another.

    Unless its attributes and its arrays agree on that, the plan as it is.
    """
    frames = attributes.get("shard_frames")
    if type(frames) is not int or not 0 < frames <= MANY_FRAMES:
        return plan
    try:
        metadata = read_json(path, f"{store.layout_of(plan).arrays[0].path}/zarr.json")
        laid: Any = metadata["chunk_grid"]["configuration"]["chunk_shape"][0]
    except (KeyError, TypeError, IndexError):
        return plan
    return replace(plan, shard_frames=frames) if laid == frames else plan


def job_of(path: Folder, plan: Plan, build: str, frame_timeout: float | None = None) -> Job:
    """What workers need to know of a build that holds the lock of its store under the name `build`.

    A stage of a frame may take `frame_timeout` seconds (None: many times what the plan predicts; 0: no limit).
    """
    predicted = plan.predicted_seconds / max(plan.recipe.frames, 1)
    limit = PATIENCE + 20 * predicted if frame_timeout is None else frame_timeout
    frames = min(BLOCK_SECONDS / max(predicted, 1e-6), plan.shard_frames)
    products = tuple(sorted(plan.products))
    together = plan.frames_together
    block = max(int(frames) // together * together or int(frames), 1)  # of whole groups
    return Job(str(path), plan.digest, products, build, limit, plan.shard_frames, block, together)


def make_shards(
    job: Job,
    plan: Plan,
    todo: Mapping[int, tuple[int, ...]],
    done: Callable[[WrittenShard], None],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory: int | None = None,
    dashboard: bool = False,
    started: Callable[[int, str], None] = lambda workers, dashboard: None,
    lost: Callable[[str, str], None] = lambda worker, why: None,
) -> None:
    """Make the frames of some shards, and write these; `done` is called as each is written.

    `started` is called with the number of workers and the dashboard's address, `lost` when a worker ends.
    """
    if not todo:
        return
    tasks.remember(job, plan)
    worker_status.close_folder(job.path)  # of a build that was killed
    if scheduler is None and workers == 0:
        for shard, frames in todo.items():
            done(tasks.write(job, shard, [tasks.render_frames(job, frames)]))
        return
    from sonarsynth.schedule import cluster, connecting

    count = min(usable_cores() if workers is None else workers, len(todo))
    with connecting.connected(count, scheduler, memory, dashboard) as client:
        started(len(client.nthreads()), client.dashboard_link or "")
        cluster.run(client, job, plan, todo, done, lost, math.inf if scheduler else PATIENCE)


def brief(plan: Plan, frames: Collection[int] | None = None) -> bool:
    """Whether frames (left out: all) take little, by counts of work, beside predicting them or starting workers."""
    share = 1.0 if frames is None else len(frames) / plan.recipe.frames
    return share * plan.predicted_seconds < BRIEF


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
