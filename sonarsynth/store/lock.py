"""One builder at a time: a lock file beside the store, released by the system when its holder ends in whatever way."""

from __future__ import annotations

import errno
import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class Locked(RuntimeError):
    """Another build holds the store; str() is one line."""


def beside(store: Path | str, suffix: str) -> Path:
    """A file beside a store: `remus.zarr` -> `remus.zarr.lock`."""
    store = Path(os.path.abspath(store))
    if not store.name:
        raise OSError(errno.EISDIR, "is no place for a store", str(store))
    return store.with_name(f"{store.name}.{suffix}")


@contextmanager
def lock(store: Path | str) -> Iterator[None]:
    """Hold a store for building. Raises Locked when someone else does, OSError when the folder cannot be written."""
    file = beside(store, "lock")
    file.parent.mkdir(parents=True, exist_ok=True)
    handle = _take(file)
    try:
        os.ftruncate(handle, 0)
        os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield
    finally:
        file.unlink(missing_ok=True)
        os.close(handle)


def _take(file: Path) -> int:
    """Open and lock the file that is there now: one that its last holder removed meanwhile is not it."""
    while True:
        handle = os.open(file, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.read(handle, 200).decode(errors="replace").strip() or "another process"
            os.close(handle)
            raise Locked(f"{file.with_suffix('')} is being built by {holder}") from None
        except BaseException:
            os.close(handle)
            raise
        try:
            if os.path.samestat(os.fstat(handle), os.stat(file)):
                return handle
        except FileNotFoundError:
            pass
        os.close(handle)
