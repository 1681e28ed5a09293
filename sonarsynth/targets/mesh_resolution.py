"""Meshes fine enough to scatter like the surface that they stand for: refined on it, or reported."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.curvature import bend
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.surfaces import longest_edge, volume
from sonarsynth.targets.meshes import file_stamp, mesh_of, refined_mesh
from sonarsynth.targets.shapes import Box, Cylinder, Knots, LShape, MeshFile, Remus100, School, Shape, Sphere

ROWS: Final = 0.55
"""Longest edge over the wavelength on a curved surface. Rows of facets half a wavelength apart or more are a grating:
seen along an axis of symmetry, a sphere of 0.5 m so meshed is 0.6 dB off at 90 kHz, though each facet is fine."""
MOST_FACETS: Final = 2_000_000
"""No shape is refined beyond; what is missing then is reported."""
MOST_CUT: Final = 100_000
"""Facets that a shape is cut into, where nobody says how far: a frame then takes a second or two."""
FIVE_PERCENT: Final = 0.05  # of the echo: 0.4 dB
ERROR: Final = 0.02
"""Expected error that shapes are refined to: rigid spheres of 0.25 m are then within 0.2 dB, of 0.5 m within 0.1 dB."""
SHADOW: Final = 48
"""Facets along the longest side of a body that shades itself: shadows end within half a facet."""
FACET_AREA: Final = 0.3
"""Area of a facet over the square of the longest edge, in meshes that are made."""
HALVED_AREA: Final = 0.08
"""The same in meshes that are cut by halving."""


class CoarseMesh(UserWarning):
    """Facets are too long for the wavelength on a surface so curved: the echo has the error that is named."""


def expected_error(mesh: Mesh, wavelength: float) -> float:
    """Relative error of the complex echo of a mesh for the curved surface that it stands for: mean over its curved
    area, 1 (all of it) at most.

    The two-way phase 4 pi d/lambda of the mean distance d of each flat piece from the surface (`curvature.bend`):
    (pi/2) L^2/(lambda a) where facets are equilateral, of edge L on radius a, and the same for facets that are long
    along a direction in which the surface is flat, or cut in their plane. Against the exact Kirchhoff integral over a
    cylinder seen broadside it is within 6 % for the meshes that are made here, whatever the length of their facets.
    """
    return _mean_error(bend(mesh).sagitta, mesh.area, wavelength)


def _mean_error(sagitta: Floats, area: Floats, wavelength: float) -> float:
    error = np.minimum(4.0 * np.pi / wavelength * sagitta, 1.0)
    return float(np.average(error, weights=area * (sagitta > 0))) if sagitta.any() else 0.0


def mesh_report(mesh: Mesh, wavelength: float, allowed: float = FIVE_PERCENT) -> str | None:
    """One line if the error expected at a wavelength (m) exceeds `allowed`: how much, and what to do; None if not."""
    sagitta, across_each = bend(mesh)
    expected = _mean_error(sagitta, mesh.area, wavelength)
    if expected <= allowed:
        return None
    weight = mesh.area * (sagitta > 0)
    across = float(np.average(across_each, weights=weight))
    mean = 4.0 * np.pi / wavelength * float(np.average(sagitta, weights=weight))
    return (
        f"facets of {_said(across)} are too coarse for waves of {_said(wavelength)}: expect an error of "
        f"{100 * expected:.3g} % of the echo; 5 % takes facets of {_said(across * np.sqrt(FIVE_PERCENT / mean), 2)} "
        "on the true surface (smooth: true for a file that stands for a curved one, or a finer mesh)"
    )


def _said(length: float, digits: int = 3) -> str:
    """A length (m) as people say it."""
    number, unit = (1e3 * length, "mm") if length < 0.995 else (length, "m")
    return f"{np.format_float_positional(number, digits, fractional=False, trim='-')} {unit}"


def checked(mesh: Mesh, wavelength: float, allowed: float = FIVE_PERCENT) -> Mesh:
    """The mesh itself; warns (`CoarseMesh`, one line) if the error expected at a wavelength (m) exceeds `allowed`."""
    if report := mesh_report(mesh, wavelength, allowed):
        warnings.warn(report, CoarseMesh, stacklevel=4)
    return mesh


def fine_mesh(shape: Shape, wavelength: float, error: float = ERROR) -> Mesh:
    """Mesh of a shape for a wavelength (m): refined on the true surface until the expected error is `error`, and no
    edge longer than `ROWS` wavelengths, with about `MOST_FACETS` at most. It is kept, and always the same.

    Raises MeshError as `mesh_of`. Flat facets stay whole, and files as they are unless smooth. Warns (`CoarseMesh`)
    where more is left, and more than 5 %.
    """
    mesh, rows = _fine(shape, file_stamp(shape), wavelength, error, False)
    if rows:
        warnings.warn(rows, CoarseMesh, stacklevel=4)
    return checked(mesh, wavelength, max(FIVE_PERCENT, 1.1 * error))


def frame_mesh(shape: Shape, wavelength: float, error: float = FIVE_PERCENT) -> Mesh:
    """Mesh of a shape for facets that add coherently in a frame: as `fine_mesh`, and flat facets are cut in their plane
    until no edge is longer than `ROWS` wavelengths, for there each facet has one direction to all hydrophones.

    Raises MeshError as `mesh_of`. No warning: what is left is said in the mesh's notes, and by `mesh_report`.
    """
    return _fine(shape, file_stamp(shape), wavelength, error, True)[0]


def cut_mesh(shape: Shape, longest: float) -> Mesh:
    """Mesh of a shape for facets that echo from their middles: where the shape leaves its edge out, facets are cut
    until none is longer than `longest` (m), or until there are about `MOST_CUT`. Flat facets are cut in their planes.

    Raises MeshError as `mesh_of`. What was cut is said in the mesh's notes.
    """
    return _cut(shape, file_stamp(shape), longest)


@byte_bounded_cache(16)
def _cut(shape: Shape, stamp: tuple[int, int] | None, longest: float) -> Mesh:
    plain = mesh_of(shape)
    old = longest_edge((plain.vertices, plain.faces))
    if shape.edge is not None or old <= longest:
        return plain
    edge, _ = _limits(plain, shape, longest, np.inf, MOST_CUT)
    if old <= edge:
        return plain
    mesh = refined_mesh(shape, edge)
    note = (
        f"{len(plain.faces)} facets up to {_said(old, 2)} long are cut into {len(mesh.faces)} up to {_said(edge, 2)}, "
        "for each echoes from its middle: `shape.edge` says how far"
    )
    return replace(mesh, notes=(*mesh.notes, note))


@byte_bounded_cache(16)
def _fine(
    shape: Shape, stamp: tuple[int, int] | None, wavelength: float, error: float, in_frame: bool
) -> tuple[Mesh, str | None]:
    """The mesh, and the line that says that its rows of facets are too far apart, if they are."""
    mesh = coarse = mesh_of(shape)
    if not (in_frame or _refinable(shape)):
        if isinstance(shape, LShape) and shape.edge is None:
            mesh = mesh_of(replace(shape, edge=max(shape.height, shape.length, shape.width) / SHADOW))
        return mesh, None
    edge, sagitta = _limits(mesh, shape, ROWS * wavelength, 0.25 * error * wavelength / np.pi, MOST_FACETS)
    mesh = refined_mesh(shape, edge, sagitta)
    ratio = expected_error(mesh, wavelength) / error
    while ratio > 1.1 and len(mesh.faces) * ratio < MOST_FACETS and np.isfinite(sagitta):
        sagitta /= ratio
        finer = refined_mesh(shape, edge, sagitta)
        last_ratio, ratio = ratio, expected_error(finer, wavelength) / error
        if ratio > 0.9 * last_ratio:  # what is left are edges that are neither creases nor rounded
            break
        mesh = finer
    longest = longest_edge((mesh.vertices, mesh.faces))
    rows = None
    if longest > 1.001 * ROWS * wavelength:
        rows = f"{len(mesh.faces)} facets are too few for waves of {_said(wavelength)}: " + (
            f"their rows, up to {_said(longest)} apart, echo like a grating at some aspects"
            if _refinable(shape)
            else f"up to {_said(longest)} long, each has one direction to all hydrophones"
        )
    if in_frame:
        judged = mesh if _refinable(shape) else coarse  # cut in their planes, facets are as far from a curve as before
        notes = (rows, mesh_report(judged, wavelength, max(FIVE_PERCENT, 1.1 * error)))
        mesh = replace(mesh, notes=(*mesh.notes, *(line for line in notes if line)))
    return mesh, rows


def _refinable(shape: Shape) -> bool:
    """Whether a finer mesh of it is nearer to the body that it stands for."""
    if isinstance(shape, MeshFile):
        return shape.smooth
    return not (isinstance(shape, (Box, Knots, LShape, School)) or (isinstance(shape, Remus100) and shape.coarse))


def _limits(mesh: Mesh, shape: Shape, edge: float, sagitta: float, max_facets: int) -> tuple[float, float]:
    """Longest edge and mean sagitta (m) for the mesh of a shape, so that about `max_facets` facets suffice.

    Facets of the coarse mesh are cut in as many as their area asks, and as the distance of their plane from the curve
    asks, which falls with the square of the edge.
    """
    if not _refinable(shape):
        sagitta = np.inf
    halved = isinstance(shape, MeshFile) or (isinstance(shape, Remus100) and shape.coarse)
    by_length = mesh.area / ((HALVED_AREA if halved else FACET_AREA) * edge**2)
    needed = float(np.sum(np.maximum(1.0, np.maximum(by_length, bend(mesh).sagitta / sagitta))))
    excess = max(1.0, needed / max_facets)
    return edge * np.sqrt(excess), sagitta * excess


def convex(shape: Shape | None, mesh: Mesh) -> bool:
    """Whether no facet can hide another, by the kind of shape or, within 1e-6 of the volume, by the convex hull."""
    if shape is not None and not isinstance(shape, MeshFile):
        return isinstance(shape, (Sphere, Cylinder, Box))
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = float(ConvexHull(mesh.vertices).volume)
    except QhullError:
        return False
    return abs(volume((mesh.vertices, mesh.faces)) - hull) <= 1e-6 * hull
