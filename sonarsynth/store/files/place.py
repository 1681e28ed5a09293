"""Where a store is: a folder of this machine, or a URL. All that the rest needs to do there is here.

On a disk a file is written beside its place and moved there, or written once and synchronised, and nothing is read or
written through a link in the store (`within`). An object store has neither; there an object is written whole.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import re
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from sonarsynth.store.files import within
from sonarsynth.store.files.remote import Remote, Unreachable
from sonarsynth.store.files.within import OpenedFolder

Folder = Path | Remote
"""A place of a store, or of something in it."""

Opened = Path | OpenedFolder | Remote
"""A store that is read or written, by its name or held."""

FileRecord = tuple[int, str]
"""Size and SHA-256 of a file."""

_AT_ONCE_BYTES: Final = 256_000_000

MOST_METADATA: Final = 1 << 28
"""Bytes of a mark or of metadata, at most: a file of a store may say that it is larger than memory."""


def folder_of(address: Folder | str) -> Folder:
    """The place that a path or a URL names; file:// is a path. Raises Unreachable for a bad URL, else TypeError."""
    if isinstance(address, Path | Remote):
        return address
    if not isinstance(address, str):
        raise TypeError(f"a store is named by a path or a URL, not by a {type(address).__name__}")
    elsewhere = re.match(r"(?!file:)[A-Za-z][A-Za-z0-9+.-]*://", address)
    return Remote(address) if elsewhere else Path(address.removeprefix("file://"))


def absolute(address: Folder | str) -> Folder:
    """The same wherever this process goes. Where it is a link, what that leads to: the lock and all that is beside a
    store is beside its folder, by whatever way it was named. Raises OSError for links in a circle."""
    folder = folder_of(address)
    if isinstance(folder, Remote):
        return folder
    resolved = Path(os.path.realpath(folder))
    if resolved.is_symlink():
        raise OSError(errno.ELOOP, "is a link that leads nowhere", str(folder))
    return resolved


def named_after(store: Folder | str) -> Path:
    """The path that what is made of a store is named after, and beside: its own, or of one at a URL its name in the
    working folder. Raises OSError where it has no name."""
    folder = folder_of(store)
    if isinstance(folder, Remote):
        return Path(folder.name)
    path = Path(os.path.realpath(folder)) if folder.name in ("", "..") else folder  # such as "."
    if not path.name:
        raise OSError(errno.EISDIR, "is no place for a store", str(store))
    return path


def beside(store: Folder | str, suffix: str) -> Folder:
    """A file beside a store: `remus.zarr` -> `remus.zarr.lock`."""
    store = absolute(store)
    if not store.name:
        raise OSError(errno.EISDIR, "is no place for a store", str(store))
    return store.with_name(f"{store.name}.{suffix}")


def here(store: Folder | str, suffix: str) -> Path:
    """What grows line by line, or is for processes of this machine: beside a store, or in `state_folder` of a URL."""
    file = beside(store, suffix)
    return file if isinstance(file, Path) else state_folder(absolute(store)) / file.name


def state_folder(store: Folder) -> Path:
    """Where log and run times of a store at a URL are: a folder of this machine, made if it is not there."""
    base = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    folder = Path(base) / "sonarsynth" / re.sub(r"[^\w.-]+", "-", str(store))
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def held(folder: Folder) -> Iterator[Opened]:
    """A store of a disk that stays the same one meanwhile, whatever takes its name. Raises OSError."""
    if isinstance(folder, Remote):
        yield folder
        return
    with within.held(folder) as store:
        yield store


def try_writing(folder: Folder) -> None:
    """Raise Unreachable where a store cannot be written: at a URL, or in the nearest folder that there is."""
    if isinstance(folder, Remote):
        probe = beside(folder, "probe")
        assert isinstance(probe, Remote)
        probe.write_bytes(b"")
        probe.unlink(missing_ok=True)
    elif not folder.exists():
        nearest = next(above for above in folder.absolute().parents if above.exists())
        try:
            Path(tempfile.mkdtemp(prefix=".sonarsynth-", dir=nearest)).rmdir()
        except OSError as error:
            raise Unreachable(f"{folder}: nothing can be written in {nearest} ({error.strerror})") from None


def opens(folder: Folder) -> Any:
    """What zarr and xarray open, to read: Zarr 3 alone, and of a disk no link."""
    if isinstance(folder, Remote):
        return folder.zarr_store()
    from sonarsynth.store.files.guarded import GuardedReads  # zarr: 0.3 s, which writing and comparing do not need

    return GuardedReads(folder, read_only=True)


def read(folder: Opened, name: str) -> bytes:
    """A whole file of metadata of a store. Raises OSError."""
    if isinstance(folder, Remote):
        return (folder / name).read_bytes()
    with within.opened(folder, name) as file:
        content = file.read(MOST_METADATA + 1)
    if len(content) > MOST_METADATA:
        raise OSError(errno.EFBIG, f"is larger than {MOST_METADATA >> 20} MiB", f"{folder}/{name}")
    return content


def read_json(folder: Opened, name: str) -> dict[str, Any]:
    """A file of metadata that holds a mapping; {} where there is none that can be read."""
    try:
        document = json.loads(read(folder, name))
    except (OSError, ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def read_each(folder: Folder, names: Iterable[str]) -> Iterator[tuple[str, bytes | OSError]]:
    """Whole files, many at a time where they are far; the error in place of those that cannot be read."""
    if isinstance(folder, Remote):
        yield from folder.read_each(names)
        return
    for name in names:
        try:
            yield name, read(folder, name)
        except OSError as error:
            yield name, error


def record(folder: Folder, name: str, *, size: int | None = None) -> FileRecord:
    """Size and SHA-256 of a file of a store. A file of another size than `size` is not read: its digest is "". Raises
    OSError."""
    if isinstance(folder, Remote):
        return record_of((folder / name).read_bytes())
    with within.opened(folder, name) as file:
        actual_size = os.fstat(file.fileno()).st_size
        if size is not None and actual_size != size:
            return actual_size, ""
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return os.fstat(file.fileno()).st_size, digest


def records(folder: Folder, expected: Mapping[str, FileRecord]) -> Iterator[tuple[str, FileRecord | OSError]]:
    """Records of files as they are, in the order of their names; the error in place of those that cannot be read.

    Where they are far, as many at a time as should fit in memory by the records that are expected.
    """
    if isinstance(folder, Remote):
        for batch in _batches(expected):
            for name, content in folder.read_each(batch):
                yield name, content if isinstance(content, OSError) else record_of(content)
        return
    for name in sorted(expected):
        try:
            yield name, record(folder, name, size=expected[name][0])
        except OSError as error:
            yield name, error


def _batches(expected: Mapping[str, FileRecord]) -> Iterator[list[str]]:
    batch: list[str] = []
    total = 0
    for name in sorted(expected):
        size = max(expected[name][0], 0)
        if batch and total + size > _AT_ONCE_BYTES:
            yield batch
            batch, total = [], 0
        batch.append(name)
        total += size
    if batch:
        yield batch


def record_of(content: bytes) -> FileRecord:
    """Size and SHA-256 of a content."""
    return len(content), hashlib.sha256(content).hexdigest()


def all_files(folder: Folder, apart: str = "") -> Iterator[str]:
    """Every file beneath, as a path from there, but those in a folder `apart`; links to folders too."""
    if isinstance(folder, Remote):
        yield from (name for name in folder.sizes() if name.partition("/")[0] != apart)
        return
    start = len(f"{folder}/")
    for inner, folders, names in os.walk(folder):
        inside = inner[start:]
        if not apart or inside.partition("/")[0] != apart:
            links = [name for name in folders if os.path.islink(f"{inner}/{name}")]  # which are not followed
            yield from (f"{inside}/{name}" if inside else name for name in names + links)


def entries(folder: Folder, name: str) -> list[str]:
    """Names right beneath a folder of a store, [] where there is nothing."""
    if isinstance(folder, Remote):
        return sorted({inner.partition("/")[0] for inner in (folder / name).sizes()})
    return within.listed(folder, name)


def stamps(folder: Folder, name: str) -> dict[str, object]:
    """What tells of each file right beneath a folder of a store whether it was written again, even with the same
    contents."""
    if isinstance(folder, Remote):
        return (folder / name).stamps()
    statuses = {inner: within.status(folder, f"{name}/{inner}") for inner in within.listed(folder, name)}
    return {inner: (status.st_ino, status.st_mtime_ns) for inner, status in statuses.items() if status is not None}


def there(folder: Folder, name: str = "") -> bool:
    """True where something has this name, whatever it is."""
    if isinstance(folder, Remote):
        return (folder / name if name else folder).exists()
    return within.status(folder, name) is not None if name else os.path.lexists(folder)


def is_folder(folder: Folder, name: str) -> bool:
    """True for a folder in a store."""
    if isinstance(folder, Remote):
        return (folder / name).is_dir()
    status = within.status(folder, name)
    return status is not None and stat.S_ISDIR(status.st_mode)


def write_each(folder: Opened, contents: Mapping[str, bytes]) -> None:
    """Write files of a store, with their folders: on the disk when this returns."""
    if isinstance(folder, Remote):
        folder.write_each(contents)
    else:
        within.write_each(folder, contents)


def write_in(folder: Opened, name: str, content: bytes) -> None:
    """Write a file of a store so that it is there whole or not at all."""
    if isinstance(folder, Remote):
        (folder / name).write_bytes(content)
    else:
        within.write_atomically(folder, name, content)


def write_atomically(file: Folder, content: bytes) -> None:
    """Write a file beside a store so that it is there whole or not at all."""
    if isinstance(file, Remote) or (file.exists() and not file.is_file()):  # a pipe or a device
        file.write_bytes(content)
    else:
        within.write_atomically(Path(os.path.realpath(file.parent)), file.name, content)


def read_beside(file: Folder) -> bytes:
    """A file beside a store. Raises FileNotFoundError, and Mismatch for what is no plain file."""
    if isinstance(file, Remote):
        return file.read_bytes()
    with open(within.open_own(file, os.O_RDONLY), "rb") as handle:
        return handle.read()


def remove(folder: Opened, name: str, *, sync: bool = True) -> None:
    """Remove a file of a store if it is there; with `sync`, for good."""
    if isinstance(folder, Remote):
        (folder / name).unlink(missing_ok=True)
    else:
        within.remove(folder, name, sync=sync)


def upload(folder: Remote, files: Mapping[str, bytes], first: Iterable[str], last: str) -> None:
    """Write files in three steps, each when those of the one before are there: `first`, the others, `last`."""
    before = list(first)
    folder.write_each({name: files[name] for name in before})
    folder.write_each({name: content for name, content in files.items() if name not in (*before, last)})
    folder.write_each({last: files[last]})
