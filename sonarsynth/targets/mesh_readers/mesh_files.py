"""Reading mesh files: OBJ, OFF, PLY and text STL by our own readers, binary STL and glTF through trimesh,
COLLADA through pycollada, 3MF, plain corners and elevation grids by our own.

trimesh misreads legal files of the former without an error (`mesh_text`, `mesh_ply`), and gives an empty mesh for a
damaged STL; of a GLB it leaves out what it does not know. What a file promises is checked here first.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Final

from sonarsynth.description import named_files
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.elevation_grid import (
    read_bathymetry,
    read_grid_text,
    read_netcdf_grid,
    read_npz,
)
from sonarsynth.targets.mesh_readers.mesh_3mf import read_3mf
from sonarsynth.targets.mesh_readers.mesh_collada import read_collada
from sonarsynth.targets.mesh_readers.mesh_gltf import read_glb, read_gltf
from sonarsynth.targets.mesh_readers.mesh_ply import read_ply
from sonarsynth.targets.mesh_readers.mesh_text import read_corners, read_obj, read_off, read_text_stl
from sonarsynth.targets.mesh_readers.mesh_trimesh import by_trimesh

GRIDS: Final = ("csv", "npz", "nc", "bty")
"""Elevation grids, in metres."""
MAX_BYTES = {
    "stl": 4 << 30,
    "glb": 1 << 30,
    "ply": 1 << 30,
    "obj": 1 << 29,
    "off": 1 << 29,
    "gltf": 1 << 29,
} | dict.fromkeys(("dae", "zae", "3mf", "txt", *GRIDS), 1 << 28)
"""Text takes several times its size in memory to read."""


def read_surface(path: Path) -> Surface:
    """Vertices and faces as they stand in the file, in its own unit and axes; polygons cut in triangles.

    Raises MeshError in one line that names the file and the reason.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in READERS:
        raise MeshError(f"{path}: is not one of {', '.join(k.upper() for k in READERS)} (by its ending)")
    with named_files.errors_as(MeshError, path):
        data = _content(path, kind)
    if not data.strip():
        raise MeshError(f"{path}: is empty")
    try:
        vertices, faces = READERS[kind](data, path.parent)
    except (MeshError, named_files.FileError) as error:
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


def _stl(data: bytes) -> Surface:
    """A binary STL says its length, a text one has an end."""
    size = 84 + 50 * int.from_bytes(data[80:84], "little") if len(data) >= 84 else None
    if size == len(data):
        return by_trimesh("stl", data)
    if data.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" and b"facet" in data.lower():
        if b"endsolid" not in data.lower():
            raise MeshError("is cut off: the text STL has no 'endsolid'")
        return read_text_stl(data)
    if size is None:
        raise MeshError("is no STL file, or cut off")
    raise MeshError(f"is no STL file, or damaged: {len(data)} bytes where its header says {size}")


READERS: dict[str, Callable[[bytes, Path], Surface]] = {
    "stl": lambda data, folder: _stl(data),
    "obj": lambda data, folder: read_obj(data),
    "ply": lambda data, folder: read_ply(data),
    "off": lambda data, folder: read_off(data),
    "glb": lambda data, folder: read_glb(data),
    "gltf": read_gltf,
    "dae": lambda data, folder: read_collada(data),
    "zae": lambda data, folder: read_collada(data),
    "3mf": lambda data, folder: read_3mf(data),
    "txt": lambda data, folder: read_corners(data),
    "csv": lambda data, folder: read_grid_text(data),
    "npz": lambda data, folder: read_npz(data),
    "nc": lambda data, folder: read_netcdf_grid(data),
    "bty": lambda data, folder: read_bathymetry(data),
}
"""Per format: vertices and triangles of a file's bytes (and its folder), or MeshError with the reason."""

IN_METRES: Final = ("glb", "gltf", "dae", "zae", "3mf", *GRIDS)
"""Formats that say their unit, or have it by convention: what is read is in metres."""
