"""Targets: a named shape of some material that moves."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le
from pydantic import StringConstraints

from sonarsynth.conventions import Number
from sonarsynth.description import description
from sonarsynth.description.field_messages import CATEGORY, NAME
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Motion
from sonarsynth.scattering import Scattering
from sonarsynth.targets.mesh_resolution import cut_mesh, frame_mesh
from sonarsynth.targets.meshes import mesh_of
from sonarsynth.targets.shapes import Shape

NO_CATEGORY = "target"
"""What targets are called that are called nothing else."""
Name = Annotated[str, StringConstraints(pattern=NAME)]
Category = Annotated[str, StringConstraints(pattern=CATEGORY)]
Scale = Annotated[Number, Ge(1e-3), Le(1e3)]


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
    category: Category = NO_CATEGORY
    """What a detector is to call it: a word."""
    clutter: bool = False
    """Whether it is clutter, which no detector is asked to find: what it reports there is a false alarm."""
    scale: Scale = 1.0
    """So many times as large as the shape, about its origin."""
    mesh_scale: Scale | None = None
    """Scale that its mesh is fine enough for, where bodies of several scales share one; left out: its own."""

    def mesh(self, law: Scattering, wavelength: float) -> Mesh:
        """What it is traced with by a law, at the shortest wavelength (m). Raises MeshError as `mesh_of`."""
        return self.base_mesh(law, wavelength).scaled(self.scale)

    def base_mesh(self, law: Scattering, wavelength: float) -> Mesh:
        """The same before it is scaled."""
        return base_mesh(self.shape, law, wavelength, self.mesh_scale or self.scale)


def base_mesh(shape: Shape, law: Scattering, wavelength: float, scale: float = 1.0) -> Mesh:
    """The mesh that a shape is traced with, before it is scaled: fine enough, at its scale, for a law that sums phases
    at the shortest wavelength (m) of the band; else as described, and where the shape leaves its edge out, with facets
    no longer than may echo from their middles. Raises MeshError as `mesh_of`."""
    if law.mesh_tolerance is not None:
        return frame_mesh(shape, wavelength / scale, law.mesh_tolerance)
    if law.longest_facet is None:
        return mesh_of(shape)
    return cut_mesh(shape, law.longest_facet / scale)
