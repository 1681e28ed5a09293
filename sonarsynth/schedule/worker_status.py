"""What a worker is doing, so that its end can be explained: a small file a worker, in a folder beside the store.

A worker notes the frame and the stage before it begins. The interpreter's fault handler, which needs no lock of the
interpreter, adds the traceback when the stage crashes the process, or ends the process when the stage takes too long.
What it finds there, the client reports as failed. Only workers of one thread that a nanny starts again keep a diary.
"""

from __future__ import annotations

import faulthandler
import json
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sonarsynth.store import here
from sonarsynth.store.files import scratch

LONGEST: Final = 20_000
"""Characters of a traceback that are kept."""

HEAD: Final = 200
"""Bytes of the line that says what a worker does."""

LATER, LATEST = 1.1, 1.2
"""Of the limit of a stage: when it is ended where the thread is new, and at the latest where that was there before."""


@dataclass(frozen=True)
class Entry:
    """What a worker was doing when it ended."""

    frame: int
    stage: str
    error: str  # one line; "" where nothing says why
    traceback: str


def open_folder(store: str) -> None:
    """Make the folder for the workers of a build, empty. Raises Mismatch where something that is not ours is there."""
    scratch.make(here(store, "doing"))


def close_folder(store: str) -> None:
    """Remove the folder. Raises Mismatch where something that is not ours is in its place."""
    with suppress(OSError):  # a worker that is still about may write there
        scratch.clear(here(store, "doing"))


def read(store: str, worker: str) -> Entry | None:
    """What the worker at an address was doing, None where it was doing nothing that it noted."""
    try:
        text = _file(store, worker).read_text("utf-8", errors="replace")
        head, _, trace = text.partition("\n")
        noted = json.loads(head)
        return Entry(int(noted["frame"]), str(noted["stage"]), _reason(trace, noted["limit"]), trace[:LONGEST])
    except (OSError, ValueError, KeyError, TypeError):
        return None


Note = Callable[[int, str, float, float], None]
"""Notes the frame and the stage that begin, or go on, after how many seconds (0: none) this process ends, and how many
the stage has taken before."""


@contextmanager
def diary(store: str) -> Iterator[Note]:
    """Give a `Note` for the stages of a task. A thread waits for a limit to end, one for as many stages as may be: a
    stage is ended between its limit and `LATEST` times that."""
    out, ends = _mine(store), 0.0
    if out is None:
        yield lambda frame, stage, limit, spent: None
        return

    def note(frame: int, stage: str, limit: float, spent: float) -> None:
        nonlocal ends
        _write(out, json.dumps({"frame": frame, "stage": stage, "limit": limit + spent}))
        now = time.monotonic()
        if limit > 0 and not limit <= ends - now <= LATEST * limit:
            ends = now + LATER * limit
            faulthandler.dump_traceback_later(LATER * limit, exit=True, file=out)

    try:
        yield note
    finally:
        faulthandler.cancel_dump_traceback_later()
        _write(out, "")


def _write(file: int, line: str) -> None:
    """Put a line in place of the one before, in one call: tracebacks are behind it."""
    with suppress(OSError):  # a full disk
        os.pwrite(file, line.ljust(HEAD - 1).encode() + b"\n", 0)


_open: dict[Path, int] = {}


def _mine(store: str) -> int | None:
    """The open diary of this process, None where it is not a worker that is started again."""
    distributed = sys.modules.get("distributed")
    if distributed is None:
        return None
    try:
        worker = distributed.get_worker()
    except ValueError:
        return None
    if not worker.nanny or worker.state.nthreads > 1:  # a traceback is of a process, and frames would mix in it
        return None
    file = _file(store, worker.address)
    if file not in _open:
        for old in _open.values():
            os.close(old)
        _open.clear()
        try:
            _open[file] = os.open(file, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o666)
        except OSError:  # the build has ended
            return None
        os.lseek(_open[file], HEAD, os.SEEK_SET)
        faulthandler.enable(_open[file])
    return _open[file]


def _file(store: str, worker: str) -> Path:
    return here(store, "doing") / re.sub(r"[^\w.]+", "-", worker)


def _reason(text: str, limit: float) -> str:
    first = text.partition("\n")[0].strip()
    if first.startswith("Timeout"):
        return f"it took longer than {limit:g} s"
    return f"it crashed its worker process: {first}" if first.startswith("Fatal Python error") else ""
