"""XML of files that a recipe names: without entities and documents elsewhere."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from sonarsynth.description.named_files import FileError


def plain_xml(data: bytes) -> bytes:
    """The same XML, which declares no entities: they can swell without end, or name other files. Raises FileError."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        data = re.sub(rb"encoding=[\"'][^\"']*[\"']", b"", data.decode("utf-16", "replace").encode(), count=1)
    if b"\0" in data:
        raise FileError("is not XML in UTF-8, or in UTF-16 with its mark")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise FileError("declares a document type or entities, which are not read")
    return data


def parsed_xml(data: bytes) -> ElementTree.Element:
    """The root of an XML document. Raises FileError."""
    try:
        return ElementTree.fromstring(plain_xml(data))
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        raise FileError(f"is not XML ({' '.join(str(error).split())[:80]})") from None
