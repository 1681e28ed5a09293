"""Completion marks: which frames of a shard are there, the digest of their contents, and the digest of every file.

A mark is written last and atomically, and removed before its shard is written again, so a shard with a mark is whole.
Marks carry their own digest. They lie in `.marks`, which readers of the store do not see.
"""

from __future__ import annotations

import hashlib
import json
import os
import uuid
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

MARKS: Final = ".marks"
LAYOUT: Final = "layout"
"""Name of the mark of the files that are written when the store is laid out."""

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


def mark_file(store: Path, name: str | int) -> Path:
    """Where a mark lies."""
    return store / MARKS / f"{name}.json"


def save_mark(store: Path, mark: Mark) -> None:
    """Write a mark: all of it or nothing, on the disk when this returns."""
    body = {"name": mark.name, "frames": mark.frames, "content": mark.content, "files": mark.files}
    write_atomically(mark_file(store, mark.name), json.dumps({**body, "seal": _seal(body)}).encode())


def load_mark(store: Path, name: str | int) -> Mark | None:
    """The mark of a shard, None where there is none. Raises Damage where it is not as it was written."""
    file = mark_file(store, name)
    try:
        text = file.read_bytes()
    except FileNotFoundError:
        return None
    try:
        body: dict[str, Any] = json.loads(text)
        seal = body.pop("seal")
        if seal != _seal(body) or body["name"] != str(name):
            raise ValueError
        files = {path: (int(size), str(digest)) for path, (size, digest) in body["files"].items()}
        return Mark(body["name"], tuple(body["frames"]), body["content"], files)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise Damage(f"{file.relative_to(store)}: the mark is damaged") from None


def marked(store: Path) -> list[int]:
    """Numbers of the shards that have a mark."""
    try:
        names = [entry.name.removesuffix(".json") for entry in os.scandir(store / MARKS)]
    except FileNotFoundError:
        return []
    return sorted(int(name) for name in names if name.isdecimal())


def drop_mark(store: Path, name: str | int) -> None:
    """Remove a mark, before its shard is written again."""
    file = mark_file(store, name)
    if file.exists():
        file.unlink()
        _sync(file.parent)


def record(store: Path, path: str, *, sync: bool = False) -> FileRecord:
    """Size and SHA-256 of a file of the store; with `sync`, it is on the disk first. Raises OSError."""
    with (store / path).open("rb") as file:
        if sync:
            os.fsync(file.fileno())
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        return os.fstat(file.fileno()).st_size, digest


def records(store: Path, paths: Iterable[str], *, empty: Collection[str] = ()) -> dict[str, FileRecord]:
    """Records of files that were just written, on the disk when this returns; those of `empty` may be absent."""
    there = {path: path not in empty or (store / path).exists() for path in paths}
    return {path: record(store, path, sync=True) if found else ABSENT for path, found in there.items()}


def add_to_digest(digest: hashlib._Hash, name: str, block: np.ndarray) -> None:
    """Add a shard of an array to the digest of a shard's contents; arrays go in the order of their names."""
    little = np.ascontiguousarray(block, block.dtype.newbyteorder("<"))
    digest.update(f"{name} {little.dtype.str} {little.shape}\n".encode())
    digest.update(little.reshape(-1).view(np.uint8).data)


def all_files(store: Path) -> Iterator[str]:
    """Every file in the store but the marks, as paths within it."""
    for folder, _, names in os.walk(store):
        inside = Path(folder).relative_to(store)
        if inside.parts[:1] != (MARKS,):
            yield from ((inside / name).as_posix() for name in names)


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


def _seal(body: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
