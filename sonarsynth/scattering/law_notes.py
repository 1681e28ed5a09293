"""What a law leaves out of the echo of a mesh, in one line."""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, first_hit
from sonarsynth.conventions import Floats
from sonarsynth.geometry.mesh import Mesh

RAYS: Final = 4096
"""Rays by which a mesh is searched for facets that face each other."""
LEAST: Final = 0.003
"""Share of them that must meet the mesh again for a note: the grooves of a cast hull are not worth one."""


def facing_share(mesh: Mesh) -> float:
    """Share of what leaves a mesh, evenly by area and by Lambert's law in direction, that meets it again.

    0 for a convex body; else by `RAYS` rays, always the same.
    """
    if not len(mesh.faces):
        return 0.0
    pick, u, v, out, turn = evenly_in(RAYS, 5).T
    share = np.cumsum(mesh.area) / mesh.area.sum()
    facet = np.minimum(np.searchsorted(share, pick), len(share) - 1)
    normal, root = mesh.normal[facet], np.sqrt(u)
    weight = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
    start = np.einsum("rc,rcx->rx", weight, mesh.corners[facet]) + OFFSET * mesh.radius * normal
    tangent, turn = _across(normal), 2.0 * np.pi * turn
    level = np.cos(turn)[:, None] * tangent + np.sin(turn)[:, None] * np.cross(normal, tangent)
    direction = np.sqrt(out)[:, None] * level + np.sqrt(1.0 - out)[:, None] * normal
    return float(np.mean(first_hit(mesh, start, direction)[0] >= 0))


def evenly_in(count: int, axes: int) -> Floats:
    """Points (point, axis) spread evenly over the unit cube: multiples of powers of the root of x^(axes+1) = x + 1."""
    root = 1.5
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (axes + 1))
    return np.asarray(np.mod(0.5 + np.outer(np.arange(count), root ** -np.arange(1.0, axes + 1)), 1.0))


def _across(normal: Floats) -> Floats:
    """Unit vectors (row, xyz) square to unit vectors (row, xyz)."""
    axis = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    tangent = np.cross(normal, axis)
    return np.asarray(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))


class SmallBody(UserWarning):
    """A body is too small against the wavelength for facets that scatter as pieces of mirrors."""


def concave_note(mesh: Mesh) -> str | None:
    """One line if facets of a mesh face each other, for laws whose echoes add with their phases; None if not."""
    share = facing_share(mesh)
    if share < LEAST:
        return None
    return (
        f"facets face each other: {100 * share:.2g} % of what leaves them sideways meets the body again, and echoes "
        "that bounce twice, as in a corner, are not simulated"
    )
