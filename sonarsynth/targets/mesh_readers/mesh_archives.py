"""Archives and XML that a mesh comes in: of bounded size, without links, entities and documents elsewhere."""

from __future__ import annotations

import io
import lzma
import re
import zipfile
import zlib
from typing import Final
from xml.etree import ElementTree

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
                found = file.read(MAX_BYTES + 1)
    except DAMAGED as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"is an archive that cannot be unpacked ({' '.join(str(error).split())[:80]})") from None
    if len(found) > MAX_BYTES:
        raise MeshError(f"unpacks to more than {MAX_BYTES >> 20} MiB")
    return found


def plain_xml(data: bytes) -> bytes:
    """The same XML, which declares no entities: they can swell without end, or name other files. Raises MeshError."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = re.sub(rb"encoding=[\"'][^\"']*[\"']", b"", data.decode("utf-16", "replace").encode(), count=1)
    if b"\0" in data:
        raise MeshError("is not XML in UTF-8, or in UTF-16 with its mark")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise MeshError("declares a document type or entities, which are not read")
    return data


def parsed_xml(data: bytes) -> ElementTree.Element:
    """The root of an XML document. Raises MeshError."""
    try:
        return ElementTree.fromstring(plain_xml(data))
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        raise MeshError(f"is not XML ({' '.join(str(error).split())[:80]})") from None
