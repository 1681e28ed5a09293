"""How strongly the surface that a mesh stands for is curved, from the angles between its facets."""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.world.meshes import Mesh
from sonarsynth.world.refinement import sides, weld

CREASE: Final = 1.0
"""|n1 - n2| of the normals of two facets from which on their edge is one of the body itself: 60 degrees."""
FLAT: Final = 1e-6
"""|n1 - n2| up to which two facets are one plane."""


def curvature_radius(mesh: Mesh) -> Floats:
    """Smallest radius of curvature (facet,) in m of the surface about each facet; infinite where it is flat.

    Across an edge the surface turns by the angle between the normals over the way between the middles of the two
    facets: |c1 - c2|/|n1 - n2|. Edges of more than 60 degrees are creases, and the surface ends there. With edges
    of an eighth of the radius it is 0.87 to 1.00 of that of a sphere, 1.02 of that of a cylinder.
    """
    _, faces = weld((mesh.vertices, mesh.faces.astype(np.int64)))
    side = sides(faces)[1].ravel()
    order = np.argsort(side, kind="stable")
    first, count = np.unique(side[order], return_index=True, return_counts=True)[1:]
    shared = first[count == 2]
    one, other = order[shared] // 3, order[shared + 1] // 3
    turn = np.linalg.norm(mesh.normal[one] - mesh.normal[other], axis=1)
    smooth = (turn > FLAT) & (turn < CREASE)
    one, other, turn = one[smooth], other[smooth], turn[smooth]
    radius = np.linalg.norm(mesh.centroid[one] - mesh.centroid[other], axis=1) / turn
    out = np.full(len(faces), np.inf)
    np.minimum.at(out, one, radius)
    np.minimum.at(out, other, radius)
    return out


def mean_edges(mesh: Mesh) -> Floats:
    """Mean length (facet,) of the edges of each facet (m)."""
    corners = mesh.corners
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).mean(axis=1))
