"""Mesh files of text: OBJ, OFF and the text STL, in every spelling that their formats allow.

trimesh reads relative indices of an OBJ from the end of the whole file, loses a vertex after a byte-order mark, fans
concave polygons, and ends a text STL at the first word that it does not know, all without an error: so these are read
here, whole or not at all.

OBJ: Wavefront Advanced Visualizer, appendix B1. OFF: Geomview manual, "OFF Files". STL: 3D Systems (1989).
"""

from __future__ import annotations

import re
from array import array
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.polygons import PolygonError, triangles

UNREAD: Final = {
    b"surf": "a curved surface: only facets are read",
    b"bzp": "a Bezier patch: only facets are read",
    b"bsp": "a B-spline patch: only facets are read",
    b"cdc": "a Cardinal patch: only facets are read",
    b"res": "a patch: only facets are read",
    b"call": "another file is named: give one file that holds all",
    b"csh": "a command: give one file that holds all",
    b"F": "'F' is no statement: small letters",
    b"V": "'V' is no statement: small letters",
}
"""Statements of an OBJ that cannot be left out without changing the body."""
_STL_WORDS: Final = {
    0: b"facet",
    1: b"normal",
    5: b"outer",
    6: b"loop",
    19: b"endloop",
    20: b"endfacet",
} | dict.fromkeys((7, 11, 15), b"vertex")
"""Where the words of a facet stand among its 21."""


def lines_of(data: bytes) -> list[bytes]:
    """Lines by any of the three line ends, without a byte-order mark."""
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")


def numbers(words: list[bytes], kind: type[float] = float) -> list[float]:
    """Raises ValueError for what is no number; '1_0' is none."""
    if b"_" in b"".join(words):
        raise ValueError("digits with an underscore")
    return [kind(word) for word in words]


def _statements(data: bytes) -> list[tuple[int, bytes]]:
    """Lines of an OBJ with their numbers, without comments, those that end in '\\' joined with the next. A comment goes
    to the end of its line, '\\' or not."""
    statements, begun, first = [], b"", 0
    for number, line in enumerate(lines_of(data), start=1):
        text, mark, _ = line.partition(b"#")
        begun, first = begun + text, first or number
        if text.endswith(b"\\") and not mark:
            begun = begun[:-1] + b" "
            continue
        if begun.strip():
            statements.append((first, begun))
        begun, first = b"", 0
    return [*statements, (first, begun)] if begun.strip() else statements


def read_obj(data: bytes) -> Surface:
    """Vertices and triangles of an OBJ; groups and objects together. Raises MeshError with the line."""
    places, corners, counts, rows = array("d"), array("q"), array("q"), array("q")
    for number, line in _statements(data):
        kind, *words = line.split()
        if kind == b"v":
            places.extend(_vertex(number, words))
        elif kind in (b"f", b"fo"):
            facet_corners = _corners(number, words, len(places) // 3)
            corners.extend(facet_corners)
            counts.append(len(facet_corners))
            rows.append(number)
        elif reason := UNREAD.get(kind):
            raise MeshError(f"line {number}: {reason}")
    vertices = np.frombuffer(places, float).reshape(-1, 3) if places else np.empty((0, 3))
    flat = np.array(corners, np.int64)
    if (wrong := flat >= len(vertices)).any():  # vertices may follow the facets that use them
        facet = int(np.searchsorted(np.cumsum(counts), int(np.argmax(wrong)), side="right"))
        index = int(flat[wrong][0]) + 1
        raise MeshError(f"line {rows[facet]}: index {index} is out of range, there are {len(vertices)} vertices")
    try:
        return vertices.copy(), triangles(vertices, np.array(counts, np.int64), flat)
    except PolygonError as error:
        raise MeshError(f"line {rows[error.number]}: {error}") from None


def _vertex(number: int, words: list[bytes]) -> list[float]:
    if len(words) < 3:
        raise MeshError(f"line {number}: a vertex without three coordinates")
    try:
        return numbers(words[:3])
    except ValueError:
        raise MeshError(f"line {number}: a vertex whose coordinates are not numbers") from None


def _corners(number: int, words: list[bytes], vertices: int) -> list[int]:
    """Vertices from 0 of a facet; a negative index counts back from the last vertex before it."""
    try:
        indices = [int(n) for n in numbers([word.split(b"/", 1)[0] for word in words], int)]
    except ValueError:
        raise MeshError(f"line {number}: a facet whose corners are not numbers") from None
    if len(indices) < 3:
        raise MeshError(f"line {number}: a facet with fewer than three corners")
    if wrong := [g for g in indices if g == 0 or g < -vertices or g > 1 << 40]:
        raise MeshError(f"line {number}: index {wrong[0]} is out of range, there are {vertices} vertices before it")
    return [g - 1 if g > 0 else vertices + g for g in indices]


def read_off(data: bytes) -> Surface:
    """Vertices and triangles of an OFF (COFF, NOFF, ...), with its numbers line by line, or all in a row.
    Raises MeshError."""
    lines = [words for line in lines_of(data) if (words := line.split(b"#", 1)[0].split())]
    if not lines or not (match := re.fullmatch(rb"(ST)?C?N?(4?)(n?)OFF", lines[0][0])):
        raise MeshError("is no OFF file")
    if match[2] or match[3] or b"BINARY" in lines[0]:
        raise MeshError("is an OFF file of four dimensions, of n, or a binary one: those are not read")
    lines = [lines[0][1:], *lines[1:]] if lines[0][1:] else lines[1:]
    counts = lines[0] if lines else []
    if len(counts) < 2 or not all(word.isdigit() for word in counts[:2]):
        raise MeshError("has no counts of vertices and facets")
    of_vertices, of_facets = int(counts[0]), int(counts[1])
    rows = ([counts[3:]] if counts[3:] else []) + lines[1:]
    try:
        if len(rows) == of_vertices + of_facets and all(len(row) >= 3 for row in rows[:of_vertices]):
            vertices = [numbers(row[:3]) for row in rows[:of_vertices]]
            facets = [_off_facet(row) for row in rows[of_vertices:]]
        else:
            vertices, facets = _off_in_a_row(rows, of_vertices, of_facets)
    except ValueError as error:
        raise MeshError(f"cannot be read as OFF ({error})") from None
    places = np.array(vertices, float).reshape(-1, 3)
    return places, _checked(places, facets)


def _off_facet(row: list[bytes]) -> list[int]:
    """Corners of a facet: how many, which; a colour may follow."""
    count = int(row[0])
    if count < 3 or len(row) < 1 + count:
        raise ValueError(f"a facet says that it has {count} corners, {len(row) - 1} numbers follow")
    return [int(n) for n in numbers(row[1 : 1 + count], int)]


def _off_in_a_row(
    rows: list[list[bytes]], of_vertices: int, of_facets: int
) -> tuple[list[list[float]], list[list[int]]]:
    """The numbers of an OFF that minds no line ends: no colours then, and not one number over."""
    promised = f"{len(rows)} lines where its header says {of_vertices + of_facets}"
    words = [word for row in rows for word in row]
    position, facets = 3 * of_vertices, []
    if len(words) < position + 4 * of_facets:
        raise MeshError(f"is cut off: {promised}")
    for _ in range(of_facets):
        if position >= len(words):
            raise MeshError(f"is cut off: {promised}")
        facets.append(_off_facet(words[position : position + 1 + min(int(words[position]), len(words))]))
        position += 1 + len(facets[-1])
    if position != len(words):
        raise MeshError(f"holds more than it says: {promised}")
    return [numbers(words[n : n + 3]) for n in range(0, 3 * of_vertices, 3)], facets


def _checked(vertices: Floats, facets: list[list[int]]) -> Ints:
    """Triangles of facets given by their corners from 0. Raises MeshError with the number of the facet."""
    counts, flat = np.array([len(f) for f in facets], np.int64), np.array([c for f in facets for c in f], object)
    for position in np.flatnonzero([not 0 <= c < len(vertices) for c in flat])[:1]:
        facet = int(np.searchsorted(np.cumsum(counts), position, side="right"))
        raise MeshError(f"facet {facet} has index {flat[position]}, out of range: there are {len(vertices)} vertices")
    return polygons(vertices, counts, flat.astype(np.int64))


def polygons(vertices: Floats, counts: Ints, corners: Ints) -> Ints:
    """`triangles`, raising MeshError with the number of the facet."""
    try:
        return triangles(vertices, counts, corners)
    except PolygonError as error:
        raise MeshError(f"facet {error.number}: {error}") from None


def read_text_stl(data: bytes) -> Surface:
    """Vertices, three a facet, of a text STL of any number of solids. Raises MeshError."""
    body = []
    for number, line in enumerate(lines_of(data.lower()), start=1):
        if not line.lstrip().startswith((b"solid", b"endsolid")):
            body.append(line)
        elif re.search(rb"\b(facet\s+normal|vertex(\s+[-+.\d]\S*){3})", line):
            raise MeshError(f"line {number}: facets in the line of a 'solid'; it must be a line of its own")
    words = b" ".join(body).split()
    if max(map(len, words), default=0) > 64:
        raise MeshError("cannot be read as STL (a word of more than 64 letters)")
    table = np.array(words[: len(words) // 21 * 21]).reshape(-1, 21)
    wrong = np.any([table[:, n] != word for n, word in _STL_WORDS.items()], axis=0) if len(table) else np.zeros(0, bool)
    if wrong.any() or len(words) % 21:
        facet = int(np.argmax(wrong)) if wrong.any() else len(table)
        raise MeshError(f"facet {facet} is not a 'facet normal', an 'outer loop' of three 'vertex', and their ends")
    try:
        places = numbers([word for row in table[:, [8, 9, 10, 12, 13, 14, 16, 17, 18]].tolist() for word in row])
    except ValueError as error:
        raise MeshError(f"cannot be read as STL ({error})") from None
    vertices = np.array(places, float).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def read_corners(data: bytes) -> Surface:
    """Vertices, three a facet, of a text of three lines a facet, each the x, y and z of a corner. Raises MeshError."""
    rows = [
        (i, words)
        for i, line in enumerate(lines_of(data), start=1)
        if (words := re.split(rb"[\s,]+", line.strip())) != [b""]
    ]
    if bad := next((i for i, words in rows if len(words) != 3), None):
        raise MeshError(f"line {bad}: is not the x, y and z of a corner")
    if len(rows) % 3:
        raise MeshError(f"has {len(rows)} corners, not three for each facet")
    try:
        places = [numbers(words) for _, words in rows]
    except ValueError as error:
        raise MeshError(f"cannot be read as corners of facets ({str(error)[:60]})") from None
    vertices = np.array(places, float).reshape(-1, 3)
    return vertices, np.arange(len(vertices)).reshape(-1, 3)
