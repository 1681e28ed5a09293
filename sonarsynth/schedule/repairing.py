"""Repairing a store: what is damaged is made again from the recipe that it holds, and nothing else is touched."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from sonarsynth import planning, store
from sonarsynth.conventions import Progress
from sonarsynth.description import FieldError
from sonarsynth.planning import Plan, choices_from
from sonarsynth.schedule.making import job_of, make_shards, reachable_by_workers, with_shards_of
from sonarsynth.schedule.tasks import Failure, WrittenShard
from sonarsynth.store import Findings, Folder, Mismatch, Problem, Remote, cards, provenance
from sonarsynth.store.checking.examining import shard_of
from sonarsynth.store.checking.reading_back import read_back
from sonarsynth.store.checking.recipe_files import files_of, recipe_with
from sonarsynth.store.checking.restoring import drop_empty_folders, frames_written, move_out, obstacles, restore
from sonarsynth.store.creating import identity, plain_recipe, spelled
from sonarsynth.store.files import scratch
from sonarsynth.store.files.json_lines import append_lines
from sonarsynth.store.files.place import there
from sonarsynth.store.layout import layout_of
from sonarsynth.store.marks import MARKS, Damage, Mark, all_files, load_layout, load_mark


@dataclass
class RepairReport:
    """What a repair did. Grows while it runs."""

    store: str
    restored: tuple[str, ...] = ()  # metadata, fixed arrays, copies of the mark of the layout
    shards: tuple[int, ...] = ()  # made again, with their marks
    frames: tuple[int, ...] = ()  # of those
    moved: tuple[str, ...] = ()  # files that did not belong there, where they are now
    differing: list[int] = field(default_factory=list)  # shards whose numbers are not those that were written
    failures: list[Failure] = field(default_factory=list)  # frames that could not be made again
    problems: tuple[Problem, ...] = ()  # what is left

    @property
    def ok(self) -> bool:
        """True where the store is what it was."""
        return not (self.problems or self.failures or self.differing)

    def as_json(self) -> dict[str, Any]:
        """The report for a program."""
        problems = [{"where": p.where, "what": p.what, "frames": store.ranges(p.frames)} for p in self.problems]
        return {**asdict(self), "frames": store.ranges(self.frames), "problems": problems, "ok": self.ok}


def repair(
    path: Folder | str,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    quick: bool = False,
    insecure: bool = False,
    files: Path | str | None = None,
    progress: Progress | None = None,
) -> RepairReport:
    """Make what is damaged in a store again, from the recipe in it, so that it is what it was, bit for bit.

    Metadata and fixed arrays are laid out again; damaged shards are computed again, those frames that they had; files
    that do not belong there move to `<store>.foreign`. What failed when the store was built is not tried. Ended in
    whatever way, the same call goes on.

    Parameters
    ----------
    path: a folder or a URL.
    workers: processes, as in `build`.
    scheduler: address of a running Dask scheduler, as in `build`.
    force: whether to go on where the version of sonarsynth, its code or its libraries are others.
    quick: whether files are trusted that have the digest of their mark; else every number is read back, as in `verify`.
    insecure: whether a scheduler on another machine may be used without TLS.
    files: folder of the files that the recipe names; they are opened nowhere else.
    progress: as in `build`.

    Returns
    -------
    What was restored, computed again and moved.

    Raises
    ------
    Mismatch where there is no store of ours, or where it cannot be made again as it was: other code (unless `force`),
    or files that the recipe names have changed, are gone, or need `files`; Damage where the recipe cannot be read any
    more; store.StoreLocked while a build runs; OSError where the store cannot be written; ValueError for a scheduler on
    another machine without TLS, unless `insecure`.
    """
    if scheduler is not None:
        from sonarsynth.schedule.connecting import check_address

        check_address(scheduler, insecure)
    path = reachable_by_workers(store.absolute(path), workers)
    store.must_be_store(path)
    with store.lock(path) as name:
        if not isinstance(path, Remote):
            scratch.sweep(path, links=True)
        findings = store.examine(path)
        laid = findings.layout is not None and not findings.fixed
        unlike = _unlike(path, findings) if laid and not quick else []
        plan = _plan_of(path, findings, force, files) if not laid or findings.shards or unlike else None
        report = RepairReport(str(path))
        report.moved = move_out(path, findings.foreign)
        report.restored, in_the_way = restore(path, findings, plan)
        report.moved += in_the_way
        if plan is not None:
            unlike = unlike if laid or quick else _unlike(path, findings)
            todo = _todo(path, findings, plan, unlike)
            report.moved += move_out(path, _in_the_way(path, findings, plan, todo))
            report.shards, report.frames = tuple(todo), tuple(f for frames in todo.values() for f in frames)
            written = {n: mark for n, mark in findings.marks.items() if n not in unlike}
            own_workers = 0 if (workers is None and len(todo) == 1) or _elsewhere(path, plan) else workers
            done = _counter(path, written, report, progress)
            make_shards(job_of(path, plan, name), plan, todo, done, workers=own_workers, scheduler=scheduler)
        _finish(path, report)
    return report


def _finish(path: Folder, report: RepairReport) -> None:
    """Look at the store once more, and put what is left to say into the report; its card, if it has one, anew."""
    findings = store.examine(path)
    if findings.foreign:  # known only now, if the layout was not
        report.moved += move_out(path, findings.foreign)
        findings = store.examine(path)
    drop_empty_folders(path)
    report.problems = findings.problems
    if not findings.problems and there(store.beside(path, "card.md")):
        cards.write(path)


def _elsewhere(path: Folder, plan: Plan) -> bool:
    """Whether files are elsewhere than where the recipe in the store, which worker processes follow, has them."""
    stored = provenance.paths(plain_recipe(store.root_attributes(path)))
    return set(stored) != set(provenance.paths(plan.recipe.as_json()))


def _plan_of(path: Folder, findings: Findings, force: bool, files: Path | str | None) -> Plan:
    """The plan that the store was built by. Raises Mismatch where it cannot be had again, Damage without a recipe."""
    attrs = findings.attributes or store.root_attributes(path)
    try:
        text, digest, products = str(attrs["recipe"]), attrs["recipe_digest"], frozenset(attrs["products"])
    except (KeyError, TypeError):
        raise Damage(
            f"{path}: its recipe cannot be read any more, neither in {MARKS} nor in zarr.json: rebuild it"
        ) from None
    try:
        choices = choices_from(attrs["choices"]) if "choices" in attrs else None
        plan = planning.plan(recipe_with(text, str(path), files_of(path, attrs, files)), products, choices)
    except Mismatch:
        raise
    except OSError as error:
        raise Mismatch(f"{path}: {error.filename}, which its recipe names, cannot be read: {error.strerror}") from None
    except (ValueError, TypeError, FieldError, MemoryError) as error:
        raise Mismatch(f"{path}: its recipe cannot be followed any more: {error}") from None
    if plan.digest != digest:
        raise Mismatch(f"{path}: a file that its recipe names has changed since the store was built")
    plan = with_shards_of(path, plan, attrs)
    now = identity(plan)
    if attrs.get("shard_frames") != now["shard_frames"]:
        raise Mismatch(
            f"{path} has {attrs.get('shard_frames')} frames in a shard, and would now have {now['shard_frames']}"
        )
    old, new = attrs.get("sonarsynth_version"), now["sonarsynth_version"]
    if old != new and not force:
        raise Mismatch(f"{path} was built by sonarsynth {old}, and this is {new}: use that one, or --force")
    if attrs.get("code_digest") != now["code_digest"] and not force:
        raise Mismatch(f"{path} was built by another state of the code of sonarsynth {new}: use that one, or --force")
    odd = provenance.other_versions(attrs)
    if odd and not force:
        raise Mismatch(f"{path} was built with other libraries ({spelled(odd)}): use those, or --force")
    return plan


def _unlike(path: Folder, findings: Findings) -> list[int]:
    """Shards whose files are as their mark says, and whose numbers are not. The layout must be whole."""
    alike = sorted(findings.marks.keys() - findings.shards)
    return [n for n in alike if any("not finite" not in p.what for p in read_back(path, findings.marks[n]))]


def _todo(path: Folder, findings: Findings, plan: Plan, unlike: Iterable[int]) -> dict[int, tuple[int, ...]]:
    """Shards to make again, with the frames that they had."""
    todo = {}
    for shard in sorted(findings.shards | set(unlike)):
        mark = findings.marks.get(shard)
        frames = frames_written(path, plan, shard) if mark is None else mark.frames
        if frames:
            todo[shard] = frames
    return todo


def _in_the_way(path: Folder, findings: Findings, plan: Plan, todo: Mapping[int, tuple[int, ...]]) -> list[str]:
    """What cannot be written over, and what is named as of a shard of which the arrays of all shards have no sign."""
    layout = layout_of(plan)
    rewritten = {a.file(shard) for shard in todo for a in layout.arrays if not a.empty}
    marks = {number: f"{MARKS}/{number}.json" for number in findings.shards}
    lost = findings.shards - todo.keys()
    laid = load_layout(path)
    ours = rewritten | (set() if laid is None else set(laid.files))
    unmarked = findings.shards - findings.marks.keys()
    data = [n for n in all_files(path) if n not in ours and shard_of(path, n) in unmarked]
    return [*obstacles(path, rewritten | {marks[n] for n in todo if n in marks}), *data, *(marks[n] for n in lost)]


def _counter(
    path: Folder, written: Mapping[int, Mark], report: RepairReport, progress: Progress | None
) -> Callable[[WrittenShard], None]:
    """What is done with a shard that is made again: compared with what its mark said, its failures kept."""
    done_frames = 0

    def done(again: WrittenShard) -> None:
        nonlocal done_frames
        done_frames += len(again.frames)
        report.failures.extend(again.failures)
        append_lines(store.beside(path, "failed.jsonl"), [asdict(f) for f in again.failures])
        mark, old = load_mark(path, again.shard), written.get(again.shard)
        if mark is not None and old is not None and not again.failures and _written(mark) != _written(old):
            report.differing.append(again.shard)
        if progress is not None:
            progress(done_frames, len(report.frames), len(report.failures))

    return done


def _written(mark: Mark) -> tuple[object, ...]:
    """What is in a shard, whoever wrote it."""
    return mark.frames, mark.content, mark.files
