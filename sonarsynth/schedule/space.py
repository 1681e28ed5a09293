"""Room on the disk: asked for before a build starts, and told when it runs out."""

from __future__ import annotations

import errno
import math
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

from sonarsynth.conventions import size
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


class TooLarge(ValueError):
    """A build needs more than is free, or very much, and nobody agreed to it; str() is one line."""


def free_bytes(path: Folder) -> float:
    """Free bytes where a path is, or is to be; nobody knows of an object store."""
    if isinstance(path, Remote):
        return math.inf
    place = path
    while not place.exists() and place != place.parent:
        place = place.parent
    return shutil.disk_usage(place).free


def check_space(path: Folder, needed: float) -> None:
    """Raise TooLarge where a build that needs so many bytes should not start unasked."""
    free = free_bytes(path)
    if needed > free:
        raise TooLarge(f"{path}: needs up to {size(needed)} and {size(free)} are free there: --yes builds all the same")
    if needed > LARGE:
        known = f" ({size(free)} are free there)" if math.isfinite(free) else ""
        raise TooLarge(f"{path}: needs up to {size(needed)}{known}: --yes builds it")


@contextmanager
def told_when_full(path: Folder, needed: Callable[[], float]) -> Iterator[None]:
    """Turn the error of a disk that takes no more into one line with the bytes still needed and those free."""
    try:
        yield
    except OSError as error:
        if error.errno not in FULL or isinstance(path, Remote):
            raise
        line = (
            f"{FULL[error.errno]}: up to {size(needed())} more are needed, {size(free_bytes(path))} are free; "
            "with room made, the same command goes on"
        )
        raise OSError(error.errno, line, os.fspath(path)) from error
