"""One builder at a time: a claim beside the store, which names its holder, and which that renews while it lives.

No one gives back the claim of a process that was killed. So it is taken over when its holder was a process of this
machine that is gone, or one elsewhere that has not renewed it for `LEASE` seconds.

Writers on a cluster may outlive the build that sent them. So who writes a shard looks before it, and again before its
mark, whether the claim still names its build; on a disk it also shares the claim's file, and the next build, which must
have that alone, waits for it. (At a URL nothing is locked: two builds of one recipe that write at the same time write
the same objects.)
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any, Final

from sonarsynth.store.files.place import Folder, absolute, beside
from sonarsynth.store.files.remote import Remote, Unreachable
from sonarsynth.store.files.within import Mismatch, open_own

WAIT: Final = 60.0
"""Seconds that a build waits for a writer of an earlier one."""
ENDING: Final = 5.0
"""Seconds that a build which ends waits for its own writers, so that no empty file is left of its claim."""
RENEWED: Final = 10.0
"""Seconds between two renewals of a claim."""
LEASE: Final = 60.0
"""Seconds without a renewal after which a claim from elsewhere is nobody's."""


class StoreLocked(RuntimeError):
    """Another build holds the store; str() is one line."""


class BuildEnded(RuntimeError):
    """The build that a shard was to be written for has ended; str() is one line."""


@contextmanager
def lock(store: Folder | str, *, wait: float = WAIT, lease: float = LEASE, renewed: float = RENEWED) -> Iterator[str]:
    """Hold a store for building; gives the name of this build, which its writers must know.

    Raises StoreLocked when someone else does, or when a writer of an earlier build has not ended after `wait` seconds;
    Mismatch where a link or no plain file is in the place of the claim, OSError when the folder cannot be written,
    Unreachable where a URL cannot.
    """
    store = absolute(store)
    file, name = beside(store, "lock"), uuid.uuid4().hex
    if isinstance(file, Path):
        file.parent.mkdir(parents=True, exist_ok=True)
    _take(store, file, name, wait, lease)
    ended = threading.Event()
    keeper = threading.Thread(target=_keep, args=(file, name, renewed, ended), daemon=True)
    keeper.start()
    try:
        yield name
    finally:
        ended.set()
        keeper.join(timeout=renewed)
        with suppress(Unreachable, OSError, Mismatch):
            if holder(store) == name:
                _give_back(store, file)


def holder(store: Folder) -> str:
    """The build that the claim of a store names, "" where there is none."""
    return str(_claim(_read(beside(store, "lock"))[0]).get("build", ""))


def held_by(store: Folder | str) -> str:
    """Who builds a store now, such as "process 7 on here"; "" where nobody does, or nobody has renewed the claim."""
    file = beside(store, "lock")
    try:
        content, renewed = _read(file)
    except OSError:
        return ""
    claim = _claim(content)
    if not claim or _gone(claim):
        return ""
    age = file.age() if isinstance(file, Remote) else time.time() - 1e-9 * renewed
    return _named(claim) if _here(claim) or age <= LEASE else ""


@contextmanager
def shared_lock(store: Folder | str, build: str) -> Iterator[Callable[[], None]]:
    """Keep the next build waiting while a shard is written for this one. Raises BuildEnded where this one has ended.

    Gives what is to be called before the mark is written, which raises BuildEnded where it has ended meanwhile.
    """
    store = absolute(store)
    file = beside(store, "lock")

    def still() -> None:
        if holder(store) != build:
            raise BuildEnded(f"{store}: the build that this shard is for has ended")

    still()
    try:
        with nullcontext() if isinstance(file, Remote) else _locked(store, file, fcntl.LOCK_SH):
            still()
            yield still
    finally:
        if isinstance(file, Path) and _read(file)[0] == b"":
            _remove(store, file)


def _take(store: Folder, file: Folder, name: str, wait: float, lease: float) -> None:
    """Put a claim in the place of none, or of one that is nobody's any more."""
    first, until = None, 0.0
    while True:
        now = _read(file)
        claim = _claim(now[0])
        if claim and not _gone(claim):
            if _here(claim) or (first is not None and now != first):
                raise StoreLocked(f"{store} is being built by {_named(claim)}")
            if first is None:
                first, until = now, time.monotonic() + lease
            if time.monotonic() < until:
                time.sleep(min(1.0, lease / 10))
                continue
        if _replaced(store, file, now[0], _content(name, 0), wait):
            return


def _replaced(store: Folder, file: Folder, stale: bytes | None, content: bytes, wait: float) -> bool:
    """Write a claim over a stale one, or none; False where another is there by now."""
    if isinstance(file, Remote):
        if stale is not None:
            file.unlink(missing_ok=True)
        if file.write_if_absent(content) and _read(file)[0] != content:
            raise StoreLocked(f"{store} is being built by another process")  # two took over at once
        return _read(file)[0] == content
    with _locked(store, file, fcntl.LOCK_EX, wait) as handle:
        there = stale or b""
        if os.pread(handle, len(there) + 1, 0) != there:
            return False
        os.ftruncate(handle, 0)
        os.pwrite(handle, content, 0)
    return True


def _give_back(store: Folder, file: Folder) -> None:
    """Remove a claim; where a writer still shares its file after `ENDING`, leave that without one."""
    if isinstance(file, Remote):
        file.unlink(missing_ok=True)
        return
    os.truncate(file, 0)
    _remove(store, file, ENDING)


def _remove(store: Folder, file: Path, wait: float = 0.0) -> None:
    """Remove a file without a claim, unless somebody still shares it after `wait` seconds, or takes it just then."""
    with suppress(StoreLocked), _locked(store, file, fcntl.LOCK_EX, wait) as handle:
        if not os.pread(handle, 1, 0):
            file.unlink()


def _keep(file: Folder, name: str, renewed: float, ended: threading.Event) -> None:
    """Renew a claim until it is given back, or is another's."""
    beat = 0
    while not ended.wait(renewed):
        beat += 1
        with suppress(Unreachable, OSError, Mismatch):  # for a moment, or the build will find out
            if _claim(_read(file)[0]).get("build") != name:
                return
            if ended.is_set():
                return
            if isinstance(file, Remote):
                file.write_bytes(_content(name, beat))
            else:
                os.utime(file)


@contextmanager
def _locked(store: Folder, file: Path, operation: int, wait: float = 0.0) -> Iterator[int]:
    """The file of a claim, shared or alone: that which is there, not one that was removed meanwhile. Raises StoreLocked
    where it cannot be had alone for `wait` seconds."""
    until = time.monotonic() + wait
    while True:
        handle = open_own(file, os.O_RDWR | os.O_CREAT)
        try:
            fcntl.flock(handle, operation if operation == fcntl.LOCK_SH else operation | fcntl.LOCK_NB)
            if _is(handle, file):
                yield handle
                return
        except BlockingIOError:
            if time.monotonic() > until:
                raise StoreLocked(f"{store}: a worker of an earlier build is still writing: end it first") from None
            time.sleep(0.05)
        finally:
            os.close(handle)


def _is(handle: int, file: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.stat(file))
    except FileNotFoundError:
        return False


def _read(file: Folder) -> tuple[bytes | None, int]:
    """The file of a claim, None without one, and when it was written (ns; of an object, its contents tell)."""
    try:
        if isinstance(file, Remote):
            return file.read_bytes(), 0
        with open(open_own(file, os.O_RDONLY), "rb") as opened:
            return opened.read(), os.fstat(opened.fileno()).st_mtime_ns
    except FileNotFoundError:
        return None, 0


def _claim(content: bytes | None) -> dict[str, Any]:
    try:
        claim = json.loads(content or b"")
    except (ValueError, RecursionError):
        return {}
    return claim if isinstance(claim, dict) else {}


def _content(name: str, beat: int) -> bytes:
    process = os.getpid()
    value = {"build": name, "process": process, "host": socket.gethostname(), "machine": _machine()}
    return json.dumps({**value, "started": _started(process), "renewed": beat}).encode()


def _named(claim: dict[str, Any]) -> str:
    return f"process {claim.get('process')} on {claim.get('host')}"


def _here(claim: dict[str, Any]) -> bool:
    """True where the holder is, or was, a process of this machine."""
    return claim.get("machine") == _machine() and bool(claim.get("started")) and isinstance(claim.get("process"), int)


def _gone(claim: dict[str, Any]) -> bool:
    """True where the holder was a process of this machine, and is no more."""
    return _here(claim) and _started(claim["process"]) != claim["started"]


def _machine() -> str:
    """What tells this machine, since it started, and its process numbers from others; "" where nothing does."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return hashlib.sha256(f"{socket.gethostname()} {boot} {os.readlink('/proc/self/ns/pid')}".encode()).hexdigest()
    except OSError:
        return ""


def _started(process: int) -> str:
    """When a process of this machine started, in ticks; "" where there is none, or it has ended."""
    try:
        state, *fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except (OSError, ValueError):
        return ""
    return "" if state in ("Z", "X") else fields[18]
