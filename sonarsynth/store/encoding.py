"""A shard of an array as the bytes of its file, by the Zarr v3 specification: what zarr itself writes, to the byte.

zarr takes about 1 ms of Python a file, whatever its size; a shard has some sixty. Readers use zarr.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import google_crc32c
import numpy as np
from numcodecs import blosc
from numcodecs.vlen import VLenUTF8

if TYPE_CHECKING:
    from sonarsynth.store.layout import ArrayLayout

PLAIN: Final = {"cname": "lz4", "clevel": 5, "shuffle": "shuffle", "blocksize": 0}
"""How blosc compresses what is no signal: the bytes of numbers that are like their neighbours or all fill value."""
FLOATS: Final = {"cname": "lz4", "clevel": 5, "shuffle": "bitshuffle", "blocksize": 0}
"""Of signals in numbers with a point. Zstd takes three times as long to write and to read, for no fewer bytes."""
COUNTS: Final = {"cname": "zstd", "clevel": 1, "shuffle": "bitshuffle", "blocksize": 2**20}
"""Of a converter's counts. lz4 takes half to three quarters of the time, for 15 % more bytes of noisy ones, 65 % more
of a silent sea. In the usual blocks of 32 kB zstd takes half as long again or more, to read twice as long."""


def compression(array: ArrayLayout) -> dict[str, Any]:
    """How blosc compresses an array, in the words of its metadata."""
    if "sample" not in array.variable.dims:
        return PLAIN
    return COUNTS if array.dtype.kind == "i" else FLOATS


_SHUFFLES: Final = {"bitshuffle": blosc.BITSHUFFLE, "shuffle": blosc.SHUFFLE}

NOT_THERE: Final = np.iinfo(np.uint64).max
"""Offset and length of a chunk that is left out of a shard, all fill value."""


def encoded(array: ArrayLayout, chunks: Sequence[np.ndarray]) -> bytes | None:
    """The file of a shard from its chunks (frame, ...); None for fill values only, which have no file.

    A chunk is the frames' numbers, little-endian, in C order, compressed by blosc, with a CRC-32C. A shard of several
    is its chunks, but those of fill values only, and an index of their offsets and lengths, with a CRC-32C. A last
    shard with fewer frames than others has no more chunks; a chunk with fewer is filled up.
    """
    packed = [None if array.is_fill(chunk) else _chunk(array, chunk) for chunk in chunks]
    stored = [chunk_bytes for chunk_bytes in packed if chunk_bytes is not None]
    if array.chunk == array.shard or not stored:
        return stored[0] if stored else None
    index = np.full((array.shard // array.chunk, 2), NOT_THERE, "<u8")
    at = 0
    for row, chunk_bytes in zip(index, packed, strict=False):
        if chunk_bytes is not None:
            row[:] = at, len(chunk_bytes)
            at += len(chunk_bytes)
    return b"".join([*stored, _checked(index.tobytes())])


def _chunk(array: ArrayLayout, frames: np.ndarray) -> bytes:
    """Some frames, filled up to a chunk, compressed."""
    numbers = np.ascontiguousarray(frames, array.dtype.newbyteorder("<"))
    if len(numbers) < array.chunk:
        fill = np.full((array.chunk - len(numbers), *numbers.shape[1:]), array.variable.fill, numbers.dtype)
        numbers = np.concatenate([numbers, fill])
    return _compressed(numbers, compression(array))


def encoded_whole(values: np.ndarray) -> bytes:
    """The file of an array in one chunk that no frame changes: numbers, or text as UTF-8."""
    if values.dtype.kind == "U":
        return _checked(bytes(VLenUTF8().encode(values.astype(object))))
    return _compressed(np.ascontiguousarray(values, values.dtype.newbyteorder("<")), PLAIN)


def _compressed(numbers: np.ndarray, how: dict[str, Any]) -> bytes:
    """Numbers as blosc packs them, in one of the ways above."""
    blosc.use_threads = False  # as zarr has it: several threads put blocks into a file in the order in which they end
    name, shuffle = how["cname"].encode(), _SHUFFLES[how["shuffle"]]
    return _checked(bytes(blosc.compress(numbers, name, how["clevel"], shuffle, how["blocksize"])))


def _checked(data: bytes) -> bytes:
    """Bytes with their CRC-32C, little-endian."""
    return data + int(google_crc32c.value(data)).to_bytes(4, "little")
