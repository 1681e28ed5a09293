"""Stores that are moved, removed or exchanged while they are built: nothing is made in their place, nothing is lost."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from unittest.mock import patch

from sonarsynth import store
from sonarsynth.planning import plan
from sonarsynth.schedule import build
from sonarsynth.store import writing

from .corrupt import contents
from .ground import FRAMES, Ground, on_ground

HOW = ("renamed", "a link", "a file", "the folder above", "exchanged")


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Move a store `count` times in the middle of its build; it goes on where it is then."""
    return on_ground(_trial, count, seed, folder)


def _trial(ground: Ground, number: int) -> None:
    how, files = HOW[number % len(HOW)], sum("/c." in name for name in ground.whole) // 2  # not those of fixed arrays
    at, path = int(ground.random.integers(files)), ground.path
    what = f"{how}: at file {at}"
    moved = path.with_name("moved.zarr") if how != "the folder above" else ground.folder / "away/s.zarr"
    shutil.rmtree(path)
    other = plan(ground.plan.recipe, frozenset())
    if how == "exchanged":
        store.create(path.with_name("other.zarr"), other)
        before = contents(path.with_name("other.zarr"))
    count = 0

    def counted(of: Any, files_of_shard: Mapping[str, bytes]) -> None:
        nonlocal count
        for name, content in files_of_shard.items():
            count += 1
            if count == at + 1:
                _move(ground, how, moved)
            write_each(of, {name: content})

    write_each = writing.write_each
    with ground.untouched(what):
        with patch.object(writing, "write_each", counted):
            line = ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0))
        if not line:
            ground.wrong.append(f"{what}: the build ended well")
    if how in ("renamed", "the folder above") and path.exists():
        ground.wrong.append(f"{what}: made again under the old name")
    if how == "exchanged" and contents(path) != before:
        ground.wrong.append(f"{what}: the other store has changed")
    _go_on(ground, what, moved)
    shutil.rmtree(moved.parent if how == "the folder above" else moved)


def _go_on(ground: Ground, what: str, moved: Path) -> None:
    """Build on where the store is now, and compare."""
    if line := ground.attempt(what, lambda: build(ground.plan, moved, frames=FRAMES, workers=0)):
        ground.wrong.append(f"{what}: does not go on: {line}")
    now = {name: text for name, text in contents(moved).items() if name != "zarr.json" and "layout" not in name}
    if (
        now != {name: text for name, text in ground.whole.items() if name in now}
        or not store.verify(moved, quick=True).ok
    ):
        ground.wrong.append(f"{what}: not the same under its new name")


def _move(ground: Ground, how: str, moved: Path) -> None:
    path = ground.path
    if how == "the folder above":
        path.parent.rename(moved.parent)
        return
    path.rename(moved)
    if how == "exchanged":
        path.with_name("other.zarr").rename(path)
    elif how == "a link":
        path.symlink_to(ground.outside)
    elif how == "a file":
        path.write_text("mine")
