"""Meshes of trimesh's shapes, and a ball at rest."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import trimesh

from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.placed_target import PlacedTarget


def mesh_from(shape: trimesh.Trimesh, scale: npt.ArrayLike = 1.0) -> Mesh:
    return Mesh(np.asarray(shape.vertices, float) * scale, np.asarray(shape.faces, np.int32))


def ball(place: npt.ArrayLike = (15.0, 1.0, -6.0), radius: float = 0.3, subdivisions: int = 2) -> PlacedTarget:
    """At a place (xyz) of the world."""
    mesh = mesh_from(trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius))
    return PlacedTarget("ball", mesh, Pose(np.array(place, float), quaternion(0.0)), np.zeros(3))
