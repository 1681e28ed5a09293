"""Meshes: read, generated, checked, cleaned. Body frame, metres, outward normals."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


@dataclass(frozen=True, eq=False)
class Mesh:
    """A checked triangle mesh in the body frame; facets are counter-clockwise seen from outside."""

    vertices: Floats  # (vertex, xyz) m
    faces: npt.NDArray[np.int32]  # (facet, 3)
    notes: tuple[str, ...] = ()  # what was repaired on reading, one line each

    @cached_property
    def corners(self) -> Floats:
        """(facet, 3, xyz) m."""
        return self.vertices[self.faces]

    @cached_property
    def _cross(self) -> Floats:
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @cached_property
    def area(self) -> Floats:
        """(facet,) m2."""
        return 0.5 * np.linalg.norm(self._cross, axis=1)

    @cached_property
    def normal(self) -> Floats:
        """(facet, xyz) outward unit normals."""
        return self._cross / (2.0 * self.area[:, None])

    @cached_property
    def centroid(self) -> Floats:
        """(facet, xyz) m."""
        return self.corners.mean(axis=1)

    @cached_property
    def box(self) -> Floats:
        """(2, xyz) smallest and largest coordinates (m)."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

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
