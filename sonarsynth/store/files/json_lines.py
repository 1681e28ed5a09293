"""Lists beside a store that grow: files of JSON lines, a row each."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from sonarsynth.store.files.place import Folder, read_beside, write_atomically
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import open_own


def append_lines(file: Folder, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add rows to a file of JSON lines, all of them with one write."""
    if not rows:
        return
    if isinstance(file, Remote):
        write_lines(file, [*read_lines(file), *rows])
        return
    with os.fdopen(open_own(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND), "ab", buffering=0) as out:
        out.write("".join(json.dumps(row) + "\n" for row in rows).encode())


def write_lines(file: Folder, rows: Sequence[Mapping[str, Any]]) -> None:
    """Put rows in the place of a file of JSON lines; without rows there is none."""
    if rows:
        write_atomically(file, "".join(json.dumps(row) + "\n" for row in rows).encode())
    else:
        file.unlink(missing_ok=True)


def read_lines(file: Folder) -> list[dict[str, Any]]:
    """Rows of a file of JSON lines, [] where there is none; a line cut off by a crash is left out."""
    try:
        lines = read_beside(file).decode("utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return []
    rows = []
    for line in lines:
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if isinstance(row, dict):
            rows.append(row)
    return rows
