"""A store on a disk as zarr and xarray read it: by `within`, and as Zarr 3 alone.

zarr itself follows links. It also reads Zarr 2, whose filters may be any codec that is installed, pickle too.
"""

from __future__ import annotations

import asyncio
import io
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from zarr.abc.store import OffsetByteRequest, RangeByteRequest, SuffixByteRequest
from zarr.core.buffer.core import default_buffer_prototype
from zarr.storage import LocalStore

from sonarsynth.store.files import within

if TYPE_CHECKING:
    from zarr.abc.store import ByteRequest
    from zarr.core.buffer import Buffer, BufferPrototype


class GuardedReads(LocalStore):
    """Reads what is within its root."""

    async def get(
        self, key: str, prototype: BufferPrototype | None = None, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        """The content of a file, or a part of it; None where there is none."""
        return await asyncio.to_thread(self._content, key, prototype, byte_range)

    def get_sync(
        self, key: str, *, prototype: BufferPrototype | None = None, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        """The same, in this thread."""
        return self._content(key, prototype, byte_range)

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, ByteRequest | None]]
    ) -> list[Buffer | None]:
        """Parts of files."""
        return [await self.get(key, prototype, part) for key, part in key_ranges]

    def _content(self, key: str, prototype: BufferPrototype | None, byte_range: ByteRequest | None) -> Buffer | None:
        if key.rpartition("/")[2].startswith(".z"):
            return None
        try:
            with within.opened(self.root, key) as file:
                data = _part(file, byte_range)
        except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
            return None
        return (prototype or default_buffer_prototype()).buffer.from_bytes(data)


def _part(file: Any, byte_range: ByteRequest | None) -> bytes:
    """A part of a file, as zarr asks for it."""
    length = -1
    if isinstance(byte_range, RangeByteRequest):
        file.seek(byte_range.start)
        length = byte_range.end - byte_range.start
    elif isinstance(byte_range, OffsetByteRequest):
        file.seek(byte_range.offset)
    elif isinstance(byte_range, SuffixByteRequest):
        file.seek(max(0, file.seek(0, io.SEEK_END) - byte_range.suffix))
    content: bytes = file.read(length)
    return content
