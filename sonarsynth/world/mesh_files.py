"""Reading mesh files (STL, OBJ, PLY, OFF, GLB) through trimesh, and refusing what it would let pass.

trimesh gives an empty mesh for a damaged STL, fewer facets for a text file that was cut off, and the last vertex for
the index 0 of an OBJ, all without an error: what a file promises is checked here first.
"""

from __future__ import annotations

import io
import json
import logging
import os
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.world import files
from sonarsynth.world.refinement import MeshError, Surface
from sonarsynth.world.room import most_facets

MAX_BYTES = {"stl": 4 << 30, "glb": 1 << 30, "ply": 1 << 30, "obj": 1 << 29, "off": 1 << 29}
"""Text takes several times its size in memory to read."""


def read_surface(path: Path) -> Surface:
    """Vertices and faces as they stand in the file, in its own unit and axes; polygons cut in triangles.

    Raises MeshError in one line that names the file and the reason.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in PROMISES:
        raise MeshError(f"{path}: is not one of {', '.join(k.upper() for k in PROMISES)} (by its ending)")
    try:
        data = _content(path, kind)
    except files.FileError as error:
        raise MeshError(f"{path}: {error}") from None
    if not data.strip():
        raise MeshError(f"{path}: is empty")
    if reason := PROMISES[kind](data):
        raise MeshError(f"{path}: {reason}")
    vertices, faces = _load(path, kind, data)
    if vertices.ndim != 2 or vertices.shape[1:] != (3,):
        raise MeshError(f"{path}: has vertices without three coordinates")
    if faces.size == 0:
        raise MeshError(f"{path}: holds no facets")
    return vertices, faces.reshape(-1, 3)


def _content(path: Path, kind: str) -> bytes:
    """The bytes of a file; a binary STL says in its head how many facets it has, so that it need not be read to be
    refused. Raises FileError."""
    with files.opened(path) as file:
        head = file.read(84) if kind == "stl" else b""
        count, size = int.from_bytes(head[80:84], "little"), os.fstat(file.fileno()).st_size
    if len(head) == 84 and size == 84 + 50 * count and count > most_facets():
        raise files.FileError(f"has {count} facets, more than {most_facets()}")
    return files.read(path, MAX_BYTES[kind])


def _load(path: Path, kind: str, data: bytes) -> Surface:
    import trimesh

    try:
        with _silent():
            # bytes without a name: what the file may name in turn (materials, pictures, URLs) is not looked for
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
            return np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
    except Exception as error:  # whatever a reader of five formats may meet in a damaged file
        text = " ".join(str(error).split())[:120]
        raise MeshError(f"{path}: cannot be read as {kind.upper()} ({type(error).__name__}: {text})") from None


@contextmanager
def _silent() -> Iterator[None]:
    """Without warnings, and without what trimesh logs: tracebacks of what it tried first."""
    log = logging.getLogger("trimesh")
    before, log.disabled = log.disabled, True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = before


def _stl(data: bytes) -> str | None:
    """Why an STL file cannot be whole: a binary one says its length, a text one has an end."""
    size = 84 + 50 * int.from_bytes(data[80:84], "little") if len(data) >= 84 else None
    if size == len(data):
        return None
    if data.lstrip()[:5].lower() == b"solid" and b"facet" in data:
        return None if b"endsolid" in data.lower() else "is cut off: the text STL has no 'endsolid'"
    if size is None:
        return "is no STL file, or cut off"
    return f"is no STL file, or damaged: {len(data)} bytes where its header says {size}"


def _obj(data: bytes) -> str | None:
    """Why the facets of an OBJ file cannot be right: indices out of range (0 among them), or too few corners."""
    lines = data.decode("utf-8", "replace").replace("\\\n", " ").splitlines()
    count = sum(line.lstrip().startswith(("v ", "v\t")) for line in lines)
    seen = 0
    for number, line in enumerate(lines, start=1):
        kind, *words = line.split("#")[0].split() or [""]
        if kind == "v":
            seen += 1
            if len(words) < 3:
                return f"line {number}: a vertex without three coordinates"
        if kind == "f":
            try:
                corners = [int(word.split("/")[0]) for word in words]
            except ValueError:
                return f"line {number}: a facet whose corners are not numbers"
            if len(corners) < 3:
                return f"line {number}: a facet with fewer than three corners"
            if wrong := [c for c in corners if c == 0 or c > count or c < -seen]:
                return f"line {number}: index {wrong[0]} is out of range, there are {count} vertices"
    return None


def _off(data: bytes) -> str | None:
    """Why an OFF file cannot be whole: it says how many vertices and facets follow."""
    lines = [w for line in data.decode("utf-8", "replace").splitlines() if (w := line.split("#")[0].strip())]
    if not (match := re.match(r"[A-Z]*OFF\b\s*(.*)", lines[0])):
        return "is no OFF file"
    rest = ([match[1]] if match[1] else []) + lines[1:]
    counts = re.match(r"(\d+)\s+(\d+)", rest[0]) if rest else None
    if counts is None:
        return "has no counts of vertices and facets"
    promised = int(counts[1]) + int(counts[2])
    return None if len(rest) - 1 >= promised else f"is cut off: {len(rest) - 1} lines where its header says {promised}"


def _ply(data: bytes) -> str | None:
    """Why a text PLY file cannot be whole: it says how many lines follow. (A binary one is checked by its reader.)"""
    header, end, body = data.partition(b"end_header")
    if not data.startswith(b"ply") or not end:
        return "is no PLY file, or cut off in its header"
    if b"format ascii" not in header:
        return None
    promised = sum(int(n) for n in re.findall(rb"^\s*element\s+\S+\s+(\d+)", header, re.MULTILINE))
    found = sum(bool(line.strip()) for line in body.splitlines())
    return None if found >= promised else f"is cut off: {found} lines where its header says {promised}"


def _glb(data: bytes) -> str | None:
    """Why a GLB file cannot be whole: it says its length."""
    if data[:4] != b"glTF" or len(data) < 12:
        return "is no GLB file"
    size = int.from_bytes(data[8:12], "little")
    if len(data) < size:
        return f"is cut off: {len(data)} bytes where its header says {size}"
    length = int.from_bytes(data[12:16], "little")
    try:
        tree = json.loads(data[20 : 20 + length])
        return _absurd(tree)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        return f"cannot be read as GLB ({type(error).__name__} in its description)"


def _absurd(tree: dict[str, Any]) -> str | None:
    """Why the description in a GLB file cannot be believed: numbers that stand nowhere, a mesh placed without end."""
    for number, accessor in enumerate(tree.get("accessors", [])):
        if "bufferView" not in accessor:
            return f"accessor {number} has {accessor['count']} values that are not in the file"
    nodes = tree.get("nodes", [])
    placed = sorted(child for node in nodes for child in node.get("children", []))
    if len(set(placed)) < len(placed):
        return "has a node that is in two places"
    facets = [
        sum(int(tree["accessors"][p.get("indices", p["attributes"]["POSITION"])]["count"]) for p in mesh["primitives"])
        for mesh in tree.get("meshes", [])
    ]
    total = sum(facets[node["mesh"]] for node in nodes if "mesh" in node)
    return f"places {total} corners, more than of {most_facets()} facets" if total > 3 * most_facets() else None


PROMISES: dict[str, Callable[[bytes], str | None]] = {"stl": _stl, "obj": _obj, "ply": _ply, "off": _off, "glb": _glb}
"""Per format: the reason why a file is not what it says, or None."""
