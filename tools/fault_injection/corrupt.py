"""Random damages of a small store, one at a time: each must be found, and repaired to the byte."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth import store
from sonarsynth.planning import plan
from sonarsynth.recipe import reading
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair

RECIPE = """\
title: small
seed: 3
scene:
  world:
    environment: {depth: 12 m, sound_speed: {kind: isovelocity, speed: 1540}, noise: {kind: flat, level: 40 dB}}
    targets:
      - name: box
        shape: {kind: box, size: [1, 1, 1], edge: 0.5}
        motion: {kind: line, start: [10, 0, -5], stop: [10, 1, -5], duration: 1}
    sources:
      - position: [12, 8]
        kind: snapping_shrimp
  sonar:
    array: {kind: planar_lattice, columns: 4, rows: 3, pitch: 5 cm}
    beams: {azimuths: 5, elevations: 3, azimuth_span: 30 deg, elevation_span: 30 deg}
  trajectory: {frames: 20, interval: 0.1}
"""
FRAMES = range(18)
"""What is built of it: the last shard is short, and not all of it is there."""

KINDS = ("flip", "truncate", "empty", "delete", "add", "append", "exchange")


def kind_of(name: str) -> str:
    """What a file of a store is for."""
    parts = name.split("/")
    if parts[0] == ".marks":
        return "mark of the layout" if parts[1].startswith("layout") else "mark of a shard"
    if name == "zarr.json":
        return "metadata of the root"
    if parts[-1] == "zarr.json":
        return "metadata"
    return "shard"


def contents(path: Path) -> dict[str, bytes]:
    """Every file of a store."""
    return {f.relative_to(path).as_posix(): f.read_bytes() for f in sorted(path.rglob("*")) if f.is_file()}


def file_kinds(path: Path) -> dict[str, list[str]]:
    """Files of a store by what they are for."""
    layout = store.marks.load_layout(path)
    assert layout is not None
    kinds: dict[str, list[str]] = {}
    for name in contents(path):
        kind = kind_of(name)
        kinds.setdefault("fixed array" if kind == "shard" and name in layout.files else kind, []).append(name)
    return kinds


def damage(path: Path, name: str, how: str, random: np.random.Generator) -> None:
    """Damage one file, or add one beside it."""
    file = path / name
    content = bytearray(file.read_bytes())
    if how == "flip":
        bit = int(random.integers(8 * len(content)))
        content[bit // 8] ^= 1 << bit % 8
        file.write_bytes(content)
    elif how == "truncate":
        os.truncate(file, int(random.integers(len(content))))
    elif how == "empty":
        os.truncate(file, 0)
    elif how == "delete":
        file.unlink()
    elif how == "add":
        place = file.parent if random.random() < 0.5 else file.parent / f"{int(random.integers(30))}"
        place = file.parent if place.is_file() else place
        place.mkdir(exist_ok=True)
        added = place / f"{int(random.integers(10**6))}{random.choice(['', '.json', '.partial'])}"
        added.write_bytes(content if random.random() < 0.5 else random.bytes(100))
    elif how == "append":
        file.write_bytes(bytes(content) + (b"\n", b"\0", b" ")[int(random.integers(3))])
    elif how == "exchange":
        others = [p for p in path.rglob("*") if p.is_file() and p.read_bytes() != content]
        shutil.copyfile(others[int(random.integers(len(others)))], file)
    else:
        raise ValueError(f"no such damage: {how}")


def _mended(path: Path) -> tuple[bool, str]:
    """Whether a repair says that the store is what it was, and what it says where not."""
    try:
        report = repair(path, workers=0, quick=True)
    except Exception as error:  # whatever it is, this damage was not repaired, and the next is tried
        return False, f"{type(error).__name__}: {error}"
    return report.ok, "; ".join(f"{p.where}: {p.what}" for p in report.problems)


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Damage a store `count` times, verify it and repair it each time. Returns what came of it."""
    random = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory(dir=folder, prefix="faults-") as there:
        path = Path(there) / "small.zarr"
        build(plan(reading.loads(RECIPE)), path, frames=FRAMES, workers=0)
        whole, kinds = contents(path), file_kinds(path)
        missed, unlike, seconds = [], [], {"verify": 0.0, "repair": 0.0}
        tried: Counter[str] = Counter()
        for _ in range(count):
            kind = sorted(kinds)[int(random.integers(len(kinds)))]
            name = kinds[kind][int(random.integers(len(kinds[kind])))]
            how = str(random.choice(KINDS))
            damage(path, name, how, random)
            tried[f"{how}, {kind}"] += 1
            began = time.process_time()
            found = not store.verify(path, quick=True).ok
            middle = time.process_time()
            mended, why = _mended(path)
            seconds["verify"] += middle - began
            seconds["repair"] += time.process_time() - middle
            now = contents(path)
            if not found:
                missed.append(f"{how} {name}")
            if not mended or now != whole:
                differing = sorted(n for n in now.keys() | whole.keys() if now.get(n) != whole.get(n))
                unlike.append(f"{how} {name}: {why} {differing[:5]}")
                _put_back(path, whole)
            shutil.rmtree(store.beside(path, "foreign"), ignore_errors=True)
    return {
        "ok": not missed and not unlike,
        "damages": count,
        "seed": seed,
        "found": count - len(missed),
        "repaired_to_identical": count - len(unlike),
        "missed": missed,
        "not_identical": unlike,
        "files": len(whole),
        "cpu_seconds_each": {name: s / count for name, s in seconds.items()},
        "tried": dict(sorted(tried.items())),
    }


def _put_back(path: Path, whole: dict[str, bytes]) -> None:
    shutil.rmtree(path)
    for name, content in whole.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)
