"""Completion marks: which frames of a shard are there, the digest of their contents, and the digest of every file.

A mark is written last and atomically, and removed before its shard is written again, so a shard with a mark is whole.
Marks carry their own digest. They lie in `.marks`, which readers of the store do not see. The mark of the layout is the
manifest of everything that no frame changes: the digest of each file, and the attributes of the root with the recipe;
there are two copies of it, so that one damage never takes what a repair needs.

Digests find damage. They have no key: who forges a store forges them too.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import google_crc32c
import numpy as np

from sonarsynth.store.files import place
from sonarsynth.store.files.lock import held_by
from sonarsynth.store.files.place import (
    FileRecord,
    Folder,
    Opened,
    entries,
    read,
    read_each,
    read_json,
    remove,
    write_in,
)
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import parts_of

MARKS: Final = ".marks"
LAYOUT: Final = "layout"
"""Name of the mark of the files that are written when the store is laid out."""

MANIFESTS: Final = (f"{MARKS}/{LAYOUT}.json", f"{MARKS}/{LAYOUT}.copy.json")
"""Where the mark of the layout lies, twice."""

_CRC: Final = "crc32c:"

SHOWS: Final = "truth/sonar_position"
"""An array of every store, with a file for each shard that was written."""

ABSENT: Final[FileRecord] = (-1, "")
"""Record of a shard whose numbers are all the fill value: zarr leaves its file out, and readers fill in."""


class Damage(ValueError):
    """Something in a store is not as it was written; str() is one line."""


class Unmarked(UserWarning):
    """A store of which nobody can say whether it is whole, since marks of it are gone."""


REMEDY: Final = "'sonarsynth repair' writes it again, computing anew the frames that it is of: nothing is lost"
"""For a damaged mark."""


@dataclass(frozen=True)
class Mark:
    """What is complete, and how it looked when it was."""

    name: str  # "layout", or the number of the shard
    frames: tuple[int, ...]
    content: str  # `ContentDigest` of the arrays' values, whatever the codecs
    files: Mapping[str, FileRecord]
    attributes: Mapping[str, Any] = field(default_factory=dict)  # of the root, in the mark of the layout


def save_mark(store: Opened, mark: Mark) -> None:
    """Write a mark: all of it or nothing, on the disk when this returns. That of the layout is written twice."""
    for file in MANIFESTS if mark.name == LAYOUT else (f"{MARKS}/{mark.name}.json",):
        write_in(store, file, encoded_mark(mark))


def load_mark(store: Folder, name: str | int) -> Mark | None:
    """The mark of a shard, None where there is none. Raises Damage where it is not as it was written."""
    return read_mark(store, f"{MARKS}/{name}.json", str(name))


def read_mark(store: Folder, file: str, name: str) -> Mark | None:
    """The mark of a name in a file of the store, None where there is none. Raises Damage where it is damaged."""
    try:
        return parsed(file, name, read(store, file))
    except OSError as error:
        return parsed(file, name, error)


def load_marks(store: Folder, numbers: Iterable[int]) -> Iterator[tuple[int, Mark | Damage | None]]:
    """The marks of shards, as `load_mark` has them, with the Damage that it would raise; read many at a time."""
    names = {f"{MARKS}/{number}.json": number for number in numbers}
    for file, text in read_each(store, names):
        try:
            yield names[file], parsed(file, str(names[file]), text)
        except Damage as damage:
            yield names[file], damage


def parsed(file: str, name: str, text: bytes | OSError) -> Mark | None:
    """A mark of a name from what was read in a file. Raises Damage."""
    if isinstance(text, FileNotFoundError):
        return None
    if isinstance(text, OSError):
        raise Damage(f"{file}: the mark is damaged: it cannot be read ({text.strerror}): {REMEDY}")
    try:
        body: dict[str, Any] = json.loads(text)
        files = {path: (int(size), str(digest)) for path, (size, digest) in body["files"].items()}
        mark = Mark(body["name"], tuple(body["frames"]), body["content"], files, body.get("attributes", {}))
        if mark.name == name and encoded_mark(mark) == text and _plain(mark):  # to the byte, its seal included
            return mark
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass
    raise Damage(f"{file}: the mark is damaged: {REMEDY}")


def _plain(mark: Mark) -> bool:
    """Whether a mark is of the types that we write. Raises OSError for a name that leaves the store: a seal proves that
    nothing was damaged, not who wrote it."""
    for file in mark.files:
        parts_of(file)
    types = {type(value) for value in (*mark.frames, 0)}, type(mark.content), type(mark.attributes)
    return types == ({int}, str, dict) and min(mark.frames, default=0) >= 0


def load_layout(store: Folder) -> Mark | None:
    """The mark of the layout from whichever copy is whole; None where neither is."""
    for file in MANIFESTS:
        try:
            mark = read_mark(store, file, LAYOUT)
        except Damage:
            continue
        if mark is not None:
            return mark
    return None


def marked(store: Folder) -> list[int]:
    """Numbers of the shards that have a mark."""
    if isinstance(store, Remote) and not store.listed:
        return _marks_asked_for(store)
    names = [name.removesuffix(".json") for name in entries(store, MARKS) if name.endswith(".json")]
    return sorted(int(name) for name in names if name.isascii() and name.isdecimal() and str(int(name)) == name)


def _marks_asked_for(store: Remote) -> list[int]:
    """The same where nothing can be listed: every shard that there may be is asked for."""
    root = read_json(store, "zarr.json")
    try:
        frames = root["consolidated_metadata"]["metadata"]["frame"]["shape"][0]
        shards = -(-int(frames) // int(root["attributes"]["shard_frames"]))
    except (ValueError, KeyError, TypeError, IndexError, ZeroDivisionError):
        return []
    return [number for number, mark in load_marks(store, range(shards)) if mark is not None]


class WrittenFiles:
    """What the marks of a store say was written, looked up where a file is not there: readers take one that is missing
    for one of fill values. Each mark is read once; a shard without one was not built."""

    def __init__(self, store: Folder) -> None:
        self._store = store
        self._fixed: frozenset[str] | None = None  # files that no frame changes
        self._absent: dict[str, frozenset[str] | None] = {}  # those of a shard that were not written

    def must_not_be_missing(self, file: str) -> None:
        """Raise Damage where the file of a chunk, which was not there to be read, was written."""
        if self._written(file) and not place.there(self._store, file):  # a build may have written it meanwhile
            raise missing(file)

    def _written(self, file: str) -> bool:
        if self._fixed is None:
            layout = load_layout(self._store)
            self._fixed = frozenset() if layout is None else frozenset(layout.files)
        if file in self._fixed:
            return True
        number = f"{file.rpartition('/')[2]}.".split(".")[1]
        if number not in self._absent:
            mark = load_mark(self._store, number)
            self._absent[number] = None if mark is None else frozenset(f for f, r in mark.files.items() if r == ABSENT)
        absent = self._absent[number]
        return absent is not None and file not in absent


def missing(file: str) -> Damage:
    """What is wrong where a file of a store is gone."""
    return Damage(f"{file}: the file is missing: 'sonarsynth repair' restores it")


def file_missing_of(store: Folder) -> Callable[[Mark], str]:
    """A function that names the first file of a mark, in a folder of the store, that is not there; "" where all are, or
    nobody can list them. Each folder is listed once; no file is read."""

    @cache
    def names(folder: str) -> frozenset[str]:
        return frozenset(entries(store, folder))

    def first_missing(mark: Mark) -> str:
        if isinstance(store, Remote) and not store.listed:
            return ""
        written = (file.rpartition("/") for file, record in mark.files.items() if "/" in file and record != ABSENT)
        return next((f"{folder}/{name}" for folder, _, name in written if name not in names(folder)), "")

    return first_missing


def must_hold_files(store: Folder, arrays: Iterable[str]) -> None:
    """Raise Damage where a file of an array (its path; the first axis `frame`) is missing from a store."""
    numbers = marked(store)
    for array in arrays:
        there = {name.split(".")[1] for name in entries(store, array) if name.startswith("c.")}
        for number in (number for number in numbers if str(number) not in there):
            mark = load_mark(store, number)
            for file, record in mark.files.items() if mark else ():
                if file.startswith(f"{array}/") and record != ABSENT:
                    raise missing(file)


def must_hold_all(store: Folder | str) -> None:
    """Raise Damage where any file that the marks of a store name is missing from it."""
    folder = place.absolute(store)
    first_missing = file_missing_of(folder)
    for mark in (load_layout(folder), *(mark for _, mark in load_marks(folder, marked(folder)))):
        if isinstance(mark, Mark) and (file := first_missing(mark)):
            raise missing(file)


def warn_unmarked(store: Folder) -> None:
    """Warn, in one line, where a store has data and no marks of them: readers take a file that is missing for one of
    fill values. A shard that a build writes has no mark yet, and what xarray wrote has files of other names. In an
    object store only the layout's is asked for."""
    far, laid = isinstance(store, Remote), any(place.there(store, name) for name in MANIFESTS)
    if (far and laid) or held_by(store):
        return
    numbers = {name.split(".")[1] for name in entries(store, SHOWS) if name.startswith("c.")}
    lost, remedy = [MARKS], "copy it as well, or 'sonarsynth repair' computes these frames anew"
    if laid:
        lost = [f"{MARKS}/{number}.json" for number in sorted(numbers - {str(number) for number in marked(store)})]
        remedy = "a build was killed, or a copy cut short: build again, or 'sonarsynth repair', computes them anew"
    if lost and numbers:
        what = "is missing: no one can say which files were written, and those that are gone read as NaN"
        warnings.warn(f"{store}: {lost[0]} {what}: {remedy}", Unmarked, stacklevel=3)


def all_files(store: Folder) -> Iterator[str]:
    """Every file in the store but the marks, as paths within it; links to folders too."""
    return place.all_files(store, apart=MARKS)


def drop_mark(store: Opened, name: str | int) -> None:
    """Remove a mark, before its shard is written again."""
    remove(store, f"{MARKS}/{name}.json")


class ContentDigest:
    """Digest of the values of a shard's arrays, which are added in the order of their names: the SHA-256 of the CRC-32C
    of each, which is read fifteen times as fast. Marks of earlier stores, without its name, have SHA-256 of all."""

    def __init__(self, like: str = _CRC) -> None:
        self._crc = like.startswith(_CRC)
        self._sum = hashlib.sha256()

    def add(self, name: str, chunks: Sequence[np.ndarray]) -> None:
        """Add a shard of an array, in one or several parts (frame, ...)."""
        little = [np.ascontiguousarray(chunk, chunk.dtype.newbyteorder("<")) for chunk in chunks]
        shape = sum(map(len, little)), *little[0].shape[1:]
        self._sum.update(f"{name} {little[0].dtype.str} {shape}\n".encode())
        crc = 0
        for chunk in little:
            numbers = chunk.reshape(-1).view(np.uint8)
            if self._crc:
                crc = google_crc32c.extend(crc, numbers)
            else:
                self._sum.update(numbers.data)
        self._sum.update(f"{crc:08x}\n".encode() if self._crc else b"")

    def __str__(self) -> str:
        return (_CRC if self._crc else "") + self._sum.hexdigest()


def encoded_mark(mark: Mark) -> bytes:
    """A mark as it lies in the store, with its digest."""
    body = {"name": mark.name, "frames": mark.frames, "content": mark.content, "files": mark.files}
    if mark.attributes:
        body["attributes"] = mark.attributes
    return json.dumps({**body, "seal": _seal(body)}).encode()


def _seal(body: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()
