"""Files within a folder of this machine, and nowhere else: no name leads out of it, and no link is followed.

A store may come from anybody. Its folder is resolved once, where it is named (`place.absolute`); from there each folder
on the way to a file is opened by itself, from the one before it, and a link in its place is an error.
"""

from __future__ import annotations

import ctypes
import errno
import os
import stat
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import Final

IS_LINK: Final = "is a link, which is not followed"

_syncfs: Final = getattr(ctypes.CDLL(None, use_errno=True), "syncfs", None)
"""Linux has it: a whole file system is on the disk when it returns 0."""

_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_NEW: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


class Mismatch(ValueError):
    """What is there is something else than what is wanted, or is none of ours; str() is one line."""


@dataclass(frozen=True)
class OpenedFolder:
    """A folder that was opened: it stays the same one wherever it is moved, and whatever takes its name."""

    path: Path
    handle: int

    def __str__(self) -> str:
        return str(self.path)

    def in_its_place(self) -> bool:
        """Whether its name still leads to it."""
        try:
            return os.path.samestat(os.stat(self.path, follow_symlinks=False), os.fstat(self.handle))
        except OSError:
            return False


Root = Path | OpenedFolder
"""Where files are: by the name of a folder, or a folder that is held."""


@contextmanager
def held(root: Path) -> Iterator[OpenedFolder]:
    """Hold a folder: what is read and written in it meanwhile is all in the same one. Raises OSError."""
    handle = _open(None, str(root), _FOLDER, str(root))
    try:
        yield OpenedFolder(root, handle)
    finally:
        os.close(handle)


def parts_of(name: str) -> list[str]:
    """The folders of a name, and the file. Raises OSError for a name that leaves the folder or is of no file."""
    names = name.split("/")
    if any(inner in ("", ".", "..") or "\0" in inner for inner in names):
        raise OSError(errno.EINVAL, "is no name of a file in a store", name)
    return names


@contextmanager
def opened(root: Root, name: str) -> Iterator[BufferedReader]:
    """A file to read. Raises OSError for a link on the way, and for what is no file: a pipe would wait for ever."""
    with folder_of(root, name) as (folder, last):
        handle = _open(folder, last, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW | os.O_CLOEXEC, f"{root}/{name}")
    with open(handle, "rb") as file:
        mode = os.fstat(handle).st_mode
        if not stat.S_ISREG(mode):
            kind = errno.EISDIR if stat.S_ISDIR(mode) else errno.EINVAL
            raise OSError(kind, "it is no plain file", f"{root}/{name}")
        yield file


def write_each(root: Root, contents: Mapping[str, bytes]) -> None:
    """Write files anew, with their folders: all on the disk when this returns. What had their names is another file's
    now. The folder `root` itself is never made.

    The file system is synchronised once, with all its files: the processor works many times as long for each of a
    hundred by itself. What other programs have just written to the same file system is waited for too.
    """
    with _walked(root, []) as handle:  # from before anything is written: what fails from then on is told
        for name, content in contents.items():
            _write_new(root, name, content)
        if _syncfs is None:
            os.sync()
        elif _syncfs(handle) != 0:
            code = ctypes.get_errno()
            raise OSError(code, os.strerror(code), str(root))


def _write_new(root: Root, name: str, content: bytes) -> None:
    with folder_of(root, name, make=True) as (folder, last):
        try:
            handle = os.open(last, _NEW, 0o666, dir_fd=folder)
        except FileExistsError:
            os.unlink(last, dir_fd=folder)
            handle = os.open(last, _NEW, 0o666, dir_fd=folder)
        with open(handle, "wb") as out:
            out.write(content)


def write_atomically(root: Root, name: str, content: bytes) -> None:
    """Write a file so that it is there whole or not at all. The folder `root` itself is never made."""
    with folder_of(root, name, make=True) as (folder, last):
        scratch = f".{last}.{uuid.uuid4().hex}.partial"
        try:
            with open(os.open(scratch, _NEW, 0o666, dir_fd=folder), "wb") as out:
                out.write(content)
                out.flush()
                os.fsync(out.fileno())
            os.replace(scratch, last, src_dir_fd=folder, dst_dir_fd=folder)
        except BaseException as error:
            with suppress(OSError):
                os.unlink(scratch, dir_fd=folder)
            if isinstance(error, OSError) and error.filename in (scratch, None):  # None: the disk is full
                error.filename = f"{root}/{name}"
            raise
        os.fsync(folder)


def remove(root: Root, name: str, *, sync: bool = True) -> None:
    """Remove a file if it is there; with `sync`, for good."""
    try:
        with folder_of(root, name) as (folder, last):
            os.unlink(last, dir_fd=folder)
            if sync:
                os.fsync(folder)
    except (FileNotFoundError, NotADirectoryError):
        pass


def status(root: Root, name: str) -> os.stat_result | None:
    """What has a name, a link as itself; None where nothing has it, or a link is on the way."""
    try:
        with folder_of(root, name) as (folder, last):
            return os.stat(last, dir_fd=folder, follow_symlinks=False)
    except OSError:
        return None


def listed(root: Root, name: str) -> list[str]:
    """Names right beneath a folder in `root`; [] where there is no such folder."""
    try:
        with _walked(root, parts_of(name)) as folder:
            return os.listdir(folder)
    except OSError:
        return []


def open_own(file: Path, flags: int) -> int:
    """A handle of a file beside a store that is written where it stands. Raises Mismatch for a link, a second name of
    another file, and what is no file: what is written there would be written elsewhere."""
    try:
        handle = os.open(file, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o644)
    except OSError as error:
        if error.errno in (errno.ELOOP, errno.ENXIO, errno.EISDIR):
            raise Mismatch(f"{file}: is a link or no plain file, and is not written or read: move it away") from None
        raise
    file_status = os.fstat(handle)
    if not stat.S_ISREG(file_status.st_mode) or file_status.st_nlink > 1:
        os.close(handle)
        raise Mismatch(f"{file}: is a second name of another file, or none: move it away")
    return handle


@contextmanager
def folder_of(root: Root, name: str, *, make: bool = False) -> Iterator[tuple[int, str]]:
    """A handle of the folder that a name is in, and the last part of the name."""
    *folders, last = parts_of(name)
    with _walked(root, folders, make) as handle:
        yield handle, last


@contextmanager
def _walked(root: Root, folders: Sequence[str], make: bool = False) -> Iterator[int]:
    """A handle of a folder in `root`, made where it is to be."""
    handle = os.dup(root.handle) if isinstance(root, OpenedFolder) else _open(None, str(root), _FOLDER, str(root))
    path = str(root)
    try:
        for folder in folders:
            path = f"{path}/{folder}"
            try:
                inner = _open(handle, folder, _FOLDER, path)
            except FileNotFoundError:
                if not make:
                    raise
                with suppress(FileExistsError):
                    os.mkdir(folder, dir_fd=handle)
                inner = _open(handle, folder, _FOLDER, path)
            os.close(handle)
            handle = inner
        yield handle
    finally:
        os.close(handle)


def _open(folder: int | None, name: str, flags: int, path: str) -> int:
    """A handle; OSError says where a link was met."""
    try:
        return os.open(name, flags, dir_fd=folder)
    except OSError as error:
        link = _is_link(folder, name)
        raise OSError(errno.ELOOP if link else error.errno, IS_LINK if link else error.strerror, path) from None


def _is_link(folder: int | None, name: str) -> bool:
    try:
        return stat.S_ISLNK(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode)
    except OSError:
        return False
