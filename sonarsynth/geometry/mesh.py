"""A triangle mesh in the frame of its body."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry.surfaces import BLOCK


@dataclass(frozen=True, eq=False)
class Mesh:
    """A checked triangle mesh in the body frame; facets are counter-clockwise seen from outside."""

    vertices: Floats  # (vertex, xyz) m
    faces: npt.NDArray[np.int32]  # (facet, 3)
    notes: tuple[str, ...] = ()  # what was repaired on reading, or how fine the surface is; one line each
    flat: Bools | None = None  # (facet,) known to be flat in the body itself, so that no finer mesh is nearer to it
    original: tuple[Mesh, float] | None = None  # the mesh that it is a copy of, and how many times as large it is

    @property
    def corners(self) -> Floats:
        """(facet, 3, xyz) m: of large meshes made anew, for they take more room than all else; see `corners_of`."""
        return self._corners if len(self.faces) <= BLOCK else read_only(self.vertices[self.faces])

    @cached_property
    def _corners(self) -> Floats:
        return read_only(self.vertices[self.faces])

    def corners_of(self, rows: Ints | slice) -> Floats:
        """(row, 3, xyz) m: corners of the facets picked by indices or a slice."""
        return self.vertices[self.faces[rows]]

    @cached_property
    def _sides(self) -> tuple[Floats, Floats]:
        """Area and normal, by blocks of facets."""
        count = len(self.faces)
        area, normal = np.empty(count), np.empty((count, 3))
        for block in in_blocks(count):
            a, b, c = np.moveaxis(self.corners_of(block), 1, 0)
            (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T  # a tenth of the time of np.cross
            cross = np.stack([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx], axis=1)
            area[block] = 0.5 * np.linalg.norm(cross, axis=1)
            normal[block] = cross / (2.0 * area[block, None])
        return read_only(area), read_only(normal)

    @property
    def area(self) -> Floats:
        """(facet,) m2."""
        return self._sides[0]

    @property
    def normal(self) -> Floats:
        """(facet, xyz) outward unit normals."""
        return self._sides[1]

    @cached_property
    def centroid(self) -> Floats:
        """(facet, xyz) m."""
        centroid = np.empty((len(self.faces), 3))
        for block in in_blocks(len(self.faces)):
            a, b, c = np.moveaxis(self.corners_of(block), 1, 0)
            centroid[block] = (a + b + c) / 3.0
        return read_only(centroid)

    @cached_property
    def box(self) -> Floats:
        """(2, xyz) smallest and largest coordinates (m)."""
        return read_only(np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)]))

    @cached_property
    def radius(self) -> float:
        """Largest distance of a vertex from the body's origin (m)."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @cached_property
    def closed(self) -> bool:
        """Whether each side of a facet is one of another the other way round, so that no ray gets in unseen; of large
        meshes that is not looked into."""
        if len(self.faces) > BLOCK:
            return False
        start = self.faces.astype(np.int64)
        end, count = np.roll(start, -1, axis=1), len(self.vertices)
        sides, others = (np.sort((a * count + b).ravel()) for a, b in ((start, end), (end, start)))
        return bool((sides == others).all() and (np.diff(sides) > 0).all())

    def scaled(self, factor: float) -> Mesh:
        """The same body so many times as large, about its origin."""
        if factor == 1.0:
            return self
        return Mesh(read_only(self.vertices * factor), self.faces, self.notes, self.flat, (self, factor))

    @cached_property
    def digest(self) -> str:
        """SHA-256 of vertices and faces: the mesh's identity in caches and in the store."""
        h = hashlib.sha256(np.ascontiguousarray(self.vertices, "<f8").view(np.uint8).data)
        h.update(np.ascontiguousarray(self.faces, "<i4").view(np.uint8).data)
        return h.hexdigest()


def in_blocks(count: int) -> list[slice]:
    """Parts of a table, so that what is needed to make it stays small: as many equal ones as hold BLOCK at most."""
    blocks = max(-(-count // BLOCK), 1)
    edges = [count * n // blocks for n in range(blocks + 1)]
    return [slice(first, last) for first, last in pairwise(edges)]


def farthest_corner(mesh: Mesh) -> float:
    """Largest distance (m) of a corner of a facet from its middle."""
    far = 0.0
    for block in in_blocks(len(mesh.faces)):
        apart = np.linalg.norm(mesh.corners_of(block) - mesh.centroid[block, None, :], axis=-1)
        far = max(far, float(apart.max(initial=0.0)))
    return far


def read_only(array: Floats) -> Floats:
    """The array, read-only: it is shared by all who hold the mesh."""
    array.flags.writeable = False
    return array
