"""Room on the disk, in bytes and in files: asked for before a build starts, and told when it runs out."""

from __future__ import annotations

import errno
import math
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple

from sonarsynth.conventions import format_bytes
from sonarsynth.store import Folder, Remote

LARGE: Final = 1e12
"""Bytes above which a build starts only when told so."""

FULL: Final = {
    errno.ENOSPC: "No space left",
    errno.EDQUOT: "The quota is used up",
    errno.EROFS: "The file system is read-only",
    errno.EFBIG: "The file would be larger than this process may write",
}
"""Errors of a disk that takes no more."""

MENDED_BY: Final = {errno.EROFS: "make it writable", errno.EFBIG: "raise the limit of the shell (ulimit -f)"}
"""What helps, where that is not space."""


class TooLarge(ValueError):
    """A build needs more than is free, or very much, and nobody agreed to it; str() is one line."""


class DiskRoom(NamedTuple):
    """What a store takes of a disk, or a disk has free."""

    bytes: float
    files: float  # and folders: inodes


def free_room(path: Folder) -> DiskRoom:
    """What is free where a path is, or is to be; infinite for an object store, or where files are not counted."""
    if isinstance(path, Remote):
        return DiskRoom(math.inf, math.inf)
    existing = path
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    status = os.statvfs(existing)
    return DiskRoom(shutil.disk_usage(existing).free, status.f_favail if status.f_files else math.inf)


def check_space(path: Folder, needed: DiskRoom) -> None:
    """Raise TooLarge where a build that needs so much should not start unasked."""
    free = free_room(path)
    if needed.bytes > free.bytes:
        line = f"needs up to {format_bytes(needed.bytes)} and {format_bytes(free.bytes)} are free"
    elif needed.files > free.files:
        line = f"needs up to {needed.files:.0f} files and folders and {free.files:.0f} more fit there"
    elif needed.bytes > LARGE:
        available = f" ({format_bytes(free.bytes)} are free)" if math.isfinite(free.bytes) else ""
        line = f"needs up to {format_bytes(needed.bytes)}{available}"
    else:
        return
    raise TooLarge(f"{path}: {line}: use --yes to build anyway")


@contextmanager
def told_when_full(path: Folder, needed: Callable[[], DiskRoom]) -> Iterator[None]:
    """Turn the error of a disk that takes no more into one line with what is still needed and what is free."""
    try:
        yield
    except OSError as error:
        if error.errno not in FULL or isinstance(path, Remote):
            raise
        more, free = needed(), free_room(path)
        lacking = f"up to {format_bytes(more.bytes)} more are needed, {format_bytes(free.bytes)} are free"
        if more.files > free.files:
            lacking = f"up to {more.files:.0f} more files and folders are needed, {free.files:.0f} more fit"
        mend = MENDED_BY.get(error.errno, "free some space")
        line = f"{FULL[error.errno]}: {lacking}; {mend} and run the same command again to resume"
        raise OSError(error.errno, line, os.fspath(path)) from error
