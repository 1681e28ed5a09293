"""One builder at a time at a URL: an object that only one can create, and that its holder renews while it lives.

No one releases the lock of a process that was killed. So a lock is taken over when its holder was a process of this
machine that is gone, or when it was not renewed for `LEASE` seconds. Who writes a shard looks before it, and again
before its mark, whether the lock still names its build: a writer that outlived its build writes no mark. (Two builds of
one recipe that write at the same time write the same objects.)
"""

from __future__ import annotations

import hashlib
import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

from sonarsynth.store.files.remote import Remote, Unreachable

RENEWED: Final = 10.0
"""Seconds between two renewals of a lock."""

LEASE: Final = 60.0
"""Seconds without a renewal after which a lock is nobody's."""


class LeaseHeld(RuntimeError):
    """Someone else holds the lock; str() names the holder."""


@contextmanager
def leased(file: Remote, lease: float = LEASE, renewed: float = RENEWED) -> Iterator[str]:
    """Hold a lock; gives the name of this build. Raises LeaseHeld, and Unreachable where it cannot be written."""
    name = uuid.uuid4().hex
    _take(file, name, lease)
    ended = threading.Event()
    keeper = threading.Thread(target=_keep, args=(file, name, renewed, ended), daemon=True)
    keeper.start()
    try:
        yield name
    finally:
        ended.set()
        keeper.join(timeout=renewed)
        with suppress(Unreachable, OSError):
            if holder(file) == name:
                file.unlink(missing_ok=True)


def holder(file: Remote) -> str:
    """The build that a lock names, "" where there is none."""
    return str(_read(file).get("build", ""))


def who(file: Remote) -> str:
    """Who holds a lock, such as "process 7 on here"; "" where nobody does, or nobody has renewed it."""
    claim = _read(file)
    return "" if not claim or _gone(claim) or file.age() > LEASE else _named(claim)


def _named(claim: dict[str, Any]) -> str:
    return f"process {claim.get('process')} on {claim.get('host')}"


def _take(file: Remote, name: str, lease: float) -> None:
    while not file.write_if_absent(_content(name, 0)):
        claim = _read(file)
        if claim and not _gone(claim):
            _wait_out(file, claim, lease)
        file.unlink(missing_ok=True)
    if holder(file) != name:  # two took over at once
        raise LeaseHeld("another process")


def _wait_out(file: Remote, claim: dict[str, Any], lease: float) -> None:
    """Wait until a lock is not renewed any more. Raises LeaseHeld as soon as it is."""
    until = time.monotonic() + lease
    while time.monotonic() < until:
        time.sleep(min(1.0, lease / 10))
        now = _read(file)
        if not now:
            return
        if now != claim:
            raise LeaseHeld(_named(now))


def _keep(file: Remote, name: str, renewed: float, ended: threading.Event) -> None:
    """Renew a lock until it is given back, or is another's."""
    beat = 0
    while not ended.wait(renewed):
        beat += 1
        with suppress(Unreachable, OSError):  # for a moment, or the build will find out
            if holder(file) != name:
                return
            if not ended.is_set():
                file.write_bytes(_content(name, beat))


def _content(name: str, beat: int) -> bytes:
    process = os.getpid()
    value = {
        "build": name,
        "process": process,
        "host": socket.gethostname(),
        "machine": _machine(),
        "started": _started(process),
        "renewed": beat,
    }
    return json.dumps(value).encode()


def _read(file: Remote) -> dict[str, Any]:
    try:
        claim = json.loads(file.read_bytes())
    except (FileNotFoundError, ValueError):
        return {}
    return claim if isinstance(claim, dict) else {}


def _gone(claim: dict[str, Any]) -> bool:
    """True where the holder was a process of this machine, and is no more."""
    process, started = claim.get("process"), claim.get("started")
    ours = claim.get("machine") == _machine() and bool(started) and isinstance(process, int)
    return ours and isinstance(process, int) and _started(process) != started


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
