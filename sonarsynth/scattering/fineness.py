"""Meshes fine enough to scatter like the surface that they stand for: refined on it, or reported."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.acoustics.facets import FIVE_PERCENT, kirchhoff_error
from sonarsynth.world.curvature import curvature_radius, mean_edges
from sonarsynth.world.meshes import Mesh, mesh_of
from sonarsynth.world.refinement import longest_edge
from sonarsynth.world.shapes import Box, Cylinder, LShape, MeshFile, Remus100, Shape, Sphere

ROWS: Final = 0.55
"""Longest edge over the wavelength on a curved surface. Rows of facets half a wavelength apart or more are a grating:
seen along an axis of symmetry, a sphere of 0.5 m so meshed is 0.6 dB off at 90 kHz, though each facet is fine."""
MOST_FACETS: Final = 2_000_000
"""No shape is refined beyond; what is missing then is reported."""
ERROR: Final = 0.02
"""Expected error that shapes are refined to: rigid spheres of 0.25 m are then within 0.2 dB, of 0.5 m within 0.1 dB."""
SHADOW: Final = 48
"""Facets along the longest side of a body that shades itself: shadows end within half a facet."""


class CoarseMesh(UserWarning):
    """Facets are too long for the wavelength on a surface so curved: the echo has the error that is named."""


def expected_error(mesh: Mesh, wavelength: float) -> float:
    """Relative error of the complex echo of a mesh for the curved surface that it stands for: mean over its area.

    `acoustics.facets.kirchhoff_error` of each facet's mean edge and of the curvature seen in the angles between facets;
    a flat facet has none.
    """
    error = kirchhoff_error(mean_edges(mesh), wavelength, curvature_radius(mesh))
    return float(np.average(error, weights=mesh.area))


def fine_mesh(shape: Shape, wavelength: float, error: float = ERROR) -> Mesh:
    """Mesh of a shape for a wavelength (m): refined on the true surface until the expected error is `error`, and no
    edge longer than `ROWS` wavelengths, with about `MOST_FACETS` at most.

    Raises MeshError as `mesh_of`. Files are as they are. Warns (`CoarseMesh`) where more is left, and more than 5 %.
    """
    mesh, allowed = mesh_of(shape), max(FIVE_PERCENT, 1.1 * error)
    if isinstance(shape, LShape) and shape.edge is None:
        mesh = mesh_of(replace(shape, edge=max(shape.height, shape.length, shape.width) / SHADOW))
    if isinstance(shape, (MeshFile, Box, LShape)) or (isinstance(shape, Remus100) and shape.coarse):
        return checked(mesh, wavelength, allowed)
    least = np.sqrt(float(mesh.area.sum()) / (0.3 * MOST_FACETS))  # m: edge of facets 0.3 edge^2 in size
    for _ in range(4):
        ratio = expected_error(mesh, wavelength) / error
        edge = longest_edge((mesh.vertices, mesh.faces.astype(np.int64)))
        longest = min(edge / np.sqrt(max(ratio, 1.0)), ROWS * wavelength)
        if (ratio <= 1.1 and edge <= 1.001 * ROWS * wavelength) or edge <= 1.001 * least:
            break
        mesh = mesh_of(replace(shape, edge=max(longest, least)))
    if ROWS * wavelength < least:
        warnings.warn(
            f"{len(mesh.faces)} facets are too few for waves of {1e3 * wavelength:.3g} mm: their rows, up to "
            f"{1e3 * edge:.3g} mm apart, echo like a grating at some aspects",
            CoarseMesh,
            stacklevel=4,
        )
    return checked(mesh, wavelength, allowed)


def checked(mesh: Mesh, wavelength: float, allowed: float = FIVE_PERCENT) -> Mesh:
    """The mesh itself; warns (`CoarseMesh`, one line) if the error expected at a wavelength (m) exceeds `allowed`."""
    expected = expected_error(mesh, wavelength)
    if expected > allowed:
        edge = float(np.average(mean_edges(mesh), weights=mesh.area))
        better = 1e3 * edge * np.sqrt(FIVE_PERCENT / expected)
        warnings.warn(
            f"facets of {1e3 * edge:.3g} mm are too coarse for waves of {1e3 * wavelength:.3g} mm: expect an error of "
            f"{100 * expected:.3g} % of the echo; 5 % takes facets of {better:.2g} mm on the true surface",
            CoarseMesh,
            stacklevel=4,
        )
    return mesh


def convex(shape: Shape | None, mesh: Mesh) -> bool:
    """Whether no facet can hide another, by the kind of shape or, within 1e-6 of the volume, by the convex hull."""
    if shape is not None and not isinstance(shape, MeshFile):
        return isinstance(shape, (Sphere, Cylinder, Box))
    from scipy.spatial import ConvexHull, QhullError

    from sonarsynth.world.refinement import volume

    try:
        hull = float(ConvexHull(mesh.vertices).volume)
    except QhullError:
        return False
    return abs(volume((mesh.vertices, mesh.faces.astype(np.int64))) - hull) <= 1e-6 * hull
