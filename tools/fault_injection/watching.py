"""Sees what is opened or changed in a folder, whoever does it: by inotify, which misses nothing and slows nothing."""

from __future__ import annotations

import ctypes
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

ACCESS, MODIFY, ATTRIB, WRITTEN, MOVED, CREATE, DELETE, GONE = 0x1, 0x2, 0x4, 0x8, 0xC0, 0x100, 0x200, 0x400
FOLDER = 0x40000000
EVERYTHING = ACCESS | MODIFY | ATTRIB | WRITTEN | MOVED | CREATE | DELETE | GONE


@contextmanager
def watched(folder: Path) -> Iterator[list[str]]:
    """Gives a list that holds, once this is left, the names of what was read, written, made or removed beneath."""
    libc, seen = ctypes.CDLL(None, use_errno=True), list[str]()
    handle = libc.inotify_init1(os.O_NONBLOCK | os.O_CLOEXEC)
    if handle < 0:
        raise OSError(ctypes.get_errno(), "no inotify")
    try:
        for place in (folder, *(inner for inner in folder.rglob("*") if inner.is_dir() and not inner.is_symlink())):
            if libc.inotify_add_watch(handle, os.fsencode(place), EVERYTHING) < 0:
                raise OSError(ctypes.get_errno(), "cannot be watched", str(place))
        yield seen
        seen += _events(handle)
    finally:
        os.close(handle)


def _events(handle: int) -> list[str]:
    found = []
    while True:
        try:
            data = os.read(handle, 1 << 16)
        except BlockingIOError:
            return found
        while data:
            _, mask, _, length = struct.unpack_from("iIII", data)
            name = data[16 : 16 + length].rstrip(b"\0").decode(errors="replace")
            if mask != ACCESS | FOLDER:  # a folder that was listed: we may have done that
                found.append(f"{name or '.'} ({mask:#x})")
            data = data[16 + length :]
