"""Targets: a named shape of some material that moves."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from sonarsynth.description import description
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Motion
from sonarsynth.scattering import Scattering
from sonarsynth.targets.mesh_resolution import frame_mesh
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Shape

NAME = r"^[A-Za-z][A-Za-z0-9_-]{0,63}$"
Name = Annotated[str, StringConstraints(pattern=NAME)]


@description
class Target:
    """A body in the water. Its name is a group of the store."""

    name: Name
    """Letters, digits, hyphens and underscores, a letter first."""
    shape: Shape
    """What it looks like."""
    motion: Motion
    """Where it is, at any time."""
    scattering: Scattering | None = None
    """How its facets scatter, by what it is made of; left out: as `scene.physics.scattering` says."""


def mesh_for(shape: Shape, law: Scattering, wavelength: float) -> Mesh:
    """The mesh that a shape is traced with: as described, or fine enough for a law that sums phases, at the shortest
    wavelength (m) of the band. Raises MeshError as `mesh_of`."""
    error = law.mesh_tolerance
    return mesh_of(shape) if error is None else frame_mesh(shape, wavelength, error)
