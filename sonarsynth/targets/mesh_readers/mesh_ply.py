"""PLY files: vertices and polygons, of text or binary of either byte order, with whatever else they hold beside them.

trimesh takes the first facet's number of corners for that of all in a binary file (right lengths by chance pass) and
the second line for the format; so the header is read here, and followed to the last byte.

Turk (1994), "The PLY polygon file format".
"""

from __future__ import annotations

import re
import struct
import warnings
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Ints
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.mesh_text import polygons

TYPES: Final = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS: Final = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER: Final = re.compile(rb"ply[ \t]*(\r\n|\r|\n)")


@dataclass
class _Element:
    """What the header says of one kind of thing: how many there are, and their properties in order."""

    name: str
    count: int
    scalars: dict[str, str] = field(default_factory=dict)  # types, as NumPy writes them
    lists: dict[str, tuple[str, str]] = field(default_factory=dict)  # of the count, and of the members
    order: list[str] = field(default_factory=list)


def read_ply(data: bytes) -> Surface:
    """Vertices and triangles. Raises MeshError."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    start = _HEADER.match(data)
    end = start and re.compile(rb"(?:\r|\n)[ \t]*end_header[ \t]*(?:" + start[1] + rb"|$)").search(data)
    if not start or not end:
        raise MeshError("is no PLY file, or cut off in its header")
    kind, elements = _header(data[start.end() : end.start()])
    body, as_written = data[end.end() :], elements
    if kind == "ascii":
        body = _text(body)
        elements = [_all_double(e) for e in elements]
    offset, columns = 0, {}
    for element in elements:
        try:
            columns[element.name], offset = _rows(element, body, offset, ORDERS[kind])
        except (struct.error, ValueError, OverflowError, MemoryError) as error:
            reason = "its numbers end before" if isinstance(error, struct.error) else error
            raise MeshError(f"is cut off, or damaged, in its element '{element.name}' ({reason})") from None
    if offset != len(body):
        over = f"{(len(body) - offset) // 8} numbers" if kind == "ascii" else f"{len(body) - offset} bytes"
        raise MeshError(f"holds {over} more than its header says")
    return _surface(as_written, columns)


def _header(text: bytes) -> tuple[str, list[_Element]]:
    """Format and elements. Raises MeshError."""
    kind, elements = "", list[_Element]()
    for line in text.decode("ascii", "replace").splitlines():
        match line.split():
            case [] | ["comment" | "obj_info", *_]:
                continue
            case ["format", name, "1.0"] if name in ORDERS and not kind:
                kind = name
            case ["element", name, count] if count.isdecimal() and name not in [e.name for e in elements]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", many, of, name] if many in TYPES and of in TYPES and elements:
                elements[-1].lists[name] = TYPES[many], TYPES[of]
                elements[-1].order.append(name)
            case ["property", of, name] if of in TYPES and elements:
                elements[-1].scalars[name] = TYPES[of]
                elements[-1].order.append(name)
            case _:
                raise MeshError(f"has a line in its header that no PLY has: '{line.strip()[:60]}'")
    if not kind or any(len(set(e.order)) < len(e.order) for e in elements):
        raise MeshError("has no format in its header" if not kind else "has a property twice in its header")
    return kind, elements


def _text(body: bytes) -> bytes:
    """The numbers of a text, as the bytes of doubles: then it is read as a binary one is."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # older NumPy stops at what is no number, with a warning
        try:
            return np.fromstring(body, dtype="<f8", sep=" ").tobytes() if body.strip() else b""
        except (ValueError, DeprecationWarning):
            raise MeshError("has words among its numbers") from None


def _all_double(element: _Element) -> _Element:
    return _Element(
        element.name,
        element.count,
        dict.fromkeys(element.scalars, "f8"),
        dict.fromkeys(element.lists, ("f8", "f8")),
        element.order,
    )


def _rows(element: _Element, body: bytes, offset: int, order: str) -> tuple[dict[str, Any], int]:
    """Columns of an element that begins at a byte, and where the next one begins: a scalar's is an array, a list's its
    counts and all its members in a row. Raises ValueError or struct.error where the body ends before."""
    if not element.count or not element.order:
        return {name: (np.empty(0, int), np.empty(0)) for name in element.order}, offset
    first, _ = _row(element, body, offset, order)
    counts = {name: len(first[name]) for name in element.lists}
    alike: list[Any] = []
    for name in element.order:
        if name in element.lists:
            count_dtype, dtype = element.lists[name]
            alike += [(f"{name} count", order + count_dtype), (name, order + dtype, (counts[name],))]
        else:
            alike.append((name, order + element.scalars[name]))
    size = np.dtype(alike).itemsize
    if element.count * size <= len(body) - offset:
        table = np.frombuffer(body, alike, element.count, offset)
        if all((table[f"{name} count"] == counts[name]).all() for name in counts):  # then all rows begin where they do
            columns = {
                name: (np.full(element.count, counts[name]), table[name].ravel()) if name in counts else table[name]
                for name in element.order
            }
            return columns, offset + element.count * size
    return _one_by_one(element, body, offset, order)


def _one_by_one(element: _Element, body: bytes, offset: int, order: str) -> tuple[dict[str, Any], int]:
    """As `_rows`, of lists of different lengths."""
    members: dict[str, list[Any]] = {name: [] for name in element.order}
    counts: dict[str, list[int]] = {name: [] for name in element.lists}
    for number in range(element.count):
        if offset >= len(body):
            raise ValueError(f"{number} of {element.count} are there")
        row, offset = _row(element, body, offset, order)
        for name, values in row.items():
            members[name].extend(values)
            if name in counts:
                counts[name].append(len(values))
    columns = {name: np.array(values) for name, values in members.items()}
    return {n: (np.array(counts[n], np.int64), c) if n in counts else c for n, c in columns.items()}, offset


def _row(element: _Element, body: bytes, offset: int, order: str) -> tuple[dict[str, tuple[Any, ...]], int]:
    """Values of the row that begins at a byte, and where the next one begins."""
    values = {}
    for name in element.order:
        count, dtype = 1, element.scalars.get(name, "")
        if name in element.lists:
            count_dtype, dtype = element.lists[name]
            (length,) = struct.unpack_from(order + np.dtype(count_dtype).char, body, offset)
            if length != length // 1 or not 0 <= length <= len(body):
                raise ValueError(f"a list of {length:g}")
            count, offset = int(length), offset + np.dtype(count_dtype).itemsize
        values[name] = struct.unpack_from(f"{order}{count}{np.dtype(dtype).char}", body, offset)
        offset += count * np.dtype(dtype).itemsize
    return values, offset


def _surface(elements: list[_Element], columns: dict[str, Any]) -> Surface:
    by_name = {element.name: element for element in elements}
    if (strips := by_name.get("tristrips")) and strips.count:
        raise MeshError("holds strips of triangles ('tristrips'), which are not read: save it with faces")
    vertex, face = by_name.get("vertex"), by_name.get("face")
    if vertex is None or not {"x", "y", "z"} <= set(vertex.scalars):
        raise MeshError("has no vertices with x, y and z")
    if face is None or not face.count:
        raise MeshError("holds no facets")
    named = [name for name in face.lists if name in ("vertex_indices", "vertex_index")] or list(face.lists)
    if len(named) != 1:
        raise MeshError("does not say which list of a face holds its corners ('vertex_indices')")
    vertices = np.stack([columns["vertex"][axis].astype(float) for axis in "xyz"], axis=-1)
    counts, corners = columns["face"][named[0]]
    if (few := counts < 3).any():
        raise MeshError(f"facet {int(np.argmax(few))} has fewer than three corners")
    return vertices, polygons(vertices, counts, _indices(corners, counts, len(vertices)))


def _indices(corners: npt.NDArray[Any], counts: Ints, count: int) -> Ints:
    """Raises MeshError where a corner is not the number of a vertex."""
    wrong = ~((corners >= 0) & (corners < count) & (corners == np.floor(corners)))
    if wrong.any():
        facet = int(np.searchsorted(np.cumsum(counts), int(np.argmax(wrong)), side="right"))
        raise MeshError(f"facet {facet} has index {corners[wrong][0]:g}, out of range: there are {count} vertices")
    return corners.astype(np.int64)
