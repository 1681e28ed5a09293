"""Is a store as it was written, and does what it says agree with what was there?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sonarsynth.conventions import Progress
from sonarsynth.store.checking.check_rows import Check
from sonarsynth.store.checking.examining import Findings, Problem, by_shard, examine, frame_count, ranges
from sonarsynth.store.checking.reading_back import read_back, structure
from sonarsynth.store.files.lock import held_by
from sonarsynth.store.files.place import Folder, absolute, opens, stamps
from sonarsynth.store.marks import LAYOUT, MARKS

if TYPE_CHECKING:
    import xarray as xr


Checking = Callable[["xr.DataTree"], Sequence[Check]]
"""A check of what a store says twice."""


@dataclass(frozen=True)
class Report:
    """What verify found."""

    store: str
    frames: int  # of the dataset
    complete: tuple[int, ...]  # frames that are there
    files: int  # that were compared
    bytes: int
    problems: tuple[Problem, ...]
    checks: tuple[Check, ...]
    quick: bool = False  # True where only files were compared
    building: str = ""  # who built it meanwhile; then what is not complete yet is no damage, and no check was run

    @property
    def ok(self) -> bool:
        """True where nothing is damaged and no check failed."""
        return not self.problems and all(check.ok is not False for check in self.checks)

    def as_json(self) -> dict[str, Any]:
        """The report for a program."""
        return {
            "store": self.store,
            "quick": self.quick,
            "ok": self.ok,
            "building": self.building,
            "frames": self.frames,
            "frames_complete": len(self.complete),
            "frames_whole": ranges(self.complete),
            "frame_report": self.by_frame(),
            "files": self.files,
            "bytes": self.bytes,
            "problems": [{"where": p.where, "what": p.what, "frames": ranges(p.frames)} for p in self.problems],
            "checks": [
                {
                    "name": c.name,
                    "expected": c.expected,
                    "got": c.got,
                    "ok": c.ok,
                    "frames": ranges(c.frames),
                    "numbers": dict(c.numbers),
                    "warning": c.warning,
                }
                for c in self.checks
            ],
        }

    def by_frame(self) -> list[dict[str, Any]]:
        """A row for each frame that has something against it: damage, or checks that it does not pass."""
        rows: dict[int, dict[str, Any]] = {}
        for problem in self.problems:
            for frame in problem.frames:
                row = rows.setdefault(frame, {"frame": frame, "damage": [], "checks": []})
                row["damage"].append(f"{problem.where}: {problem.what}")
        for check in self.checks:
            for frame in check.frames:
                rows.setdefault(frame, {"frame": frame, "damage": [], "checks": []})["checks"].append(check.name)
        return [rows[frame] for frame in sorted(rows)]


def verify(
    path: Folder | str, checks: Sequence[Checking] = (), *, quick: bool = False, progress: Progress | None = None
) -> Report:
    """Compare marks, digests and files of a store, read every number back, and run checks on what it says.

    Of a store that is being built, what is complete is looked at, and no checks are run.

    Parameters
    ----------
    path: a folder or a URL.
    checks: functions that each compare something that the store says twice.
    quick: whether files are compared with their digests and no more.
    progress: is called with the frames done, their total, and 0, as they are read.

    Returns
    -------
    Problems, the results of checks, and frames.

    Raises
    ------
    Mismatch where there is no store of ours.
    """
    path = absolute(path)
    building, stamped = held_by(path), stamps(path, MARKS)
    findings, problems = _look(path, quick, progress)
    building = building or held_by(path)
    if problems and (
        building or stamped != stamps(path, MARKS)
    ):  # a build's own doing is over, or has another mark, by now
        before = {problem.where for problem in problems}
        findings, problems = _look(path, quick, progress)
        changed = {name for name, _ in stamped.items() ^ stamps(path, MARKS).items()}
        problems = [p for p in problems if p.where in before and _lasting(p, findings, changed)]
    rows = [] if problems or building or quick else _run(path, checks)
    spoiled = {frame for problem in problems for frame in problem.frames}
    complete = tuple(sorted({f for mark in findings.marks.values() for f in mark.frames} - spoiled))
    files = findings.files
    size = sum(max(size, 0) for size, _ in files.values())
    return Report(
        str(path), frame_count(path), complete, len(files), size, tuple(problems), tuple(rows), quick, building
    )


def _look(path: Folder, quick: bool, progress: Progress | None) -> tuple[Findings, list[Problem]]:
    """What there is in a store, and everything that is wrong with it."""
    findings = examine(path, progress if quick else None)
    problems = list(findings.problems)
    if not quick and findings.layout is not None and not findings.fixed:
        intact = {number: mark for number, mark in findings.marks.items() if number not in findings.shards}
        for _, mark in by_shard(intact, progress):
            problems.extend(read_back(path, mark))
        problems.extend(structure(path))
    return findings, problems


def _lasting(problem: Problem, findings: Findings, changed: set[str]) -> bool:
    """Whether a problem is of what no build has in hand: it was there before, and its mark was not written since."""
    if problem.where.endswith(".partial"):
        return False
    folder, _, name = problem.where.rpartition("/")
    if folder != MARKS and problem.frames:
        shard = next((n for n, mark in findings.marks.items() if problem.frames[0] in mark.frames), None)
        name = "" if shard is None else f"{shard}.json"
    elif folder != MARKS:
        name = f"{LAYOUT}.json"
    return bool(name) and name not in changed


def _run(path: Folder, checks: Sequence[Checking]) -> list[Check]:
    import xarray as xr

    if not checks:
        return []
    with xr.open_datatree(opens(path), engine="zarr", chunks=None) as tree:
        return [row for check in checks for row in check(tree)]
