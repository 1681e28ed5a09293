"""Stores that somebody forged, every digest as it must be: refused or mended in one line, nothing outside touched."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from sonarsynth import store
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair
from sonarsynth.store import cards
from sonarsynth.store.files.place import record
from sonarsynth.store.marks import Mark, load_layout, load_mark, save_mark

from .ground import FRAMES, Ground, on_ground

VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1 << 70, 1e308, "", "x\n# y", "<script>", "javascript:x", [], [[]], [None], {}, {"x": []},
    {"kind": "mesh_file", "path": "/etc/passwd"}, "../../outside/secret.stl", "/etc/passwd", ["x"] * 1000,
)  # fmt: skip


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Forge `count` stores, and run every command on each."""
    return on_ground(_trial, count, seed, folder)


def _trial(ground: Ground, number: int) -> None:
    forge = (_attribute, _attribute, _metadata, _mark, _recipe, _sizes)[number % 6]
    what = forge(ground)
    path = ground.path
    with ground.untouched(what):
        ground.attempt(what, lambda: store.verify(path, quick=bool(ground.random.random() < 0.5)))
        ground.attempt(what, lambda: cards.write(path))
        if ground.random.random() < 0.5:
            ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0))
        ground.attempt(what, lambda: repair(path, workers=0, quick=True))
        ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0))
    strange = {file.name for file in path.parent.iterdir() if not file.name.startswith("s.zarr")}
    if strange:
        ground.wrong.append(f"{what}: made {strange}")


def _sealed(path: Path, root: dict[str, Any]) -> None:
    """Write the metadata of the root, and the mark of the layout so that it agrees."""
    layout = load_layout(path)
    assert layout is not None
    (path / "zarr.json").write_text(json.dumps(root))
    files = {**layout.files, "zarr.json": record(path, "zarr.json")}
    save_mark(path, Mark("layout", (), "", files, root["attributes"]))


def _put(ground: Ground, value: Any) -> str:
    """Another value somewhere in plain values; where that is."""
    where, random = "", ground.random
    while True:
        keys = list(value) if isinstance(value, dict) else range(len(value))
        key = keys[int(random.integers(len(keys)))]
        where += f".{key}"
        if isinstance(value[key], dict | list) and value[key] and random.random() < 0.6:
            value = value[key]
            continue
        value[key] = VALUES[int(random.integers(len(VALUES)))]
        return where[:80]


def _attribute(ground: Ground) -> str:
    root = json.loads((ground.path / "zarr.json").read_text())
    where = _put(ground, root["attributes"])
    _sealed(ground.path, root)
    return f"attribute: {where}"


def _metadata(ground: Ground) -> str:
    root = json.loads((ground.path / "zarr.json").read_text())
    where = _put(ground, root["consolidated_metadata"])
    _sealed(ground.path, root)
    return f"metadata: {where}"


def _mark(ground: Ground) -> str:
    """A mark that names what is not the store's, or has other frames."""
    path, random = ground.path, ground.random
    number = int(random.integers(2))
    old = load_mark(path, number)
    assert old is not None
    up = "../" * int(random.integers(1, 6))
    name = str(random.choice([f"{up}outside/secret.stl", str(ground.outside / "secret.stl"), "image//x", "image/./x"]))
    files, frames = dict(old.files), list(old.frames)
    if random.random() < 0.7:
        files[name] = (18, "0" * 64)
    else:
        frames = [[-1], [10**12], [*frames, 10**6], [True], list(range(10**5))][int(random.integers(5))]
    attributes = {"versions": VALUES[int(random.integers(len(VALUES)))]} if random.random() < 0.3 else {}
    save_mark(path, Mark(old.name, tuple(frames), old.content, files, attributes))
    return f"mark: {name} {frames[:3]}"


def _recipe(ground: Ground) -> str:
    """A recipe that names a file of ours; and damage, so that a repair needs it."""
    path = ground.path
    root = json.loads((path / "zarr.json").read_text())
    text = str(root["attributes"]["recipe"])
    file = ground.outside / "secret.stl"
    name = str(
        ground.random.choice([str(file), os.path.relpath(file), "/etc/passwd", f"{ground.outside}/./secret.stl"])
    )
    line = next(line for line in text.splitlines() if "kind: box" in line)
    shape = line[: line.index("shape:")] if "shape:" in line else line[: len(line) - len(line.lstrip())]
    forged = f"{shape}{'shape: ' if 'shape:' in line else ''}{{kind: mesh_file, path: {name}}}"
    root["attributes"]["recipe"] = text.replace(line, forged)
    _sealed(path, root)
    (path / "image/energy/c.0.0.0").unlink(missing_ok=True)
    return f"recipe: {name}"


def _sizes(ground: Ground) -> str:
    """A file that says that it is larger than memory."""
    path, random = ground.path, ground.random
    files = sorted(path.rglob("*.json"))
    file = files[int(random.integers(len(files)))]
    os.truncate(file, int(random.choice([1 << 29, 1 << 40])))
    return f"sizes: {file.relative_to(path)}"
