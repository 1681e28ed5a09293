"""Archives that a mesh comes in: of bounded size, without links."""

from __future__ import annotations

import io
import lzma
import zipfile
import zlib
from typing import Final

from sonarsynth.geometry.surfaces import MeshError

MAX_BYTES: Final = 1 << 28
"""What one file of an archive may unpack to."""


DAMAGED: Final = (
    OSError, EOFError, zlib.error, lzma.LZMAError, zipfile.BadZipFile, NotImplementedError, RuntimeError, ValueError,
)  # fmt: skip
"""What a damaged archive may bring."""


def only_file(data: bytes, ending: str) -> bytes:
    """The one file of that ending in a zip archive (of several the first). Raises MeshError."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = sorted(info.filename for info in archive.infolist() if info.filename.lower().endswith(ending))
            if not names:
                raise MeshError(f"is an archive without a {ending}")
            with archive.open(names[0]) as file:
                content = file.read(MAX_BYTES + 1)
    except DAMAGED as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"is an archive that cannot be unpacked ({' '.join(str(error).split())[:80]})") from None
    if len(content) > MAX_BYTES:
        raise MeshError(f"unpacks to more than {MAX_BYTES >> 20} MiB")
    return content
