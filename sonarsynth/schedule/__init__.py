"""Building a dataset: which shards are missing, who makes them, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, fields, replace
from typing import Final

import numpy as np

from sonarsynth import planning, store
from sonarsynth.conventions import Progress, format_bytes
from sonarsynth.description.memory import free_bytes
from sonarsynth.planning import PRODUCTS, Plan, choices_from, chosen_products
from sonarsynth.recipe import Recipe
from sonarsynth.recipe.reading import Source
from sonarsynth.schedule.build_report import BuildProgress, BuildReport
from sonarsynth.schedule.disk_space import DiskRoom, TooLarge, check_space, told_when_full
from sonarsynth.schedule.making import brief, job_of, make_shards, reachable_by_workers, usable_cores, with_shards_of
from sonarsynth.schedule.predicting import Prediction, predict
from sonarsynth.schedule.tasks import Failure
from sonarsynth.store import Damage, Folder, Mismatch, cards, provenance
from sonarsynth.store.creating import plain_recipe, spelled
from sonarsynth.store.files.json_lines import append_lines, read_lines, write_lines

__all__ = ["BuildReport", "Prediction", "TooLarge", "brief", "build", "predict", "usable_cores"]

LEAST_MEMORY: Final = 300_000_000
"""Bytes that a worker needs before it has done anything."""


def build(
    recipe: Recipe | Plan,
    path: Folder | str,
    *,
    frames: int | Iterable[int] | None = None,
    products: Iterable[str] = PRODUCTS,
    workers: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
    retry_failed: bool = False,
    frame_timeout: float | None = None,
    worker_memory: int | None = None,
    agreed: bool = False,
    insecure: bool = False,
    mixed_versions: bool = False,
    dashboard: bool = False,
    progress: Progress | None = None,
    announce: Callable[[str], None] | None = None,
    prediction: Prediction | None = None,
    source: Source | None = None,
) -> BuildReport:
    """Build the frames of a recipe that a store lacks, laying the store out if it is not there.

    The arrays are the same whatever the number of workers, the order, the interruptions. Beside the store: a log in
    `<store>.log.jsonl`, run times in `<store>.times.jsonl`, frames that failed in `<store>.failed.jsonl`, a card in
    `<store>.card.md`, Croissant metadata in `<store>.croissant.json`; of a store at a URL, log and run times are in
    ~/.local/state/sonarsynth. From a script, call it under `if __name__ == "__main__":`, as all multiprocessing needs.
    A frame that raises fails and is skipped; on worker processes also one that crashes or takes too long.

    Parameters
    ----------
    recipe: a recipe, or the plan of one.
    path: folder of the store, or a URL that fsspec knows, such as s3://bucket/remus.zarr.
    frames: numbers of the frames, one or several, or a mask (frame,) (default: all).
    products: of signals, image and cloud, those that are stored; a plan has its own.
    workers: processes on this machine (default: one a usable core, and none for a single shard of a few seconds' work
        that no other option is for; 0: in this process).
    scheduler: address of a running Dask scheduler, whose workers are used instead.
    restart: whether a store of something else is replaced.
    retry_failed: whether frames that failed in earlier builds are tried again.
    frame_timeout: seconds that a stage may take (default: by the plan; 0: no limit).
    worker_memory: bytes that a worker may take (default: its share of the machine's).
    agreed: whether to build what needs more disk than is free, or over 1 TB.
    insecure: whether a scheduler on another machine may be used without TLS.
    mixed_versions: whether to go on with other versions of libraries than the store was begun with; frames are marked.
    dashboard: whether Dask's is started, on 127.0.0.1, where every user of this machine can read it.
    progress: called with the numbers of frames done, wanted and failed.
    announce: called with lines for people, such as the address of the dashboard.
    prediction: of `predicting.predict`, compared with what is measured.
    source: the text of the recipe (`reading.read`), kept in the store.

    Returns
    -------
    Numbers of frames, times (s) and failures.

    Raises
    ------
    FieldError for a scene that cannot be, IndexError for frames that are not there, store.Mismatch for a store of
    something else, store.StoreLocked while another build runs, store.Damage where the store cannot go on, TooLarge
    where `agreed` is needed, OSError where it cannot be written or the scheduler is gone, store.Unreachable for a URL
    that cannot be used, RuntimeError where workers do not start, ValueError for options that cannot be, TypeError for
    frames and workers that are no whole numbers. After any of these, and after an interruption, the same call resumes
    where it ended.
    """
    plan = recipe if isinstance(recipe, Plan) else planning.plan(recipe, chosen_products(products))
    _check(workers, scheduler, frame_timeout, worker_memory, insecure)
    _check_memory(plan, scheduler, workers, worker_memory, agreed)
    path, count = _place(path, workers), plan.recipe.frames
    chosen = range(count) if frames is None else sorted(set(store.frame_numbers(frames, count)))
    if not path.exists() and not agreed:
        check_space(path, _room(plan, len(chosen)))
    report = BuildReport(str(path), plan.recipe.frames, len(chosen), 0)
    still = lambda: _room(plan, max(len(chosen) - report.there - report.written, 1))  # noqa: E731
    with told_when_full(path, still), store.lock(path) as name:
        plan = plan if restart else _as_begun(path, plan)
        store.create(path, plan, restart=restart, source=source, mixed_versions=mixed_versions)
        report.notes = (*plan.warnings, *_notes(path, scheduler))
        if workers != 0:
            _check_files(path, plan)
        earlier = {} if restart else _failed(path)
        skipped = set() if retry_failed else earlier.keys() & set(chosen)
        todo = store.missing(path, plan, [frame for frame in chosen if frame not in skipped])
        lacking = {frame for of_shard in todo.values() for frame in of_shard}
        if not agreed:
            check_space(path, _room(plan, len(lacking)))
        report.there = sum(frame not in lacking and frame not in skipped for frame in chosen)
        report.failures = [earlier[frame] for frame in sorted(skipped)]
        _tidy(path, lacking, earlier, restart)
        course = BuildProgress(path, report, len(lacking), progress, announce)
        with course.logged(plan):
            job = job_of(path, plan, name, frame_timeout)
            make_shards(
                job, plan, todo, course.done, scheduler=scheduler, memory=worker_memory, dashboard=dashboard,
                workers=_processes(workers, plan, todo, frame_timeout or worker_memory or dashboard),
                started=course.started, lost=course.lost,
            )  # fmt: skip
        _describe(path, report, prediction)
    return report


def _place(path: Folder | str, workers: int | None) -> Folder:
    """Where the store is. Raises Mismatch for a place in another store, which would be damaged by it."""
    place = reachable_by_workers(store.absolute(path), workers)
    if (around := store.store_around(place)) is not None:
        raise Mismatch(f"{place} is in the store {around}: choose another path")
    return place


def _describe(path: Folder, report: BuildReport, prediction: Prediction | None) -> None:
    """Put the card beside the store, whoever wrote what it tells of, and what was predicted into its times."""
    cards.write(path)
    if prediction is not None:
        report.prediction = prediction.against(report)
        append_lines(store.here(path, "times.jsonl"), [{"build": report.prediction}])


def _notes(path: Folder, scheduler: str | None) -> list[str]:
    """What a user should know of a build that goes on all the same."""
    odd = provenance.other_versions(store.root_attributes(path))
    notes = (
        [f"frames written now use other libraries than the first ones of this store ({spelled(odd)})"] if odd else []
    )
    if scheduler is not None and not scheduler.startswith(("tls://", "wss://", "inproc://")):
        notes.append(f"{scheduler} is not encrypted: anyone who can reach it can run code there and on this machine")
    return notes


def _check_files(path: Folder, plan: Plan) -> None:
    """Raise Mismatch where a store's recipe, which worker processes follow, names files that this one does not."""
    stored = set(provenance.paths(plain_recipe(store.root_attributes(path))))
    odd = sorted(stored - set(provenance.paths(plan.recipe.as_json())))
    if odd:
        raise Mismatch(
            f"{path}: its recipe names {odd[0]}, which this one does not: use --workers 0 to go on without opening it, "
            "or --restart to overwrite the store"
        )


def _processes(workers: int | None, plan: Plan, todo: Mapping[int, tuple[int, ...]], asked: object) -> int | None:
    """Worker processes: none for one brief shard, unless something is asked that only they do."""
    alone = workers is None and not asked and len(todo) == 1 and brief(plan, *todo.values())
    return 0 if alone else workers


def _as_begun(path: Folder, plan: Plan) -> Plan:
    """The plan, with the choices and the shards that a store of the same recipe was begun with: others may be made
    elsewhere."""
    stored = store.root_attributes(path)
    if stored.get("recipe_digest") != plan.digest or "choices" not in stored:
        return plan
    try:
        return with_shards_of(path, replace(plan, choices=choices_from(stored["choices"])), stored)
    except ValueError:
        raise Damage(f"{path}: its choices cannot be read: use --restart to overwrite it") from None


def _check(
    workers: int | None,
    scheduler: str | None,
    frame_timeout: float | None,
    worker_memory: int | None,
    insecure: bool,
) -> None:
    """Raise ValueError for options that cannot be."""
    if workers is not None and not isinstance(workers, int | np.integer):
        raise TypeError(f"workers must be a whole number, not {workers!r}")
    if workers is not None and workers < 0:
        raise ValueError(f"workers must be 0 or more, not {workers}")
    if frame_timeout is not None and not 0 <= frame_timeout < float("inf"):
        raise ValueError(f"frame_timeout must be 0 s (no limit) or more, not {frame_timeout}")
    if worker_memory is not None and worker_memory < LEAST_MEMORY:
        raise ValueError(f"worker_memory must be {LEAST_MEMORY:g} bytes or more, not {worker_memory}")
    if scheduler is not None:
        from sonarsynth.schedule import connecting

        connecting.check_address(scheduler, insecure)


def _check_memory(
    plan: Plan, scheduler: str | None, workers: int | None, worker_memory: int | None, agreed: bool
) -> None:
    """Raise TooLarge where a frame and a shard do not fit in the memory of a worker of this machine."""
    workers = usable_cores() if workers is None else max(workers, 1)
    share = free_bytes() / workers if worker_memory is None else worker_memory
    if scheduler is None and not agreed and plan.memory_bytes > share:
        raise TooLarge(
            f"a worker takes up to {format_bytes(plan.memory_bytes)} of memory, and each of {workers} has "
            f"{format_bytes(share)}: "
            "fewer --workers, or more --worker-memory (use --yes to build anyway)"
        )


def _room(plan: Plan, frames: int) -> DiskRoom:
    """The room on the disk that so many frames need at most."""
    bytes_ = plan.predicted_bytes * frames / max(plan.recipe.frames, 1)
    return DiskRoom(bytes_, store.layout_of(plan).files(-(-frames // plan.shard_frames)))


def _failed(path: Folder) -> dict[int, Failure]:
    """Frames that failed in earlier builds and are still missing."""
    names = {field.name for field in fields(Failure)}
    rows = [row for row in read_lines(store.beside(path, "failed.jsonl")) if names <= row.keys()]
    complete = set(store.frames_there(path)) if rows else set()
    failures = [Failure(**{name: row[name] for name in names}) for row in rows]
    return {failure.frame: failure for failure in failures if failure.frame not in complete}


def _tidy(path: Folder, again: set[int], earlier: Mapping[int, Failure], restart: bool) -> None:
    """Forget the failures of frames that are tried again, and, on a restart, old run times and the log."""
    if restart:
        for old in ("times.jsonl", "log.jsonl"):
            store.here(path, old).unlink(missing_ok=True)
        for old in ("card.md", "croissant.json"):  # of what was there before
            store.beside(path, old).unlink(missing_ok=True)
    file = store.beside(path, "failed.jsonl")
    remaining = [asdict(failure) for frame, failure in earlier.items() if frame not in again]
    if file.exists():
        write_lines(file, remaining)
