"""Reading mesh files: OBJ, OFF, PLY and text STL by our own readers, binary STL and GLB through trimesh.

trimesh misreads legal files of the former without an error (`mesh_text`, `mesh_ply`), and gives an empty mesh for a
damaged STL; of a GLB it leaves out what it does not know. What a file promises is checked here first.
"""

from __future__ import annotations

import io
import json
import logging
import os
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sonarsynth.description import named_files
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.mesh_ply import read_ply
from sonarsynth.targets.mesh_readers.mesh_text import read_obj, read_off, read_text_stl

MAX_BYTES = {"stl": 4 << 30, "glb": 1 << 30, "ply": 1 << 30, "obj": 1 << 29, "off": 1 << 29}
"""Text takes several times its size in memory to read."""
FANS = 6
"""The mode of a primitive in a GLB."""


def read_surface(path: Path) -> Surface:
    """Vertices and faces as they stand in the file, in its own unit and axes; polygons cut in triangles.

    Raises MeshError in one line that names the file and the reason.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in READERS:
        raise MeshError(f"{path}: is not one of {', '.join(k.upper() for k in READERS)} (by its ending)")
    try:
        data = _content(path, kind)
    except named_files.FileError as error:
        raise MeshError(f"{path}: {error}") from None
    if not data.strip():
        raise MeshError(f"{path}: is empty")
    try:
        vertices, faces = READERS[kind](data)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    if vertices.ndim != 2 or vertices.shape[1:] != (3,):
        raise MeshError(f"{path}: has vertices without three coordinates")
    if faces.size == 0:
        raise MeshError(f"{path}: holds no facets")
    return vertices, faces.reshape(-1, 3)


def _content(path: Path, kind: str) -> bytes:
    """The bytes of a file; a binary STL says in its head how many facets it has, so that it need not be read to be
    refused. Raises FileError."""
    with named_files.opened(path) as file:
        head = file.read(84) if kind == "stl" else b""
        count, size = int.from_bytes(head[80:84], "little"), os.fstat(file.fileno()).st_size
    if len(head) == 84 and size == 84 + 50 * count and count > max_facets():
        raise named_files.FileError(f"has {count} facets, more than {max_facets()}")
    return named_files.read(path, MAX_BYTES[kind])


def _by_trimesh(kind: str, data: bytes) -> Surface:
    import trimesh

    try:
        with _silent():
            # bytes without a name: what the file may name in turn (materials, pictures, URLs) is not looked for
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False, skip_materials=True)
            return np.array(mesh.vertices, float), np.array(mesh.faces, np.int64)
    except Exception as error:  # whatever a reader may meet in a damaged file
        text = " ".join(str(error).split())[:120]
        raise MeshError(f"cannot be read as {kind.upper()} ({type(error).__name__}: {text})") from None


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


def _stl(data: bytes) -> Surface:
    """A binary STL says its length, a text one has an end."""
    size = 84 + 50 * int.from_bytes(data[80:84], "little") if len(data) >= 84 else None
    if size == len(data):
        return _by_trimesh("stl", data)
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" and b"facet" in data.lower():
        if b"endsolid" not in data.lower():
            raise MeshError("is cut off: the text STL has no 'endsolid'")
        return read_text_stl(data)
    if size is None:
        raise MeshError("is no STL file, or cut off")
    raise MeshError(f"is no STL file, or damaged: {len(data)} bytes where its header says {size}")


def _glb(data: bytes) -> Surface:
    """A GLB file says its length, and describes what it holds."""
    if data[:4] != b"glTF" or len(data) < 12:
        raise MeshError("is no GLB file")
    size = int.from_bytes(data[8:12], "little")
    if len(data) < size:
        raise MeshError(f"is cut off: {len(data)} bytes where its header says {size}")
    length = int.from_bytes(data[12:16], "little")
    try:
        tree = json.loads(data[20 : 20 + length])
        reason = _unread(tree) or _absurd(tree)
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
        reason = f"cannot be read as GLB ({type(error).__name__} in its description)"
    if reason:
        raise MeshError(reason)
    return _by_trimesh("glb", data)


def _unread(tree: dict[str, Any]) -> str | None:
    """What a GLB file needs and trimesh leaves out without a word."""
    if needed := [e for e in tree.get("extensionsRequired", []) if not str(e).startswith(("KHR_materials", "KHR_tex"))]:
        return f"needs the extension {str(needed[0])[:40]}, which is not read"
    for number, accessor in enumerate(tree.get("accessors", [])):
        if "sparse" in accessor:
            return f"accessor {number} is sparse, which is not read"
    modes = {p.get("mode") for mesh in tree.get("meshes", []) for p in mesh["primitives"]}
    if FANS in modes:
        return "holds fans of triangles, which are not read"
    return None


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
    return f"places {total} corners, more than of {max_facets()} facets" if total > 3 * max_facets() else None


READERS: dict[str, Callable[[bytes], Surface]] = {
    "stl": _stl,
    "obj": read_obj,
    "ply": read_ply,
    "off": read_off,
    "glb": _glb,
}
"""Per format: vertices and triangles of a file's bytes, or MeshError with the reason."""
