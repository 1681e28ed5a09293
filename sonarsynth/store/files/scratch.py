"""What a build makes beside a store for a while and removes again, and how it knows its own.

A folder of ours holds a file that says so, from before anything is put into it until everything else is gone: a process
that is killed leaves an empty folder or one with that file. Whatever else has its name is somebody's, and stays.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import Damage

MARKER: Final = ".made-by-sonarsynth"
"""The file that a folder of ours holds."""

PARTIAL: Final = re.compile(r"\..+\.[0-9a-f]{32}\.partial")
"""Names of files that are being written, as `within.write_atomically` gives them."""

BESIDE: Final = ("card.md", "croissant.json", "failed.jsonl")
"""Files beside a store that are written so."""


ATTEMPTS: Final = 10
"""Attempts to empty a folder that somebody still writes into."""


def make(folder: Path) -> None:
    """Make a folder of ours, in the place of one that a killed process left. Raises Mismatch for what is not ours."""
    clear(folder)
    folder.mkdir()
    _mark(folder)


def clear(folder: Path) -> None:
    """Remove a folder of ours, if it is there. Raises Mismatch for what is not ours."""
    if not os.path.lexists(folder):
        return
    names = [] if folder.is_symlink() or not folder.is_dir() else os.listdir(folder)
    if folder.is_symlink() or not folder.is_dir() or (names and MARKER not in names):
        raise Mismatch(f"{folder}: is in the way, and no build made it: move it away")
    for _ in range(ATTEMPTS):
        for name in names:
            if name != MARKER:
                _remove(folder / name)
        (folder / MARKER).unlink(missing_ok=True)
        try:
            folder.rmdir()
        except OSError:  # a worker that is still about has written there meanwhile
            _mark(folder)
            names = os.listdir(folder)
        else:
            return


def _remove(file: Path) -> None:
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file)
    else:
        file.unlink(missing_ok=True)


def _mark(folder: Path) -> None:
    (folder / MARKER).write_text("A folder that sonarsynth works in and removes.\n")


def hidden(path: Path) -> Path:
    """The folder beside a store for what is not yet, or no more, in it."""
    return path.with_name(f".{path.name}.new")


@contextmanager
def made(path: Path) -> Iterator[Path]:
    """That folder, while it is needed."""
    folder = hidden(path)
    make(folder)
    try:
        yield folder
    finally:
        clear(folder)


def sweep(path: Path, *, links: bool = False) -> None:
    """Remove files that a killed process had not finished, in a store and beside it. Raises Damage for a link in it,
    unless `links` may be there."""
    waiting = [str(path)]
    while waiting:
        with os.scandir(waiting.pop()) as entries:
            for entry in entries:
                if entry.is_symlink() and not links:
                    inside = os.path.relpath(entry.path, path)
                    raise Damage(f"{path}: {inside} is a link, which no store has: 'sonarsynth repair' moves it out")
                if entry.is_dir(follow_symlinks=False):
                    waiting.append(entry.path)
                elif PARTIAL.fullmatch(entry.name) and not entry.is_symlink():
                    os.unlink(entry.path)
    starts = tuple(f".{path.name}.{suffix}." for suffix in BESIDE)
    for name in os.listdir(path.parent):
        if name.startswith(starts) and PARTIAL.fullmatch(name):
            (path.parent / name).unlink(missing_ok=True)
