"""Opening the files that a recipe names: plain files of a bounded size, nothing else.

A pipe would wait for ever, a device has no end, and a folder cannot be read: each is refused before it is opened.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

KINDS: Final = {
    stat.S_IFDIR: "is a directory",
    stat.S_IFIFO: "is a pipe, not a file",
    stat.S_IFSOCK: "is a socket, not a file",
    stat.S_IFCHR: "is a device, not a file",
    stat.S_IFBLK: "is a device, not a file",
}


class FileError(ValueError):
    """A file that cannot be read; str() is the reason, without the name of the file."""


@contextmanager
def errors_as(refusal: type[Exception], path: Path | str) -> Iterator[None]:
    """FileErrors of what is done meanwhile are raised as `refusal`, with the name of the file."""
    try:
        yield
    except FileError as error:
        raise refusal(f"{path}: {error}") from None


def stamp(path: Path | str) -> tuple[int, int]:
    """What changes when a file does: when it was written (ns), and its size. Raises FileError without a plain file."""
    try:
        status = os.stat(path)
    except OSError as error:
        raise FileError((error.strerror or str(error)).lower()) from None
    except ValueError:
        raise FileError("is not the path of a file") from None
    _check(status)
    return status.st_mtime_ns, status.st_size


def read(path: Path | str, limit: int) -> bytes:
    """The bytes of a plain file of at most `limit` bytes. Raises FileError."""
    with opened(path) as file:
        size = os.fstat(file.fileno()).st_size
        data = b"" if size > limit else file.read(size)
        larger = size > limit or bool(file.read(1))  # it may have grown; in /proc all sizes are 0
    if larger:
        raise FileError(f"is larger than {_size(limit)}" if size > limit else "is larger than it says")
    return data


def digest(path: Path | str) -> str:
    """SHA-256 of a plain file. Raises FileError."""
    with opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def opened(path: Path | str) -> Iterator[io.BufferedReader]:
    """A plain file, open for reading. Raises FileError, whatever goes wrong with the file."""
    stamp(path)
    try:
        # the file may have been exchanged since: never wait for a pipe, and look again at what is open
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            _check(os.fstat(file.fileno()))
            yield file
    except OSError as error:
        raise FileError((error.strerror or str(error)).lower()) from None
    except MemoryError:
        raise FileError("does not fit in memory") from None


def _check(status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        raise FileError(KINDS.get(stat.S_IFMT(status.st_mode), "is not a file"))


def _size(count: int) -> str:
    return f"{count >> 30} GiB" if count >= 1 << 30 else f"{count >> 20} MiB"
