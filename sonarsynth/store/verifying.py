"""Is a store as it was written, and does what it says agree with what was there?"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from sonarsynth.store.creating import root_attributes
from sonarsynth.store.marks import (
    ABSENT,
    LAYOUT,
    Damage,
    FileRecord,
    Mark,
    add_to_digest,
    all_files,
    load_mark,
    mark_file,
    marked,
    record,
)

if TYPE_CHECKING:
    import xarray as xr

MUST_BE_FINITE: Final = ("/", "/signals")
"""Groups without NaN in the frames that are there; elsewhere NaN means "no point", "not found"."""


class CheckRow(Protocol):
    """One line of a check of truth against data; `ok` is None where there was nothing to check."""

    @property
    def name(self) -> str:
        """What is checked."""

    @property
    def expected(self) -> str:
        """What should be."""

    @property
    def got(self) -> str:
        """What is."""

    @property
    def ok(self) -> bool | None:
        """Whether it is as it should be."""

    @property
    def numbers(self) -> Mapping[str, float]:
        """The numbers behind it."""


Check = Callable[["xr.DataTree"], Sequence[CheckRow]]


@dataclass(frozen=True)
class Problem:
    """Something that is not as it was written."""

    where: str
    what: str


@dataclass(frozen=True)
class Report:
    """What verify found."""

    store: str
    frames: int  # of the dataset
    complete: tuple[int, ...]  # frames that are there
    files: int  # that were compared
    bytes: int
    problems: tuple[Problem, ...]
    checks: tuple[CheckRow, ...]

    @property
    def ok(self) -> bool:
        """True where nothing is damaged and no check failed."""
        return not self.problems and all(check.ok is not False for check in self.checks)

    def as_json(self) -> dict[str, Any]:
        """The report for a program."""
        return {
            "store": self.store,
            "ok": self.ok,
            "frames": self.frames,
            "frames_complete": len(self.complete),
            "files": self.files,
            "bytes": self.bytes,
            "problems": [vars(p) for p in self.problems],
            "checks": [
                {"name": c.name, "expected": c.expected, "got": c.got, "ok": c.ok, "numbers": dict(c.numbers)}
                for c in self.checks
            ],
        }


def verify(path: Path | str, checks: Sequence[Check] = ()) -> Report:
    """Compare marks, digests and files of a store, read every number back, and run checks on what it says.

    Raises Damage where there is no store that could be read at all.
    """
    path = Path(path)
    if not path.is_dir():
        raise Damage(f"{path}: no such store")
    problems: list[Problem] = []
    marks = list(_marks(path, problems))
    files = {name: found for mark in marks for name, found in mark.files.items()}
    broken = set(_compare_files(path, files, problems))
    _find_strangers(path, files, marks, problems)
    layout = next((m for m in marks if m.name == LAYOUT), None)
    readable = layout is not None and not broken & set(layout.files)
    rows: Sequence[CheckRow] = ()
    if readable:
        for mark in marks:
            if mark is not layout and not broken & set(mark.files):
                problems.extend(_read_back(path, mark))
        problems.extend(_structure(path))
        rows = () if problems else _run(path, checks)
    complete = tuple(sorted(frame for mark in marks for frame in mark.frames))
    frames = _frame_count(path) if readable else 0
    size = sum(max(size, 0) for size, _ in files.values())
    return Report(str(path), frames, complete, len(files), size, tuple(problems), tuple(rows))


def _marks(path: Path, problems: list[Problem]) -> Iterator[Mark]:
    names: list[str | int] = [LAYOUT, *marked(path)]
    for name in names:
        try:
            mark = load_mark(path, name)
        except Damage as damage:
            where, _, what = str(damage).partition(": ")
            problems.append(Problem(where, what))
            continue
        if mark is None:
            problems.append(Problem(str(mark_file(path, name).relative_to(path)), "the mark is missing"))
        else:
            yield mark


def _compare_files(path: Path, files: Mapping[str, FileRecord], problems: list[Problem]) -> Iterator[str]:
    """Names of the files that are not as recorded."""
    for name, (size, digest) in sorted(files.items()):
        try:
            found = record(path, name)
        except FileNotFoundError:
            if (size, digest) == ABSENT:
                continue
            problems.append(Problem(name, "the file is missing"))
        except OSError as error:
            problems.append(Problem(name, f"cannot be read: {error.strerror}"))
        else:
            if found == (size, digest):
                continue
            what = f"has {found[0]} bytes, not {max(size, 0)}" if found[0] != size else "its contents have changed"
            problems.append(Problem(name, what))
        yield name


def _find_strangers(
    path: Path, files: Mapping[str, FileRecord], marks: Sequence[Mark], problems: list[Problem]
) -> None:
    """Files that no mark knows: data without a mark (a build that was interrupted, or a lost mark), or not ours."""
    shards: dict[str, int] = {}
    for name in sorted(set(all_files(path)) - set(files)):
        parts = name.split("/")
        at = len(parts) - 1 - parts[::-1].index("c") if "c" in parts else -1
        if at > 0 and all(p.isdecimal() for p in parts[at + 1 :]) and f"{'/'.join(parts[:at])}/zarr.json" in files:
            shards[parts[at + 1]] = shards.get(parts[at + 1], 0) + 1
        else:
            problems.append(Problem(name, "the file does not belong here"))
    marked_shards = {m.name for m in marks}
    for shard in sorted(shards, key=int):
        what = "files that its mark does not know" if shard in marked_shards else "data without a completion mark"
        problems.append(Problem(f"shard {shard}", f"{what}: build again to finish it"))
    odd = {entry.name for entry in (path / ".marks").glob("*")} - {f"{m.name}.json" for m in marks}
    known = {Path(p.where).name for p in problems}
    problems.extend(Problem(f".marks/{name}", "the file does not belong here") for name in sorted(odd - known))


def _read_back(path: Path, mark: Mark) -> Iterable[Problem]:
    """Decode a shard: its contents must have the digest of its mark, and be finite where they must be."""
    import zarr

    root = zarr.open_group(path, mode="r")
    shard, step = int(mark.name), int(root_attributes(path)["shard_frames"])
    digest = hashlib.sha256()
    for name in sorted({file.partition("/c/")[0] for file in mark.files}):
        try:
            array = root[name]
            assert isinstance(array, zarr.Array)
            block = np.asarray(array[shard * step : min((shard + 1) * step, array.shape[0])])
        except Exception as error:  # whatever a codec raises on what it cannot decode
            yield Problem(f"{name}, shard {shard}", f"cannot be decoded: {error}")
            return
        add_to_digest(digest, name, block)
        yield from _finite(name, block, [f - shard * step for f in mark.frames], shard * step)
    if digest.hexdigest() != mark.content:
        yield Problem(f"shard {shard}", "its numbers are not the ones that were written")


def _finite(name: str, block: np.ndarray, rows: list[int], first: int) -> Iterator[Problem]:
    if block.dtype.kind != "f":
        return
    group = "/" + name.rpartition("/")[0]
    bad = np.isinf(block[rows]) if group not in MUST_BE_FINITE else ~np.isfinite(block[rows])
    frames = np.flatnonzero(bad.reshape(len(rows), -1).any(axis=1)) if bad.size else ()
    for i in frames:
        yield Problem(f"{name}, frame {first + rows[i]}", f"{int(bad[i].sum())} values are not finite")


def _structure(path: Path) -> Iterator[Problem]:
    """Plain xarray opens it, and every variable has units."""
    import xarray as xr

    try:
        with xr.open_datatree(path, engine="zarr", chunks=None) as tree:
            for node in tree.subtree:
                for name, variable in node.to_dataset(inherit=False).variables.items():
                    if "units" not in variable.attrs:
                        yield Problem(f"{node.path}/{name}", "has no units")
    except Exception as error:
        yield Problem(str(path), f"cannot be opened by xarray: {error}")


def _run(path: Path, checks: Sequence[Check]) -> list[CheckRow]:
    import xarray as xr

    if not checks:
        return []
    with xr.open_datatree(path, engine="zarr", chunks=None) as tree:
        return [row for check in checks for row in check(tree)]


def _frame_count(path: Path) -> int:
    import zarr

    frame = zarr.open_group(path, mode="r")["frame"]
    assert isinstance(frame, zarr.Array)
    return int(frame.shape[0])
