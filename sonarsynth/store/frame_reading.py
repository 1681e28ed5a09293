"""Single frames of a store in random order, as training reads them: the inverse of `encoding`, without zarr.

zarr and xarray take a millisecond of Python for each read, whatever its size. What they decode is the same.
"""

from __future__ import annotations

import json
import os
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import google_crc32c
import numpy as np
from numcodecs import blosc

from sonarsynth.store.encoding import NOT_THERE
from sonarsynth.store.files import within
from sonarsynth.store.files.place import Folder, absolute, read
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.marks import Damage, WrittenFiles
from sonarsynth.store.opening import must_be_as_laid_out, must_be_folder

if TYPE_CHECKING:
    import xarray as xr

MOST_FILES: Final = 64
"""That are kept open."""
MOST_CHUNKS: Final = 8
"""Of an array that has several frames in a chunk, that are kept decoded."""
MOST_BYTES: Final = 2**31
"""Of a chunk: a store may say what it likes."""
LARGE: Final = 2**18
"""Bytes of a chunk over which the best decoder is worth its import."""
HELD_BYTES: Final = 2**22
"""Of a variable that `hold` reads whole, at most."""
_CRC: Final = 4
_HEADER: Final = 16
"""Bytes of what blosc says of a chunk (c-blosc, README_CHUNK_FORMAT)."""


@dataclass(frozen=True, eq=False)
class _Chunks:
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

    def __init__(self, chunks: _Chunks, content: Callable[[str], _File | None]) -> None:
        self._chunks, self._content = chunks, content
        self._decoded: OrderedDict[int, np.ndarray] = OrderedDict()

    @property
    def shape(self) -> tuple[int, ...]:
        """With all frames of the store."""
        return self._chunks.shape

    def __getitem__(self, frame: int) -> np.ndarray:
        """A frame, the caller's own. Raises IndexError, Damage."""
        if not 0 <= frame < self.shape[0]:
            raise IndexError(f"frame {frame} is outside 0..{self.shape[0] - 1}")
        if self._chunks.chunk == 1:
            return self._values(self._chunk(frame)[0])
        number, row = divmod(frame, self._chunks.chunk)
        block = self._decoded.pop(number) if number in self._decoded else self._chunk(number)
        self._decoded[number] = block
        while len(self._decoded) > MOST_CHUNKS:
            self._decoded.popitem(last=False)
        return self._values(block[row])

    def every(self) -> np.ndarray:
        """All frames."""
        count = -(-self.shape[0] // self._chunks.chunk)
        blocks = [self._chunk(number) for number in range(count)]
        return self._values(np.concatenate(blocks)[: self.shape[0]])

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
        file = self._content(own.file(shard))
        shape = (own.chunk, *own.shape[1:])
        if file is None:
            return np.full(shape, own.fill, own.dtype)
        path = own.file(shard)
        first, length = (0, file.size) if own.shard == own.chunk else file.entry(row, own.shard // own.chunk, path)
        if first == NOT_THERE and length == NOT_THERE:
            return np.full(shape, own.fill, own.dtype)
        data = _checked(file.part(first, length), path)
        if len(data) < _HEADER or int.from_bytes(data[4:8], "little") != own.chunk_bytes:
            raise Damage(f"{path}: a chunk is not of the size that the array has")
        block = np.empty(shape, own.dtype)
        try:
            (_large if own.chunk_bytes > LARGE else blosc.decompress)(data, block)
        except (RuntimeError, ValueError, TypeError) as error:
            raise Damage(f"{path}: a chunk cannot be decoded ({error})") from None
        return block


class _File:
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
                raise Damage(f"{path}: is too short for its index")
            index = np.frombuffer(_checked(self.part(self.size - length, length), path), "<u8").reshape(count, 2)
            entries = index[index[:, 0] != NOT_THERE].astype(float)
            if (entries.sum(axis=1) > self.size - length).any():
                raise Damage(f"{path}: its index leads out of the file")
            self._index = index
        first, length = self._index[row].tolist()
        return first, length


def _large(data: bytes, block: np.ndarray) -> None:
    """Decode a large chunk into an array."""
    blosc2 = _blosc2()
    if blosc2 is None:
        blosc.decompress(data, block)
    else:
        blosc2.decompress2(data, dst=block, nthreads=1)


@cache
def _blosc2() -> Any:
    """blosc2, which decodes in under half the time of numcodecs, but takes a second to import; None without it."""
    try:
        import blosc2
    except ImportError:
        return None
    return blosc2


def _checked(data: bytes, path: str) -> bytes:
    """Bytes whose CRC-32C is right, without it."""
    content = data[:-_CRC]
    if len(data) < _CRC or int(google_crc32c.value(content)) != int.from_bytes(data[-_CRC:], "little"):
        raise Damage(f"{path}: its checksum is wrong: 'sonarsynth repair' restores it")
    return content


class FrameReader:
    """The arrays of a store that have frames. It can be pickled and forked: files are opened where they are read.

    path: a folder of this machine. Raises Mismatch where there is no store of this format, or for a URL.
    """

    def __init__(self, path: Folder | str) -> None:
        folder = absolute(path)
        if isinstance(folder, Remote):
            raise Mismatch(f"{folder}: frames are read from a folder of this machine: copy the store to one")
        must_be_folder(folder)
        must_be_as_laid_out(folder)
        self.root = folder
        try:
            document = json.loads(read(folder, "zarr.json"))
            self.attrs: Mapping[str, Any] = document["attributes"]
            self._members: Mapping[str, Any] = document["consolidated_metadata"]["metadata"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise Mismatch(f"{folder}: is no store of sonarsynth ({type(error).__name__}: {error})") from None
        self._open()

    def _open(self) -> None:
        self._files: OrderedDict[str, _File | None] = OrderedDict()
        self._written = WrittenFiles(self.root)
        self._arrays: dict[str, FrameArray] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_files", "_written", "_arrays")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._open()

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def attributes_of(self, name: str) -> Mapping[str, Any]:
        """Attributes of an array. Raises KeyError."""
        attributes: Mapping[str, Any] = self._members[name]["attributes"]
        return attributes

    def array(self, name: str) -> FrameArray:
        """An array by its path, such as "image/energy". Raises KeyError where there is none, Mismatch for one that
        does not lie as this version lays it."""
        if name not in self._arrays:
            self._arrays[name] = FrameArray(_chunks(name, self._members[name]), partial(_content, self))
        return self._arrays[name]

    def file(self, name: str) -> _File | None:
        """A file that stays open for a while; None where none was written. Raises Damage for one that is missing."""
        if name in self._files:
            self._files.move_to_end(name)
            return self._files[name]
        try:
            file: _File | None = _File(self.root, name)
        except FileNotFoundError:
            self._written.must_not_be_missing(name)
            file = None
        self._files[name] = file
        while len(self._files) > MOST_FILES:
            self._files.popitem(last=False)
        return file


def hold(tree: xr.DataTree, path: Folder) -> None:
    """Read the variables of frames of a tree that take at most `HELD_BYTES` each into memory, and nothing else.

    path: the store of the tree. What does not lie as this version lays it, is damaged or is at a URL stays as it is.
    """
    if isinstance(path, Remote):
        return
    reader = FrameReader(path)
    for group in tree.subtree:
        for name, variable in group.dataset.variables.items():
            stored = f"{group.path}/{name}".strip("/")
            if variable.dims[:1] == ("frame",) != (name,) and stored in reader and variable.nbytes <= HELD_BYTES:
                with suppress(Mismatch, Damage):  # xarray's own setter imports dask.array: 0.3 s
                    variable._data = reader.array(stored).every()


def _content(reader: FrameReader, name: str) -> _File | None:
    return reader.file(name)


def _chunks(path: str, metadata: Mapping[str, Any]) -> _Chunks:
    """How an array lies, by its metadata. Raises Mismatch."""
    try:
        shape, dtype = tuple(int(n) for n in metadata["shape"]), np.dtype(metadata["data_type"])
        shard = int(metadata["chunk_grid"]["configuration"]["chunk_shape"][0])
        codecs = metadata["codecs"]
        chunk = shard
        if codecs[0]["name"] == "sharding_indexed":
            chunk = int(codecs[0]["configuration"]["chunk_shape"][0])
            codecs = codecs[0]["configuration"]["codecs"]
        scale = metadata["attributes"].get("scale_factor")
        fill = np.asarray(metadata["fill_value"], float if dtype.kind == "f" else dtype).astype(dtype)[()]
        readable = [codec["name"] for codec in codecs] == ["bytes", "blosc", "crc32c"] and dtype.kind in "iuf"
        chunks = _Chunks(path, shape, dtype, shard, chunk, fill, None if scale is None else np.float32(scale))
    except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
        raise Mismatch(f"{path}: its metadata cannot be read ({type(error).__name__}: {error})") from None
    named = metadata.get("chunk_key_encoding") == {"name": "default", "configuration": {"separator": "."}}
    consistent = named and 0 < chunk <= shard and shard % chunk == 0 and min(shape, default=0) >= 0
    if not (readable and consistent and chunks.chunk_bytes <= MOST_BYTES):
        raise Mismatch(f"{path}: does not lie as sonarsynth writes it: read it with xarray")
    return chunks
