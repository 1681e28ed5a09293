"""What in a store is not as it was written, file by file: what `verify` reports, and `repair` mends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final

from sonarsynth.conventions import Progress
from sonarsynth.store.files.place import FileRecord, Folder, entries, is_folder, read_json, records, there
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.scratch import PARTIAL
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import (
    ABSENT,
    LAYOUT,
    MANIFESTS,
    MARKS,
    REMEDY,
    Damage,
    Mark,
    all_files,
    load_layout,
    load_marks,
    marked,
    read_mark,
)
from sonarsynth.store.opening import check_format, must_be_folder, root_attributes

MOST_FRAMES: Final = 1_000_000
"""Frames of a shard that are counted, whatever a store says of itself."""


@dataclass(frozen=True)
class Problem:
    """Something that is not as it was written; `frames` are those that it spoils, none where it is not about frames."""

    where: str
    what: str
    frames: tuple[int, ...] = ()


@dataclass(frozen=True)
class Findings:
    """What there is in a store, and what of it is not as it was written."""

    layout: Mark | None  # None where no copy of it can be read
    marks: Mapping[int, Mark]  # of shards; those that are whole
    problems: tuple[Problem, ...]
    manifests: frozenset[str]  # copies of the mark of the layout that are damaged
    fixed: frozenset[str]  # files that were laid out and are damaged
    shards: frozenset[int]  # with files that are not as their mark says, or without a mark that can be read
    foreign: frozenset[str]  # files that nobody wrote

    @property
    def files(self) -> dict[str, FileRecord]:
        """Every file that the marks know."""
        fixed = {} if self.layout is None else dict(self.layout.files)
        return fixed | {name: file for mark in self.marks.values() for name, file in mark.files.items()}

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Attributes of the root as they were laid out; {} where no copy of the mark of the layout can be read."""
        return {} if self.layout is None else self.layout.attributes


def by_shard(marks: Mapping[int, Mark], progress: Progress | None) -> Iterator[tuple[int, Mark]]:
    """Shards in order, each followed by how many frames are done."""
    done, total = 0, sum(len(mark.frames) for mark in marks.values())
    for number in sorted(marks):
        yield number, marks[number]
        done += len(marks[number].frames)
        if progress is not None:
            progress(done, total, 0)


def examine(path: Folder, progress: Progress | None = None) -> Findings:
    """Compare every file of a store with its record. Raises Mismatch where there is no store of ours."""
    must_be_store(path)
    problems: list[Problem] = []
    manifests = _manifests(path, problems)
    layout = load_layout(path)
    region = _regions(path, layout)
    marks, shards = _marks(path, region, problems)
    fixed = set() if layout is None else _compare(path, layout, problems)
    for number, mark in by_shard(marks, progress):
        if _compare(path, mark, problems):
            shards.add(number)
    findings = Findings(layout, marks, (), manifests, frozenset(fixed), frozenset(shards), frozenset())
    unmarked, foreign = _strangers(path, findings, region, problems)
    shards |= unmarked
    return Findings(layout, marks, tuple(problems), manifests, findings.fixed, frozenset(shards), foreign)


def must_be_store(path: Folder) -> None:
    """Raise Mismatch where there is no store of ours (no mark, no digest of a recipe), or one of another format."""
    must_be_folder(path)
    manifest = any(there(path, name) for name in MANIFESTS)
    attributes = root_attributes(path)
    if not (manifest or "recipe_digest" in attributes or marked(path)):
        raise Mismatch(f"{path} is not a store of sonarsynth")
    check_format(path, attributes)


def _manifests(path: Folder, problems: list[Problem]) -> frozenset[str]:
    """Copies of the mark of the layout that are damaged."""
    bad = set()
    for name in MANIFESTS:
        fault = "the mark is missing"
        try:
            if read_mark(path, name, LAYOUT) is not None:
                continue
        except Damage as damage:
            fault = _fault(damage)
        bad.add(name)
        problems.append(Problem(name, fault))
    return frozenset(bad)


def _fault(damage: Damage) -> str:
    """What is wrong with a mark; what to do is said once of all."""
    return str(damage).partition(": ")[2].removesuffix(f": {REMEDY}")


def frame_count(path: Folder) -> int:
    """Frames of the dataset, by the metadata of the array `frame` or the copy in the root's; 0 where both are lost."""
    for file, inside in (("frame/zarr.json", ()), ("zarr.json", ("consolidated_metadata", "metadata", "frame"))):
        try:
            metadata: Any = read_json(path, file)
            for name in inside:
                metadata = metadata[name]
            return int(metadata["shape"][0])
        except (ValueError, KeyError, TypeError, IndexError):
            continue
    return 0


def _regions(path: Folder, layout: Mark | None) -> Callable[[int], tuple[int, ...]]:
    """The frames of a shard."""
    step = (root_attributes(path) if layout is None else layout.attributes).get("shard_frames")
    count = frame_count(path)
    if not isinstance(step, int) or not 0 < step <= MOST_FRAMES:
        return lambda shard: ()
    return lambda shard: tuple(range(shard * step, min((shard + 1) * step, count)))


def _marks(
    path: Folder, region: Callable[[int], tuple[int, ...]], problems: list[Problem]
) -> tuple[dict[int, Mark], set[int]]:
    """Marks of shards, and the numbers of those that are damaged."""
    marks, bad = {}, set()
    for number, mark in load_marks(path, marked(path)):
        if isinstance(mark, Damage):
            problems.append(Problem(str(mark).partition(": ")[0], _fault(mark), region(number)))
            bad.add(number)
        elif mark is not None:
            marks[number] = mark
    return marks, bad


def _compare(path: Folder, mark: Mark, problems: list[Problem]) -> set[str]:
    """Names of the files of a mark that are not as recorded."""
    bad = set()
    for name, actual in records(path, mark.files):
        size, digest = mark.files[name]
        if isinstance(actual, FileNotFoundError | NotADirectoryError):
            if (size, digest) == ABSENT:
                continue
            fault = "the file is missing"
        elif isinstance(actual, OSError):
            fault = f"cannot be read: {actual.strerror}"
        else:
            if actual == (size, digest):
                continue
            fault = f"has {actual[0]} bytes, not {max(size, 0)}" if actual[0] != size else "its contents have changed"
        bad.add(name)
        problems.append(Problem(name, fault, mark.frames))
    return bad


def _strangers(
    path: Folder, findings: Findings, region: Callable[[int], tuple[int, ...]], problems: list[Problem]
) -> tuple[set[int], frozenset[str]]:
    """Files that no mark knows: numbers of the shards that they are data of (a mark is lost, or a build was
    interrupted), and the names of those that are not ours."""
    if isinstance(path, Remote) and not path.listed:
        return set(), frozenset()  # nobody can ask what else there is
    files = findings.files
    folders = {MARKS}
    for name in files:
        while name := name.rpartition("/")[0]:
            folders.add(name)
    folders = {name for name in folders if isinstance(path, Path) and is_folder(path, name)}
    lost: dict[int, list[str]] = {}
    foreign: list[str] = []
    for name in sorted(set(all_files(path)) - set(files) - folders):
        shard = shard_of(path, name)
        if shard is None or shard in findings.marks:
            if findings.layout is not None or shard is not None:
                foreign.append(name)
        else:
            lost.setdefault(shard, []).append(name)
    for shard in sorted(lost):
        fault = "data without a completion mark: build again, or repair, to finish it"
        problems.append(Problem(f"shard {shard}", fault, region(shard)))
    ours = {f"{number}.json" for number in marked(path)} | {PurePosixPath(m).name for m in MANIFESTS}
    foreign += sorted(f"{MARKS}/{name}" for name in entries(path, MARKS) if name not in ours)
    unfinished, unknown = "a file that was not finished: build again to remove it", "the file does not belong here"
    for name in foreign:
        problems.append(Problem(shown(name), unfinished if PARTIAL.fullmatch(PurePosixPath(name).name) else unknown))
    return set(lost), frozenset(foreign)


def shard_of(path: Folder, name: str) -> int | None:
    """The shard that a file of an array would be of by its name, None for other files."""
    array, _, key = name.rpartition("/")
    head, *numbers = key.split(".")
    if head != "c" or not array or not numbers or not all(n.isascii() and n.isdecimal() for n in numbers):
        return None
    return int(numbers[0]) if is_folder(path, array) else None


def shown(name: str) -> str:
    """A file name as a line can hold it."""
    return name if name.isprintable() else ascii(name)[1:-1]


def ranges(frames: Sequence[int]) -> str:
    """Frame numbers, in order, as `--frames` takes them: 0:8,12:13."""
    starts = [f for f, before in zip(frames, [None, *frames], strict=False) if before is None or f != before + 1]
    stops = [f + 1 for f, after in zip(frames, [*frames[1:], None], strict=False) if after is None or after != f + 1]
    return ",".join(f"{start}:{stop}" for start, stop in zip(starts, stops, strict=True))
