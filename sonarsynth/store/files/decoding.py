"""Reading a store as zarr does, but that a file which cannot be decoded, or is missing, raises by its name, and that
arrays of frames on a disk are read without zarr.

zarr does not say in which file a checksum is wrong, and takes a file that is not there for one of fill values.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from xarray.backends import BackendArray
from xarray.core import indexing
from zarr.abc.store import Store
from zarr.core.codec_pipeline import BatchedCodecPipeline
from zarr.registry import register_pipeline
from zarr.storage import WrapperStore

from sonarsynth.store.files.place import Folder, opens, read_json
from sonarsynth.store.files.remote import Remote
from sonarsynth.store.files.within import Mismatch
from sonarsynth.store.frame_arrays import MOST_BYTES, Chunks, FrameArray, as_laid, file_of
from sonarsynth.store.marks import Damage, WrittenFiles

if TYPE_CHECKING:
    import xarray as xr
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


class FramesOnDisk(BackendArray):
    """An array of frames that xarray reads lazily: each file anew and once, so that threads share nothing, and what a
    build has written since is read."""

    def __init__(self, folder: Path, chunks: Chunks, written: WrittenFiles) -> None:
        self.shape, self.dtype = chunks.shape, chunks.dtype
        self._chunks, self._file_of = chunks, partial(file_of, folder, written)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        outer = indexing.IndexingSupport.OUTER
        return np.asarray(indexing.explicit_indexing_adapter(key, self.shape, outer, self._taken))

    async def async_getitem(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        """The same, in another thread."""
        return await asyncio.to_thread(self.__getitem__, key)

    def _taken(self, key: tuple[Any, ...]) -> np.ndarray:
        """What an index of each axis takes: a number, a slice, or several numbers."""
        frames = np.arange(self.shape[0])[key[0]]
        array = FrameArray(self._chunks, lru_cache(1)(self._file_of), MOST_BYTES)  # blosc2 takes 0.7 s to import
        values = array.stored(np.atleast_1d(frames), key[1:])
        return values if frames.ndim else values[0]


def read_from_disk(tree: xr.DataTree, folder: Folder) -> None:
    """Have the arrays of frames of a tree, as zarr has opened it, read without zarr: the points of 100 000 frames take
    2 s of one core so, and 19 otherwise. What does not lie as this version lays it stays with zarr, and what is at a
    URL."""
    if isinstance(folder, Remote):
        return
    members = (read_json(folder, "zarr.json").get("consolidated_metadata") or {}).get("metadata", {})
    written = WrittenFiles(folder)
    for group in tree.subtree:
        for name, variable in group.dataset.variables.items():
            metadata = members.get(path := f"{group.path}/{name}".strip("/"), {})
            with suppress(Mismatch):
                chunks = as_laid(path, metadata)
                if chunks.shape == variable.shape and variable.dims[0] == "frame" != name:
                    lazy: Any = indexing.LazilyIndexedArray(FramesOnDisk(folder, chunks, written))
                    array: Any = indexing.MemoryCachedArray(indexing.CopyOnWriteArray(lazy))  # type: ignore[no-untyped-call]
                    variable._data = array  # xarray's own setter imports dask.array: 0.3 s


def opens_whole(folder: Folder) -> Any:
    """What zarr and xarray open, to read, as `opens`, where nothing may be missing."""
    return WholeReads(opens(folder), WrittenFiles(folder))
