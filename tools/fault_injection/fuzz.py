"""Random changes of real recipes and of their files: each must be refused in one line, or be one to plan."""

from __future__ import annotations

import gc
import os
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fault_injection.judging import ACCEPTED, LONG, RECIPE, REFUSED, judge
from fault_injection.recipes import Case, bases, mutated
from sonarsynth import planning
from sonarsynth.recipe import reading

WHOLE = 50
"""One in so many is planned with the choices that are made by trying."""
Mutate = Callable[[Case, np.random.Generator], Case]


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Judge so many changed recipes. Returns what came of them."""
    return judged(bases(), mutated, count, seed, folder)


def judged(cases: list[Case], change: Mutate, count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Change cases, judge them, count. Failing ones are kept in a folder, and come again with the same seed."""
    kept = Path(tempfile.mkdtemp(dir=folder, prefix="fuzz-"))
    verdicts: Counter[str] = Counter()
    fields: Counter[str] = Counter()
    failures, most, began, longest = [], 0, time.perf_counter(), 0.0
    for case in cases[:count]:  # what is changed is good, and fills the caches that the processes share
        planning.plan(reading.load(lay(case, kept / "good") / RECIPE), choices=planning.Choices())
        shutil.rmtree(kept / "good")
        outcome = judge(lay(case, kept / "good"))
        if outcome.verdict != ACCEPTED:
            raise RuntimeError(f"{case.name}: {outcome.verdict}: {outcome.text}")
        shutil.rmtree(kept / "good")
    gc.freeze()
    for number in range(count):
        random = np.random.default_rng([seed, number])
        case = change(cases[number % len(cases)], random)
        place = lay(case, kept / f"{number}")
        start = time.perf_counter()
        outcome = judge(place, must_refuse=case.must_refuse, whole=number % WHOLE == WHOLE - 1)
        longest = max(longest, time.perf_counter() - start)
        most = max(most, outcome.memory)
        verdicts[outcome.verdict] += 1
        if outcome.verdict == REFUSED:
            fields[".".join(p for p in outcome.field.split(".")[:3] if not p.isdecimal()) or "(the file)"] += 1
        if outcome.ok:
            shutil.rmtree(kept / f"{number}")
        else:
            failures.append(f"{number} ({case.name}: {'; '.join(case.done)}): {outcome.verdict}: {outcome.text[:300]}")
    if not failures:
        kept.rmdir()
    return {
        "ok": not failures,
        "cases": count,
        "seed": seed,
        "accepted": verdicts[ACCEPTED] + verdicts[LONG],
        "of_them_planned_for_longer": verdicts[LONG],
        "refused_in_one_line": verdicts[REFUSED],
        "failed": {name: n for name, n in verdicts.items() if name not in (ACCEPTED, REFUSED, LONG)},
        "failures": failures,
        "kept": str(kept) if failures else None,
        "refused_by_field": dict(fields.most_common()),
        "seconds": time.perf_counter() - began,
        "longest_seconds": longest,
        "most_memory_bytes": most,
    }


def lay(case: Case, place: Path) -> Path:
    """The folder of a case: its recipe, its files, and what no recipe may open. Returns the folder of the recipe."""
    home = place / "home"
    home.mkdir(parents=True)
    outside = place / "outside"
    outside.mkdir()
    (home / RECIPE).write_bytes(case.text)
    for name, data in case.files.items():
        (home / name).write_bytes(data)
        ending = name.rpartition(".")[2]
        (outside / f"good.{ending}").write_bytes(data)
        if case.must_refuse and not (home / f"link.{ending}").is_symlink():
            _traps(home, ending)
    return home


def _traps(home: Path, ending: str) -> None:
    """Links out of the folder, to itself and to a device; a pipe, a folder, a bomb, a file larger than any memory."""
    (home / f"link.{ending}").symlink_to(f"../outside/good.{ending}")
    if not (home / "folder").exists():
        (home / "folder").symlink_to("../outside")
    (home / f"zero.{ending}").symlink_to("/dev/zero")
    (home / f"loop.{ending}").symlink_to(f"loop.{ending}")
    os.mkfifo(home / f"pipe.{ending}")
    (home / f"folder.{ending}").mkdir()
    (home / f"bomb.{ending}").write_bytes(b"PK\x03\x04" + bytes(1000))
    with (home / f"huge.{ending}").open("wb") as file:
        file.truncate(1 << 40)
