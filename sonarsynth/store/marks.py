"""Completion marks: which frames of a shard are there, the digest of their contents, and the digest of every file.

A mark is written last and atomically, and removed before its shard is written again, so a shard with a mark is whole.
Marks carry their own digest. They lie in `.marks`, which readers of the store do not see. The mark of the layout is the
manifest of everything that no frame changes: the digest of each file, and the attributes of the root with the recipe;
there are two copies of it, so that one damage never takes what a repair needs.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import stat
import uuid
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BufferedReader
from pathlib import Path
from typing import Any, Final

import numpy as np

MARKS: Final = ".marks"
LAYOUT: Final = "layout"
"""Name of the mark of the files that are written when the store is laid out."""

MANIFESTS: Final = (f"{MARKS}/{LAYOUT}.json", f"{MARKS}/{LAYOUT}.copy.json")
"""Where the mark of the layout lies, twice."""

FileRecord = tuple[int, str]
"""Size and SHA-256 of a file."""

ABSENT: Final[FileRecord] = (-1, "")
"""Record of a shard whose numbers are all the fill value: zarr leaves its file out, and readers fill in."""


class Damage(ValueError):
    """Something in a store is not as it was written; str() is one line."""


@dataclass(frozen=True)
class Mark:
    """What is complete, and how it looked when it was."""

    name: str  # "layout", or the number of the shard
    frames: tuple[int, ...]
    content: str  # SHA-256 of the arrays' values, whatever the codecs
    files: Mapping[str, FileRecord]
    attributes: Mapping[str, Any] = field(default_factory=dict)  # of the root, in the mark of the layout


def mark_file(store: Path, name: str | int) -> Path:
    """Where a mark lies."""
    return store / MARKS / f"{name}.json"


def save_mark(store: Path, mark: Mark) -> None:
    """Write a mark: all of it or nothing, on the disk when this returns. That of the layout is written twice."""
    places = [store / m for m in MANIFESTS] if mark.name == LAYOUT else [mark_file(store, mark.name)]
    for place in places:
        write_atomically(place, _encode(mark))


def load_mark(store: Path, name: str | int) -> Mark | None:
    """The mark of a shard, None where there is none. Raises Damage where it is not as it was written."""
    return read_mark(store, mark_file(store, name).relative_to(store).as_posix(), str(name))


def read_mark(store: Path, place: str, name: str) -> Mark | None:
    """The mark of a name at a place in the store, None where there is none. Raises Damage where it is damaged."""
    try:
        with _opened(f"{store}/{place}") as file:
            text = file.read()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise Damage(f"{place}: the mark is damaged: it cannot be read ({error.strerror})") from None
    try:
        body: dict[str, Any] = json.loads(text)
        files = {path: (int(size), str(digest)) for path, (size, digest) in body["files"].items()}
        mark = Mark(body["name"], tuple(body["frames"]), body["content"], files, body.get("attributes", {}))
        if mark.name == name and _encode(mark) == text:  # to the byte, its seal included
            return mark
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    raise Damage(f"{place}: the mark is damaged")


def load_layout(store: Path) -> Mark | None:
    """The mark of the layout from whichever copy is whole; None where neither is."""
    for place in MANIFESTS:
        try:
            mark = read_mark(store, place, LAYOUT)
        except Damage:
            continue
        if mark is not None:
            return mark
    return None


def marked(store: Path) -> list[int]:
    """Numbers of the shards that have a mark."""
    try:
        names = [
            entry.name.removesuffix(".json") for entry in os.scandir(store / MARKS) if entry.name.endswith(".json")
        ]
    except (FileNotFoundError, NotADirectoryError):
        return []
    return sorted(int(name) for name in names if name.isascii() and name.isdecimal() and str(int(name)) == name)


def drop_mark(store: Path, name: str | int) -> None:
    """Remove a mark, before its shard is written again."""
    file = mark_file(store, name)
    if file.exists():
        file.unlink()
        _sync(file.parent)


def record(store: Path, path: str, *, sync: bool = False) -> FileRecord:
    """Size and SHA-256 of a file of the store; with `sync`, it is on the disk first. Raises OSError."""
    with _opened(f"{store}/{path}") as file:
        if sync:
            os.fsync(file.fileno())
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return os.fstat(file.fileno()).st_size, digest


def records(store: Path, paths: Iterable[str]) -> dict[str, FileRecord]:
    """Records of files that were just written, on the disk when this returns."""
    return {path: record(store, path, sync=True) for path in paths}


def write_new(file: Path, content: bytes) -> FileRecord:
    """Write a file that is not there, with its folders: on the disk when this returns. Its record."""
    try:
        opened = open(file, "xb")  # noqa: SIM115
    except FileNotFoundError:
        file.parent.mkdir(parents=True, exist_ok=True)
        opened = open(file, "xb")  # noqa: SIM115
    with opened as out:
        out.write(content)
        os.fsync(out.fileno())
    return len(content), hashlib.sha256(content).hexdigest()


def add_to_digest(digest: hashlib._Hash, name: str, block: np.ndarray) -> None:
    """Add a shard of an array to the digest of a shard's contents; arrays go in the order of their names."""
    little = np.ascontiguousarray(block, block.dtype.newbyteorder("<"))
    digest.update(f"{name} {little.dtype.str} {little.shape}\n".encode())
    digest.update(little.reshape(-1).view(np.uint8).data)


def all_files(store: Path) -> Iterator[str]:
    """Every file in the store but the marks, as paths within it; links to folders too."""
    start = len(f"{store}/")
    for folder, folders, names in os.walk(store):
        inside = folder[start:]
        if inside.partition("/")[0] != MARKS:
            links = [name for name in folders if os.path.islink(f"{folder}/{name}")]  # which are not followed
            yield from (f"{inside}/{name}" if inside else name for name in names + links)


def write_atomically(file: Path, content: bytes) -> None:
    """Write a file so that it is there whole or not at all."""
    file.parent.mkdir(exist_ok=True)
    scratch = file.with_name(f".{file.name}.{uuid.uuid4().hex}.partial")
    try:
        with scratch.open("xb") as out:
            out.write(content)
            out.flush()
            os.fsync(out.fileno())
        scratch.replace(file)
    except BaseException:
        scratch.unlink(missing_ok=True)
        raise
    _sync(file.parent)


def _sync(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def _opened(file: str) -> Iterator[BufferedReader]:
    """A file to read. Raises OSError for what is no file: reading a pipe would wait for ever."""
    with open(file, "rb", opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK)) as opened:
        if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is no plain file", file)
        yield opened


def _encode(mark: Mark) -> bytes:
    """A mark as it lies in the store, with its digest."""
    body = {"name": mark.name, "frames": mark.frames, "content": mark.content, "files": mark.files}
    if mark.attributes:
        body["attributes"] = mark.attributes
    return json.dumps({**body, "seal": _seal(body)}).encode()


def _seal(body: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
