"""An array of a store whose first axis is `frame`, as it lies in files: the inverse of `encoding`, without zarr.

zarr and xarray take a millisecond of Python for each read, whatever its size. What they decode is the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from math import prod
from pathlib import Path
from typing import Any, Final

import google_crc32c
import numpy as np
from numcodecs import blosc

from sonarsynth.store.array_metadata import lies
from sonarsynth.store.encoding import NOT_THERE
from sonarsynth.store.files import within
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import Damage, WrittenFiles

MOST_CHUNKS: Final = 8
"""Of an array that has several frames in a chunk, that are kept decoded."""
MOST_BYTES: Final = 2**31
"""Of a chunk: a store may say what it likes."""
LARGE: Final = 2**18
"""Bytes of a chunk over which the best decoder is worth its import."""
RESTORES: Final = "'sonarsynth repair' restores it"
_CRC: Final = 4
_HEADER: Final = 16
"""Bytes of what blosc says of a chunk (c-blosc, README_CHUNK_FORMAT)."""


@dataclass(frozen=True, eq=False)
class Chunks:
    """How an array lies in files, by its metadata."""

    path: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    shard: int  # frames in a file
    chunk: int  # frames in a chunk
    fill: Any
    scale: np.float32 | None  # of packed numbers

    @property
    def chunk_bytes(self) -> int:
        """Of a chunk, decoded."""
        return self.dtype.itemsize * self.chunk * prod(self.shape[1:])

    def file(self, shard: int) -> str:
        """The file of a shard."""
        return f"{self.path}/" + ".".join(["c", str(shard), *["0"] * (len(self.shape) - 1)])


class FrameArray:
    """An array whose first axis is `frame`, read frame by frame; decoded as xarray does, but that packed numbers are
    float32 as `open_store` has them."""

    def __init__(self, chunks: Chunks, content: Callable[[str], ArrayFile | None], large: int = LARGE) -> None:
        self._chunks, self._content, self._large = chunks, content, large

    @cached_property
    def _decoded(self) -> Callable[[int], np.ndarray]:
        return lru_cache(MOST_CHUNKS if self._chunks.chunk > 1 else 0)(self._chunk)

    @property
    def shape(self) -> tuple[int, ...]:
        """With all frames of the store."""
        return self._chunks.shape

    def __getitem__(self, frame: int) -> np.ndarray:
        """A frame, the caller's own. Raises IndexError, Damage."""
        if not 0 <= frame < self.shape[0]:
            raise IndexError(f"frame {frame} is outside 0..{self.shape[0] - 1}")
        number, row = divmod(frame, self._chunks.chunk)
        return self._values(self._decoded(number)[row])

    def every(self) -> np.ndarray:
        """All frames."""
        return self._values(self.stored(np.arange(self.shape[0])))

    def stored(self, frames: np.ndarray, further: Sequence[Any] = ()) -> np.ndarray:
        """Frames (row,) as they are stored, each chunk read once; of the further axes what an index each takes."""
        taken = _taken(np.empty((0, *self.shape[1:]), self._chunks.dtype), further)
        values = np.empty((len(frames), *taken.shape[1:]), taken.dtype)
        numbers, rows = np.divmod(frames, self._chunks.chunk)
        order = np.argsort(numbers, kind="stable")
        for own in np.split(order, np.flatnonzero(np.diff(numbers[order])) + 1) if len(order) else ():
            values[own] = _taken(self._chunk(int(numbers[own[0]]))[rows[own]], further)
        return values

    def _values(self, raw: np.ndarray) -> np.ndarray:
        """Stored numbers as what they stand for."""
        if self._chunks.scale is None:
            return np.array(raw) if raw.base is not None else raw
        values = np.asarray(np.multiply(raw, self._chunks.scale, dtype=np.float32))
        if raw.size and raw.min() <= self._chunks.fill:  # quicker than to look at each: the fill value is the least
            values[raw == self._chunks.fill] = np.nan
        return values

    def _chunk(self, number: int) -> np.ndarray:
        """Chunk `number` of the array, (frame, ...) as stored."""
        own = self._chunks
        shard, row = divmod(number, own.shard // own.chunk)
        path, shape = own.file(shard), (own.chunk, *own.shape[1:])
        file = self._content(path) if own.chunk_bytes else None  # of no numbers there is no file
        if file is None:
            return np.full(shape, own.fill, own.dtype)
        first, length = (0, file.size) if own.shard == own.chunk else file.entry(row, own.shard // own.chunk, path)
        if first == NOT_THERE and length == NOT_THERE:
            return np.full(shape, own.fill, own.dtype)
        data = _checked(file.part(first, length), path)
        if len(data) < _HEADER or int.from_bytes(data[4:8], "little") != own.chunk_bytes:
            raise Damage(f"{path}: a chunk is not of the size that the array has: {RESTORES}")
        block = np.empty(shape, own.dtype)
        try:
            (_decoder() if own.chunk_bytes > self._large else blosc.decompress)(data, block)
        except (RuntimeError, ValueError, TypeError) as error:
            raise Damage(f"{path}: a chunk cannot be decoded: {RESTORES} ({error})") from None
        return block


def _taken(block: np.ndarray, further: Sequence[Any]) -> np.ndarray:
    """Of a block (frame, ...) what an index takes of each axis after the first."""
    for axis in range(len(further), 0, -1):
        block = block[(*[slice(None)] * axis, further[axis - 1])]
    return block


class ArrayFile:
    """An open file of a shard."""

    def __init__(self, root: Path, name: str) -> None:
        with within.opened(root, name) as file:
            self._handle = os.dup(file.fileno())
        self.size = os.fstat(self._handle).st_size
        self._index: np.ndarray | None = None

    def __del__(self) -> None:
        if hasattr(self, "_handle"):
            os.close(self._handle)

    def part(self, first: int, length: int) -> bytes:
        """Some bytes."""
        return os.pread(self._handle, length, first)

    def entry(self, row: int, count: int, path: str) -> tuple[int, int]:
        """Where a chunk lies: its first byte and its length. Raises Damage."""
        if self._index is None:
            length = 16 * count + _CRC
            if length > self.size:
                raise Damage(f"{path}: is too short for its index: {RESTORES}")
            index = np.frombuffer(_checked(self.part(self.size - length, length), path), "<u8").reshape(count, 2)
            entries = index[index[:, 0] != NOT_THERE].astype(float)
            if (entries.sum(axis=1) > self.size - length).any():
                raise Damage(f"{path}: its index leads out of the file: {RESTORES}")
            self._index = index
        first, length = self._index[row].tolist()
        return first, length


def file_of(root: Path, written: WrittenFiles, name: str) -> ArrayFile | None:
    """A file of a shard; None where none was written. Raises Damage for one that is missing."""
    try:
        return ArrayFile(root, name)
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        written.must_not_be_missing(name)
        return None


@cache
def _decoder() -> Callable[[bytes, np.ndarray], object]:
    """That of large chunks: blosc2, in under half the time of numcodecs, but it takes a second to import."""
    try:
        import blosc2
    except ImportError:
        return blosc.decompress  # type: ignore[no-any-return]
    return lambda data, block: blosc2.decompress2(data, dst=block, nthreads=1)


def _checked(data: bytes, path: str) -> bytes:
    """Bytes whose CRC-32C is right, without it."""
    content = data[:-_CRC]
    if len(data) < _CRC or int(google_crc32c.value(content)) != int.from_bytes(data[-_CRC:], "little"):
        raise Damage(f"{path}: its checksum is wrong: {RESTORES}")
    return content


def as_laid(path: str, metadata: Mapping[str, Any]) -> Chunks:
    """How an array lies, by its metadata. Raises Mismatch."""
    try:
        shape, dtype = tuple(int(n) for n in metadata["shape"]), np.dtype(metadata["data_type"])
        shard, codecs = int(metadata["chunk_grid"]["configuration"]["chunk_shape"][0]), metadata["codecs"]
        chunk = shard
        if codecs[0]["name"] == "sharding_indexed":
            chunk = int(codecs[0]["configuration"]["chunk_shape"][0])
            codecs = codecs[0]["configuration"]["codecs"]
        how: dict[str, Any] = next((of["configuration"] for of in codecs if of["name"] == "blosc"), {})
        ours = lies(shape, dtype, shard, chunk, how)
        scale = metadata["attributes"].get("scale_factor")
        fill = np.asarray(metadata["fill_value"], float if dtype.kind == "f" else dtype).astype(dtype)[()]
        chunks = Chunks(path, shape, dtype, shard, chunk, fill, None if scale is None else np.float32(scale))
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise Mismatch(f"{path}: its metadata cannot be read ({type(error).__name__}: {error})") from None
    consistent = 0 < chunk <= shard and shard % chunk == 0 and min(shape, default=0) >= 0 and dtype.kind in "iuf"
    if not consistent or chunks.chunk_bytes > MOST_BYTES or any(metadata.get(key) != ours[key] for key in ours):
        raise Mismatch(f"{path}: does not lie as sonarsynth writes it: read it with xarray")
    return chunks
