"""Relief: what of the bottom rises over its mean plane, as a body that scatters and hides."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.casting.ray_casting import first_hit
from sonarsynth.conventions import Floats, NonNegativeMetres
from sonarsynth.description import description
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Still
from sonarsynth.scattering import Scattering
from sonarsynth.targets.meshes import MeshError, mesh_of
from sonarsynth.targets.shapes import MeshFile
from sonarsynth.targets.target import Target

BOTTOM: Final = "bottom"
"""Name and category of the body."""
ROUND: Final = np.stack([np.cos(np.arange(8) * np.pi / 4), np.sin(np.arange(8) * np.pi / 4)], axis=1)
"""Points of a circle that heights are looked up at."""


@description
class Relief:
    """What of the bottom rises over its mean plane at `environment.depth`: it scatters and hides as a body does, which
    is called `bottom`, of the category `bottom`, and clutter. Mirror reflections are those of the mean plane, where the
    relief does not hide them; so is reverberation, which it hides as well. What lies lower is taken as that plane.
    """

    shape: MeshFile
    """A grid of heights, or a mesh: x to the east, y to the north, z up from the mean plane (`offset` shifts it)."""
    least: NonNegativeMetres = 0.1
    """What rises less is taken as the mean plane."""
    scattering: Scattering | None = None
    """How it scatters, as of a target."""

    def target(self, depth: float) -> Target | None:
        """The body, over a mean bottom at this depth (m); None where nothing rises. Raises MeshError."""
        shape = replace(self.shape, floor=0.0, least=self.least)
        mesh = mesh_of(shape)
        if not len(mesh.faces):
            return None
        if (highest := float(mesh.box[1, 2])) >= depth:
            raise MeshError(f"{shape.path}: rises {highest:.3g} m over a bottom that is {depth:g} m deep")
        east = Still(position=(0.0, 0.0, -depth), heading=0.5 * np.pi)
        return Target(name=BOTTOM, shape=shape, motion=east, scattering=self.scattering, category=BOTTOM, clutter=True)


def highest_within(mesh: Mesh, centre: Floats, radius: float) -> float:
    """Height (m) over the mean plane that a relief has within a radius (m) of a place (x, y), by its vertices there and
    by rays down, at the middle and round it; 0 where it does not rise.
    """
    near = np.hypot(*(mesh.vertices[:, :2] - centre).T) <= radius
    top = float(mesh.box[1, 2]) + 1.0
    points = np.concatenate([[centre], centre + radius * ROUND])
    above = np.column_stack([points, np.full(len(points), top)])
    _, distance = first_hit(mesh, above, np.broadcast_to([0.0, 0.0, -1.0], above.shape))
    rays = top - distance[np.isfinite(distance)]
    return max(float(mesh.vertices[near, 2].max(initial=0.0)), float(rays.max(initial=0.0)))
