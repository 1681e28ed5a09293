"""Reading chunks of a store as zarr does, but that a file which cannot be decoded, or is missing, raises by its name.

zarr does not say in which file a checksum is wrong, and takes a file that is not there for one of fill values.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from zarr.abc.store import Store
from zarr.core.codec_pipeline import BatchedCodecPipeline
from zarr.registry import register_pipeline
from zarr.storage import WrapperStore

from sonarsynth.store.files.place import Folder, opens
from sonarsynth.store.marks import Damage, WrittenFiles

if TYPE_CHECKING:
    from zarr.abc.store import ByteRequest
    from zarr.core.buffer import Buffer, BufferPrototype

NAMING = {"codec_pipeline.path": "sonarsynth.store.files.decoding.NamingPipeline"}
"""Setting of zarr under which arrays are opened that are read so."""


class NamingPipeline(BatchedCodecPipeline):
    """That of zarr, with the name of the file in its errors."""

    async def read_batch(self, batch_info: Iterable[Any], out: Any, drop_axes: tuple[int, ...] = ()) -> None:
        """Decode some chunks into `out`."""
        chunks = list(batch_info)
        try:
            await super().read_batch(chunks, out, drop_axes)
        except Damage:
            raise
        except (ValueError, RuntimeError) as error:
            reason = str(error).split(".")[0]
            files = ", ".join(str(chunk[0]).removeprefix("file://") for chunk in chunks)
            raise Damage(f"{files}: the file is damaged: 'sonarsynth repair' rebuilds it ({reason})") from error


register_pipeline(NamingPipeline)


class WholeReads(WrapperStore[Store]):
    """A store as zarr and xarray open it, to read: a file that is not there was not written, by the marks."""

    def __init__(self, store: Store, written: WrittenFiles) -> None:
        super().__init__(store)
        self._written = written

    def _with_store(self, store: Store) -> WholeReads:
        return WholeReads(store, self._written)

    def __str__(self) -> str:
        return str(self._store)

    async def get(self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None) -> Buffer | None:
        """The content of a file, or a part of it; None where none was written. Raises Damage."""
        content = await self._store.get(key, prototype, byte_range)
        if content is None and key.rpartition("/")[2].partition(".")[0] == "c":
            await asyncio.to_thread(self._written.must_not_be_missing, key)
        return content

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, ByteRequest | None]]
    ) -> list[Buffer | None]:
        """Parts of files."""
        return [await self.get(key, prototype, part) for key, part in key_ranges]


def opens_whole(folder: Folder) -> Any:
    """What zarr and xarray open, to read, as `opens`, where nothing may be missing."""
    return WholeReads(opens(folder), WrittenFiles(folder))
