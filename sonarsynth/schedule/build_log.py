"""The log of a build: JSON lines beside the store, one an event, each with the time (UTC)."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from sonarsynth.store.files.place import Folder, read_beside, write_atomically
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import open_own

PROGRESS_EVERY: Final = 10.0
"""Seconds between two events `progress`."""


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


class Log:
    """Events of a build, added to a file."""

    def __init__(self, file: Path) -> None:
        self.file, self.began = file, time.monotonic()
        self.said = self.began

    def event(self, event: str, **facts: Any) -> None:
        """Add an event."""
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        append_lines(self.file, [{"time": now, "event": event, **facts}])

    def progress(self, done: int, total: int, failed: int) -> None:
        """Say how far it is, now and then."""
        now = time.monotonic()
        if now - self.said >= PROGRESS_EVERY:
            self.said = now
            rate = (done + failed) / (now - self.began)
            eta = (total - done - failed) / rate if rate else None
            self.event("progress", done=done, of=total, failed=failed, frames_per_second=rate, seconds_left=eta)
