"""`tools/faults --kills N`: builds killed with SIGKILL at random times and at named points, resumed, compared.

A victim is the command line itself, in a process forked from this one.
What is killed: the client, a worker, the scheduler (of a cluster of its own), or the whole group at once. When: at a
random time, or when something appears on the disk: the lock, the new folder, the layout, the first file of a shard,
a mark, the n-th file. After the kill every completion mark must be of what an undisturbed build has; then builds are
resumed, and perhaps killed again, until one ends well; its files and marks must be those of the undisturbed build.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fault_injection.cluster import Cluster
from fault_injection.corrupt import RECIPE as SMALL
from fault_injection.processes import LONGEST, end_hung, ended, fork, kill_worker, strike, wait
from sonarsynth import planning, schedule, store
from sonarsynth.recipe import reading
from sonarsynth.store.files.place import record
from sonarsynth.store.marks import ABSENT, all_files, load_mark, marked
from sonarsynth.store.provenance import PROVENANCE

RECIPE = (
    SMALL.replace("title: small", "title: tiny")
    .replace("edge: 0.5", "edge: 1.0")
    .replace("columns: 4, rows: 3", "columns: 3, rows: 2")
    .replace("frames: 20, interval: 0.1", "frames: 40, interval: 0.02")
)

POINTS = ("random time", "lock", "laying out", "laid out", "first file of a shard", "mark", "files")
VICTIMS = ("client", "worker", "client", "group", "client", "scheduler", "client", "client of workers")
"""What is killed first, by turns; later kills of a build, if any, are drawn from these."""

WORKERS = {"worker": "2", "group": "1", "client of workers": "1"}
"""Worker processes, where the victim has any."""


@dataclass(frozen=True)
class Trial:
    """What is killed, and when."""

    victim: str
    point: str
    number: float  # seconds, the number of a shard, or the number of files

    def reached(self, path: Path, began: float) -> bool:
        """True once the point is reached, as far as the disk tells."""
        shard = int(self.number)
        match self.point:
            case "random time":
                return time.monotonic() - began > self.number
            case "lock":
                return store.beside(path, "lock").exists()
            case "laying out":
                return path.with_name(f".{path.name}.new").exists()
            case "laid out":
                return (path / ".marks/layout.json").exists()
            case "first file of a shard":
                return any(path.glob(f"*/*/c.{shard}.*"))
            case "mark":
                return (path / f".marks/{shard}.json").exists()
            case _:
                return path.exists() and sum(len(names) for _, _, names in os.walk(path)) >= self.number


@dataclass(frozen=True)
class Undisturbed:
    """What a build gives that nobody disturbs."""

    path: Path
    files: dict[str, tuple[int, str]]
    marks: dict[int, Any]
    seconds: float


def run(count: int, seed: int) -> dict[str, Any]:
    """Kill `count` builds; `ok` where all came out identical and no mark was wrong at any time."""
    dice, began = random.Random(seed), time.monotonic()
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(1))  # so that the cluster ends with this process
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory(prefix="sonarsynth-kills-") as folder:
        recipe = Path(folder) / "tiny.yaml"
        recipe.write_text(RECIPE)
        whole = _undisturbed(recipe, Path(folder) / "whole.zarr")
        with Cluster(Path(folder)) as cluster:
            for number in range(count):
                place = Path(folder) / str(number)
                place.mkdir()
                victim = VICTIMS[number % len(VICTIMS)]
                rows.append(_attempt(dice, victim, recipe, place / "s.zarr", whole, cluster))
                shutil.rmtree(place, ignore_errors=True)
                said = ", ".join(map(" at ".join, zip(rows[-1]["victims"], rows[-1]["points"], strict=True)))
                print(f"{number + 1}: {said}: {rows[-1]['wrong'] or 'identical'}", file=sys.stderr, flush=True)
    wrong = [row for row in rows if row["wrong"]]
    return {
        "trials": count,
        "seed": seed,
        "identical": count - len(wrong),
        "kills": sum(row["kills"] for row in rows),
        "ended before the kill": sum(row["missed"] for row in rows),
        "victims": Counter(name for row in rows for name in row["victims"]),
        "points": Counter(name for row in rows for name in row["points"]),
        "wrong": wrong[:20],
        "seconds": round(time.monotonic() - began, 1),
        "ok": not wrong,
    }


def _undisturbed(recipe: Path, path: Path) -> Undisturbed:
    plan = planning.plan(reading.load(recipe))
    schedule.build(plan, path, frames=[0], workers=0)  # compiles
    shutil.rmtree(path)
    report = schedule.build(plan, path, workers=0)
    files = {name: record(path, name) for name in sorted(all_files(path))}
    return Undisturbed(path, files, {shard: load_mark(path, shard) for shard in marked(path)}, report.seconds)


def _attempt(
    dice: random.Random, victim: str, recipe: Path, path: Path, whole: Undisturbed, cluster: Cluster
) -> dict[str, Any]:
    """One build, killed one to three times and resumed; what was wrong with it."""
    row: dict[str, Any] = {"victims": [], "points": [], "kills": 0, "missed": 0, "wrong": []}
    for again in range(dice.choice((1, 1, 1, 2, 3))):
        trial = _draw(dice, dice.choice(VICTIMS) if again else victim, whole)
        row["victims"].append(trial.victim)
        row["points"].append(trial.point)
        killed, status = _kill(trial, recipe, path, cluster, dice)
        row["kills"] += killed
        row["missed"] += not killed
        row["wrong"] += [f"{trial}: {text}" for text in _bad_marks(path, whole)]
        if status == "hung" or (status not in ("killed", 0) and trial.victim != "scheduler"):
            row["wrong"].append(f"{trial}: the build ended with {status}: {_said(path)}")
    workers = dice.choice(("0", "0", "0", "1"))
    child = fork([*_command(recipe, path), "--workers", workers], path.with_suffix(".txt"))
    status = wait(child)
    if status != 0:
        row["wrong"].append(f"the last build ended with {status}: {_said(path)}")
    row["wrong"] += _different(path, whole)
    return row


def _said(path: Path) -> str:
    """The end of what a build printed; of one that hung, what its threads were at."""
    return path.with_suffix(".txt").read_text()[-6000:]


def _draw(dice: random.Random, victim: str, whole: Undisturbed) -> Trial:
    point, longest = dice.choice(POINTS), whole.seconds if victim == "client" else 6 * whole.seconds
    number = {"random time": dice.uniform(0.0, longest), "files": dice.randrange(1, len(whole.files))}
    return Trial(victim, point, number.get(point, dice.randrange(len(whole.marks))))


def _command(recipe: Path, path: Path) -> list[str]:
    return ["build", str(recipe), str(path)]


def _kill(trial: Trial, recipe: Path, path: Path, cluster: Cluster, dice: random.Random) -> tuple[bool, int | str]:
    """Start a build and kill its victim when the point is reached. Whether it was, and how the build ended."""
    scheduler = trial.victim == "scheduler"
    options = ["--scheduler", cluster.address()] if scheduler else ["--workers", WORKERS.get(trial.victim, "0")]
    child = fork([*_command(recipe, path), *options], path.with_suffix(".txt"))
    began = time.monotonic()
    while not trial.reached(path, began):
        if (status := ended(child)) is not None:
            return False, status
        if time.monotonic() - began > LONGEST:
            return False, end_hung(child)
        time.sleep(0.001)
    match trial.victim:
        case "worker":
            killed = kill_worker(child, dice)
            return killed, wait(child)
        case "scheduler":
            cluster.kill_scheduler()
            return True, wait(child)
        case "group":
            strike(lambda: os.killpg(child, signal.SIGKILL))
        case _:
            strike(lambda: os.kill(child, signal.SIGKILL))
    os.waitpid(child, 0)
    return True, "killed"


def _bad_marks(path: Path, whole: Undisturbed) -> list[str]:
    """Marks that say something is there that is not, or not as an undisturbed build has it."""
    wrong = []
    for shard in marked(path):
        mark = load_mark(path, shard)
        if mark != whole.marks[shard]:
            wrong.append(f"mark {shard} is another")
        elif any(_found(path, name) != kept for name, kept in mark.files.items()):
            wrong.append(f"shard {shard} is marked and not whole")
    return wrong


def _found(path: Path, name: str) -> tuple[int, str]:
    """Record of a file; of fill values alone there is none."""
    return record(path, name) if (path / name).exists() else ABSENT


def _different(path: Path, whole: Undisturbed) -> list[str]:
    """Files that are not those of the undisturbed build."""
    files = {name: record(path, name) for name in sorted(all_files(path))}
    odd = sorted(files.keys() ^ whole.files.keys()) + [n for n in files.keys() & whole.files if _other(n, path, whole)]
    marks = {shard: load_mark(path, shard) for shard in marked(path)}
    return [f"{name} differs" for name in odd[:5]] + ([] if marks == whole.marks else ["the marks differ"])


def _other(name: str, path: Path, whole: Undisturbed) -> bool:
    """True where a file differs: metadata in more than how the store was begun."""
    if record(path, name) == whole.files[name]:
        return False
    return not name.endswith("zarr.json") or _timeless(path / name) != _timeless(whole.path / name)


def _timeless(file: Path) -> Any:
    value = json.loads(file.read_text())
    value.get("attributes", {}).pop(PROVENANCE, None)
    return value
