"""Links in a store, beside it and to it: none is followed but what the store is named by, and nothing is lost."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import Any

from sonarsynth import store
from sonarsynth.schedule import build
from sonarsynth.schedule.repairing import repair

from .ground import FRAMES, Ground, on_ground

BESIDE = (
    "lock",
    "log.jsonl",
    "times.jsonl",
    "failed.jsonl",
    "card.md",
    "croissant.json",
    "foreign",
    "doing",
)
KINDS = ("inside", "inside", "beside", "to the store")


def run(count: int, seed: int, folder: Path | None = None) -> dict[str, Any]:
    """Put `count` links where they could do harm, and run every command on the store."""
    return on_ground(_trial, count, seed, folder)


def _trial(ground: Ground, number: int) -> None:
    kind = KINDS[number % len(KINDS)]
    {"inside": _inside, "beside": _beside, "to the store": _to_it}[kind](ground)


def _inside(ground: Ground) -> None:
    """A file or folder of the store is a link: to what it was, which is elsewhere now, or to something else."""
    path, outside, random = ground.path, ground.outside, ground.random
    places = sorted(file.relative_to(path) for file in path.rglob("*"))
    place = path / places[int(random.integers(len(places)))]
    to = str(random.choice(["what it was", "a file", "a folder", "nothing", "itself"]))
    if to == "what it was":
        shutil.move(place, outside / "moved")
    elif place.is_dir():
        shutil.rmtree(place)
    else:
        place.unlink()
    targets = {"what it was": "moved", "a file": "secret.stl", "a folder": ".", "nothing": "none"}
    target = place if to == "itself" else outside / targets[to]
    place.symlink_to(os.path.relpath(target, place.parent) if random.random() < 0.5 else target)
    what = f"inside, {to}: {place.relative_to(path)}"
    with ground.untouched(what):
        ground.attempt(what, lambda: store.verify(path, quick=bool(random.random() < 0.5)))
        if not ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0)):
            ground.wrong.append(f"{what}: a build went on")
        if line := ground.attempt(what, lambda: repair(path, workers=0)):
            ground.wrong.append(f"{what}: not repaired: {line}")
    ground.compare(what, path)


def _beside(ground: Ground) -> None:
    """A link, or a second name of a file, has the name of a file that belongs to the store."""
    path, random = ground.path, ground.random
    suffix = str(random.choice(BESIDE))
    file, hard = store.beside(path, suffix), bool(random.random() < 0.3 and suffix not in ("foreign", "doing"))
    what = f"beside, {suffix}{' (hard)' if hard else ''}: "
    assert isinstance(file, Path)
    if hard:
        file.hardlink_to(ground.outside / "secret.stl")
    else:
        file.symlink_to(ground.outside if suffix in ("foreign", "doing") else ground.outside / "secret.stl")
    (path / ".marks/1.json").unlink()
    (path / "image/notes.txt").write_text("mine")
    before = (ground.outside / "secret.stl").read_bytes()
    with ground.untouched(what):
        ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0))
        ground.attempt(what, lambda: repair(path, workers=0))
    if (ground.outside / "secret.stl").read_bytes() != before:
        ground.wrong.append(f"{what}: written")
    if file.is_symlink() or not file.is_dir():
        file.unlink(missing_ok=True)
    ground.attempt(what, lambda: repair(path, workers=0))
    if line := ground.attempt(what, lambda: build(ground.plan, path, frames=FRAMES, workers=0)):
        ground.wrong.append(f"{what}: {line}")
    ground.compare(what, path)


def _to_it(ground: Ground) -> None:
    """The store is named by a link, or by a link to a link; it is built, begun anew or repaired."""
    path, random = ground.path, ground.random
    first, second = ground.folder / "here/first.zarr", ground.folder / "here/second.zarr"
    first.symlink_to("s.zarr" if random.random() < 0.5 else path)
    second.symlink_to(first)
    link = first if random.random() < 0.5 else second
    how = str(random.choice(["go on", "restart", "repair", "lock"]))
    what = f"to the store, {how}: {link.name}"
    (path / "image/energy/c.0.0.0").unlink()
    with ground.untouched(what):
        if how == "lock":
            with store.lock(link if random.random() < 0.5 else path):
                line = ground.attempt(what, lambda: build(ground.plan, second, frames=FRAMES, workers=0))
            if "is being built" not in line:
                ground.wrong.append(f"{what}: two builds at once: {line}")
        if how == "restart":
            line = ground.attempt(what, lambda: build(ground.plan, link, frames=FRAMES, workers=0, restart=True))
        else:
            line = ground.attempt(what, lambda: repair(link, workers=0))
    if line and how != "lock":
        ground.wrong.append(f"{what}: {line}")
    if not (first.is_symlink() and second.is_symlink()) or path.is_symlink():
        ground.wrong.append(f"{what}: the links have changed")
    if how != "restart":
        ground.compare(what, path)
    elif not store.verify(path, quick=True).ok or store.frames_there(path) != list(FRAMES):
        ground.wrong.append(f"{what}: not whole")
