"""One builder at a time: a lock file beside the store, released by the system when its holder ends in whatever way.

Writers on a cluster may outlive the build that sent them. So each shard is written under a second, shared lock, and
only while the build that it belongs to holds the first: the next build waits for such writers, and they then refuse.
At a URL, where nothing is locked, `lease` has the first lock, and writers look at it.
"""

from __future__ import annotations

import fcntl
import os
import socket
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from sonarsynth.store.files import lease
from sonarsynth.store.files.place import Folder, absolute, beside, read_beside
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch, open_own

WAIT: Final = 60.0
"""Seconds that a build waits for a writer of an earlier one."""


class StoreLocked(RuntimeError):
    """Another build holds the store; str() is one line."""


class BuildEnded(RuntimeError):
    """The build that a shard was to be written for has ended; str() is one line."""


@contextmanager
def lock(store: Folder | str, *, wait: float = WAIT) -> Iterator[str]:
    """Hold a store for building; gives the name of this build, which its writers must know.

    Raises StoreLocked when someone else does, or when a writer of an earlier build has not ended after `wait` seconds;
    Mismatch where a link or no plain file is in the place of the lock, OSError when the folder cannot be written,
    Unreachable where a URL cannot.
    """
    store = absolute(store)
    file = beside(store, "lock")
    if isinstance(file, Remote):
        try:
            with lease.leased(file) as name:
                yield name
        except lease.LeaseHeld as taken:
            raise StoreLocked(f"{store} is being built by {taken}") from None
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    handle = _take(file)
    try:
        name = uuid.uuid4().hex
        os.ftruncate(handle, 0)
        os.pwrite(handle, f"process {os.getpid()} on {socket.gethostname()}, build {name}\n".encode(), 0)
        _wait_for_writers(file, wait)
        yield name
    finally:
        with suppress(OSError, Mismatch):
            _drop_writers(file)
        file.unlink(missing_ok=True)
        os.close(handle)


def held_by(store: Folder | str) -> str:
    """Who builds a store now, such as "process 7 on here"; "" where nobody does."""
    file = beside(store, "lock")
    if isinstance(file, Remote):
        return lease.who(file)
    try:
        handle = open_own(file, os.O_RDONLY)
    except OSError:
        return ""
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _who(handle)
    finally:
        os.close(handle)
    return ""


@contextmanager
def shared_lock(store: Folder | str, build: str) -> Iterator[Callable[[], None]]:
    """Keep the next build waiting while a shard is written for this one. Raises BuildEnded where this one has ended.

    Gives what is to be called before the mark is written, which raises Ended where it has ended meanwhile.
    """
    store = absolute(store)

    def still() -> None:
        if _holder(store) != build:
            raise BuildEnded(f"{store}: the build that this shard is for has ended")

    file = beside(store, "writers")
    if isinstance(file, Remote):
        still()
        yield still
        return
    handle = _take(file, fcntl.LOCK_SH)
    try:
        still()
        yield still
    finally:
        os.close(handle)


def _holder(store: Folder) -> str:
    """The build that the lock file names."""
    file = beside(store, "lock")
    if isinstance(file, Remote):
        return lease.holder(file)
    try:
        return read_beside(file).decode(errors="replace").rpartition(" ")[2].strip()
    except OSError:
        return ""


def _wait_for_writers(lock_file: Path, wait: float) -> None:
    file, until = lock_file.with_suffix(".writers"), time.monotonic() + wait
    while file.exists():
        try:
            handle = _take(file)
        except StoreLocked:
            if time.monotonic() > until:
                raise StoreLocked(
                    f"{lock_file.with_suffix('')}: a worker of an earlier build is still writing: end it first"
                ) from None
            time.sleep(0.05)
        else:
            os.close(handle)
            return


def _drop_writers(lock_file: Path) -> None:
    """Remove the file of the writers, if none is left."""
    file = lock_file.with_suffix(".writers")
    if file.exists():
        with suppress(StoreLocked):
            handle = _take(file)
            file.unlink(missing_ok=True)
            os.close(handle)


def _take(file: Path, operation: int = fcntl.LOCK_EX | fcntl.LOCK_NB) -> int:
    """Open and lock the file that is there now: one that its last holder removed meanwhile is not it."""
    while True:
        handle = open_own(file, os.O_RDWR | os.O_CREAT)
        try:
            fcntl.flock(handle, operation)
        except BlockingIOError:
            holder = _who(handle)
            os.close(handle)
            raise StoreLocked(f"{file.with_suffix('')} is being built by {holder}") from None
        except BaseException:
            os.close(handle)
            raise
        try:
            if os.path.samestat(os.fstat(handle), os.stat(file)):
                return handle
        except FileNotFoundError:
            pass
        os.close(handle)


def _who(handle: int) -> str:
    """The process that a lock file names."""
    return os.read(handle, 200).decode(errors="replace").partition(",")[0].strip() or "another process"
