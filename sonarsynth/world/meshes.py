"""Meshes: read, generated, checked, cleaned. Body frame, metres, outward normals."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import UNITS, Bools, Floats, Ints
from sonarsynth.world import files
from sonarsynth.world.generation import generate
from sonarsynth.world.keeping import kept
from sonarsynth.world.refinement import BLOCK, MeshError, Surface, halve_longest_edges, split_long_edges
from sonarsynth.world.shapes import Cylinder, MeshFile, Myring, Remus100, Shape

__all__ = ["Mesh", "MeshError", "file_stamp", "mesh_of", "refined_mesh"]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A checked triangle mesh in the body frame; facets are counter-clockwise seen from outside."""

    vertices: Floats  # (vertex, xyz) m
    faces: npt.NDArray[np.int32]  # (facet, 3)
    notes: tuple[str, ...] = ()  # what was repaired on reading, or how fine the surface is; one line each
    flat: Bools | None = None  # (facet,) known to be flat in the body itself, so that no finer mesh is nearer to it

    @property
    def corners(self) -> Floats:
        """(facet, 3, xyz) m: of large meshes made anew, for they take more room than all else; see `corners_of`."""
        return self._corners if len(self.faces) <= BLOCK else _fixed(self.vertices[self.faces])

    @cached_property
    def _corners(self) -> Floats:
        return _fixed(self.vertices[self.faces])

    def corners_of(self, some: Ints | slice) -> Floats:
        """(row, 3, xyz) m: corners of the facets picked by indices or a slice."""
        return self.vertices[self.faces[some]]

    @cached_property
    def _sizes(self) -> tuple[Floats, Floats, Floats]:
        """Area, normal and centroid, by blocks of facets."""
        count = len(self.faces)
        area, normal, centroid = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
        for some in in_blocks(count):
            corners = self.corners_of(some)
            a, b, c = np.moveaxis(corners, 1, 0)
            cross = np.cross(b - a, c - a)
            area[some] = 0.5 * np.linalg.norm(cross, axis=1)
            normal[some] = cross / (2.0 * area[some, None])
            centroid[some] = corners.mean(axis=1)
        return _fixed(area), _fixed(normal), _fixed(centroid)

    @property
    def area(self) -> Floats:
        """(facet,) m2."""
        return self._sizes[0]

    @property
    def normal(self) -> Floats:
        """(facet, xyz) outward unit normals."""
        return self._sizes[1]

    @property
    def centroid(self) -> Floats:
        """(facet, xyz) m."""
        return self._sizes[2]

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
        h = hashlib.sha256(np.ascontiguousarray(self.vertices, "<f8").view(np.uint8).data)
        h.update(np.ascontiguousarray(self.faces, "<i4").view(np.uint8).data)
        return h.hexdigest()


def in_blocks(count: int) -> list[slice]:
    """Parts of a table, so that what is needed to make it stays small: as many equal ones as hold BLOCK at most."""
    parts = max(-(-count // BLOCK), 1)
    edges = [count * n // parts for n in range(parts + 1)]
    return [slice(first, last) for first, last in pairwise(edges)]


def farthest_corner(mesh: Mesh) -> float:
    """Largest distance (m) of a corner of a facet from its middle."""
    far = 0.0
    for some in in_blocks(len(mesh.faces)):
        apart = np.linalg.norm(mesh.corners_of(some) - mesh.centroid[some, None, :], axis=-1)
        far = max(far, float(apart.max(initial=0.0)))
    return far


SHARP: Final = MeshFile(path="").crease
"""The crease of shapes that leave it out."""


def _fixed(array: Floats) -> Floats:
    """The array, read-only: it is shared by all who hold the mesh."""
    array.flags.writeable = False
    return array


def mesh_of(shape: Shape) -> Mesh:
    """The mesh of a shape: read or generated, checked, repaired. Its arrays are read-only, its digest always the same.

    A file (its path relative to the working directory) is kept until it changes. Raises `MeshError`, a ValueError in
    one line that names the file and the reason; what was repaired is said in `Mesh.notes`.
    """
    return _mesh_of(shape, file_stamp(shape))


@kept(32)
def _mesh_of(shape: Shape, stamp: tuple[int, int] | None) -> Mesh:
    return refined_mesh(shape)


def file_stamp(shape: Shape) -> tuple[int, int] | None:
    """When the file of a shape was changed (ns) and its size, for caches; None for other shapes. Raises MeshError."""
    if not isinstance(shape, MeshFile):
        return None
    try:
        return files.stamp(shape.path)
    except files.FileError as error:
        raise MeshError(f"{shape.path}: {error}") from None


def refined_mesh(shape: Shape, edge: float = np.inf, sagitta: float = np.inf) -> Mesh:
    """The mesh of a shape, made anew, with no edge longer than `edge` (m), nor than the shape's own.

    Analytic shapes, and files that stand for a curved surface (`MeshFile.smooth`), are refined on that surface, until
    facets are no farther from it, on average, than about `sagitta` (m). The flat facets of other files, of boxes and
    L-shapes are cut in their planes, which changes nothing but the length of their edges; a coarse REMUS too.
    Raises MeshError as `mesh_of`.
    """
    if isinstance(shape, MeshFile):
        (vertices, numbers), notes = _read(shape, edge, sagitta)
    else:
        (vertices, numbers), notes = generate(shape, edge, sagitta)
        if isinstance(shape, Remus100) and shape.coarse and edge < np.inf:
            vertices, numbers = halve_longest_edges((vertices, numbers), edge)
    faces = np.ascontiguousarray(numbers, np.int32)
    flat = None
    if isinstance(shape, (Cylinder, Myring, Remus100)):  # their ends
        flat = np.ptp(vertices[faces, 0], axis=1) == 0
        flat.flags.writeable = False
    faces.flags.writeable = False
    return Mesh(_fixed(np.ascontiguousarray(vertices, np.float64)), faces, notes, flat)


def _read(shape: MeshFile, edge: float, sagitta: float) -> tuple[Surface, tuple[str, ...]]:
    from sonarsynth.world.smoothing import curved

    surface, notes = _repaired(replace(shape, edge=None, smooth=False, crease=SHARP), file_stamp(shape))
    longest = min(edge, np.inf if shape.edge is None else shape.edge)
    if np.isinf(longest) and not (shape.smooth and np.isfinite(sagitta)):
        return surface, notes
    try:
        if shape.smooth:
            return curved(surface, longest, sagitta, shape.crease), notes
        return (halve_longest_edges if edge < np.inf else split_long_edges)(surface, longest), notes
    except MeshError as error:
        raise MeshError(f"{shape.path}: {error}") from None


@kept(4)
def _repaired(shape: MeshFile, stamp: tuple[int, int] | None) -> tuple[Surface, tuple[str, ...]]:
    """What a file holds, before any refinement, read once for all of them."""
    from scipy.spatial.transform import Rotation

    from sonarsynth.world.mesh_files import read_surface
    from sonarsynth.world.mesh_repair import check, repair

    path = Path(shape.path)
    vertices, faces = read_surface(path)
    turn = Rotation.from_euler("xyz", [shape.roll, shape.pitch, shape.heading]).as_matrix()
    with np.errstate(invalid="ignore", over="ignore"):
        placed = (vertices * UNITS["m"][shape.unit]) @ turn.T + np.array(shape.offset)
    check((placed, faces), shape.path)
    (vertices, faces), notes = repair((placed, faces), shape.path, shares_vertices=path.suffix.lower() != ".stl")
    vertices.flags.writeable = faces.flags.writeable = False
    return (vertices, faces), notes
