"""Decoding chunks of a store as zarr does, with the name of the file that cannot be decoded in the error."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from zarr.core.codec_pipeline import BatchedCodecPipeline
from zarr.registry import register_pipeline

NAMING = {"codec_pipeline.path": "sonarsynth.store.files.decoding.NamingPipeline"}
"""Setting of zarr under which arrays are opened that are read so."""


class DamagedFile(ValueError):
    """A file of a store that cannot be decoded; str() is one line."""


class NamingPipeline(BatchedCodecPipeline):
    """That of zarr, whose errors, as of a checksum, do not say in which file."""

    async def read_batch(self, batch_info: Iterable[Any], out: Any, drop_axes: tuple[int, ...] = ()) -> None:
        """Decode some chunks into `out`."""
        chunks = list(batch_info)
        try:
            await super().read_batch(chunks, out, drop_axes)
        except (ValueError, RuntimeError) as error:
            reason = str(error).split(".")[0]
            files = ", ".join(str(chunk[0]).removeprefix("file://") for chunk in chunks)
            raise DamagedFile(f"{files}: the file is damaged: 'sonarsynth repair' rebuilds it ({reason})") from error


register_pipeline(NamingPipeline)
