"""Meshes: read, generated, checked, cleaned. Body frame, metres, outward normals."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import UNITS, Floats
from sonarsynth.world.generation import generate
from sonarsynth.world.refinement import MeshError, Surface, split_long_edges
from sonarsynth.world.shapes import MeshFile, Shape

__all__ = ["Mesh", "MeshError", "mesh_of"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A checked triangle mesh in the body frame; facets are counter-clockwise seen from outside."""

    vertices: Floats  # (vertex, xyz) m
    faces: npt.NDArray[np.int32]  # (facet, 3)
    notes: tuple[str, ...] = ()  # what was repaired on reading, or how fine the surface is; one line each

    @cached_property
    def corners(self) -> Floats:
        """(facet, 3, xyz) m."""
        return _fixed(self.vertices[self.faces])

    @cached_property
    def _cross(self) -> Floats:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return _fixed(np.cross(b - a, c - a))

    @cached_property
    def area(self) -> Floats:
        """(facet,) m2."""
        return _fixed(0.5 * np.linalg.norm(self._cross, axis=1))

    @cached_property
    def normal(self) -> Floats:
        """(facet, xyz) outward unit normals."""
        return _fixed(self._cross / (2.0 * self.area[:, None]))

    @cached_property
    def centroid(self) -> Floats:
        """(facet, xyz) m."""
        return _fixed(self.corners.mean(axis=1))

    @cached_property
    def box(self) -> Floats:
        """(2, xyz) smallest and largest coordinates (m)."""
        return _fixed(np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)]))

    @cached_property
    def radius(self) -> float:
        """Largest distance of a vertex from the body's origin (m)."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @cached_property
    def digest(self) -> str:
        """SHA-256 of vertices and faces: the mesh's identity in caches and in the store."""
        h = hashlib.sha256(np.ascontiguousarray(self.vertices, "<f8").tobytes())
        h.update(np.ascontiguousarray(self.faces, "<i4").tobytes())
        return h.hexdigest()


def _fixed(array: Floats) -> Floats:
    """The array, read-only: it is shared by all who hold the mesh."""
    array.flags.writeable = False
    return array


def mesh_of(shape: Shape) -> Mesh:
    """The mesh of a shape: read or generated, checked, repaired. Its arrays are read-only, its digest always the same.

    A file (its path relative to the working directory) is kept until it changes. Raises `MeshError`, a ValueError in
    one line that names the file and the reason; what was repaired is said in `Mesh.notes`.
    """
    if not isinstance(shape, MeshFile):
        return _mesh_of(shape, None)
    try:
        status = Path(shape.path).stat()
    except OSError as error:
        raise MeshError(f"{shape.path}: {(error.strerror or str(error)).lower()}") from None
    return _mesh_of(shape, (status.st_mtime_ns, status.st_size))


@lru_cache(maxsize=32)
def _mesh_of(shape: Shape, stamp: tuple[int, int] | None) -> Mesh:
    (vertices, numbers), notes = _read(shape) if isinstance(shape, MeshFile) else generate(shape)
    faces = np.ascontiguousarray(numbers, np.int32)
    faces.flags.writeable = False
    return Mesh(_fixed(np.ascontiguousarray(vertices, np.float64)), faces, notes)


def _read(shape: MeshFile) -> tuple[Surface, tuple[str, ...]]:
    from scipy.spatial.transform import Rotation

    from sonarsynth.world.mesh_files import read_surface
    from sonarsynth.world.mesh_repair import check, repair

    path = Path(shape.path)
    vertices, faces = read_surface(path)
    turn = Rotation.from_euler("xyz", [shape.roll, shape.pitch, shape.heading]).as_matrix()
    with np.errstate(invalid="ignore", over="ignore"):
        placed = (vertices * UNITS["m"][shape.unit]) @ turn.T + np.array(shape.offset)
    check((placed, faces), shape.path)
    surface, notes = repair((placed, faces), shape.path, shares_vertices=path.suffix.lower() != ".stl")
    if shape.edge is None:
        return surface, notes
    try:
        return split_long_edges(surface, shape.edge), notes
    except MeshError as error:
        raise MeshError(f"{shape.path}: {error}") from None
