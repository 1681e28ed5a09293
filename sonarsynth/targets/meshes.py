"""Meshes: read, generated, checked, cleaned. Body frame, metres, outward normals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.conventions import UNITS, Floats, Ints
from sonarsynth.description import named_files
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.mesh import Mesh, read_only
from sonarsynth.geometry.surfaces import MeshError, Surface, halve_longest_edges, split_long_edges
from sonarsynth.targets.generated.generation import generate
from sonarsynth.targets.generated.smoothing import curved
from sonarsynth.targets.mesh_readers.elevation_grid import over_floor
from sonarsynth.targets.mesh_readers.mesh_files import GRIDS, IN_METRES, read_surface
from sonarsynth.targets.mesh_readers.mesh_repair import check, repair, with_backs
from sonarsynth.targets.shapes import Cylinder, MeshFile, Myring, Remus100, Shape

__all__ = ["MeshError", "file_stamp", "mesh_of", "refined_mesh"]


LARGEST_IN_METRES: Final = 300.0
"""Size (m) over which a file without a unit is taken to be in millimetres."""
DIGITS: Final = 9
"""Decimals of a vertex over the size of the mesh. Processors differ in the last bit of sines and powers: unrounded, a
shape would have another digest on each, and with it other random signs of its facets, another speckle."""
SHARP: Final = MeshFile(path="").crease
"""The crease of shapes that leave it out."""


def mesh_of(shape: Shape) -> Mesh:
    """The mesh of a shape: read or generated, checked, repaired. Its arrays are read-only, its digest always the same.

    A file (its path relative to the working directory) is kept until it changes. Raises `MeshError`, a ValueError in
    one line that names the file and the reason; what was repaired is said in `Mesh.notes`.
    """
    return _mesh_of(shape, file_stamp(shape))


@byte_bounded_cache(32)
def _mesh_of(shape: Shape, stamp: tuple[int, int] | None) -> Mesh:
    return refined_mesh(shape)


def _rounded(vertices: Floats) -> Floats:
    """Vertices (vertex, xyz) in whole parts of about 1e-9 of the largest of their coordinates: of 1 m, nanometres."""
    size = 1.1 * np.abs(vertices).max(initial=0.0)  # sizes of shapes are often powers of ten, this is not
    decimals = DIGITS - int(np.floor(np.log10(size))) if size > 0.0 else DIGITS
    return np.round(vertices, decimals) + 0.0  # no -0.0, which has other bits


def file_stamp(shape: Shape) -> tuple[int, int] | None:
    """When the file of a shape was changed (ns) and its size, for caches; None for other shapes. Raises MeshError."""
    if not isinstance(shape, MeshFile):
        return None
    with named_files.errors_as(MeshError, shape.path):
        return named_files.stamp(shape.path)


def refined_mesh(shape: Shape, edge: float = np.inf, sagitta: float = np.inf) -> Mesh:
    """The mesh of a shape, made anew, with no edge longer than `edge` (m), nor than the shape's own.

    Analytic shapes, and files that stand for a curved surface (`MeshFile.smooth`), are refined on that surface, until
    facets are no farther from it, on average, than about `sagitta` (m). The flat facets of other files, of boxes and
    L-shapes are cut in their planes, which changes nothing but the length of their edges; a coarse REMUS too.
    Raises MeshError as `mesh_of`.
    """
    if isinstance(shape, MeshFile):
        (vertices, numbers), notes = _read(shape, edge, sagitta)
    else:
        (vertices, numbers), notes = generate(shape, edge, sagitta)
        if isinstance(shape, Remus100) and shape.coarse and edge < np.inf:
            vertices, numbers = halve_longest_edges((vertices, numbers), edge)
    if isinstance(shape, MeshFile) and shape.sides == "both":
        (vertices, numbers), sheets = with_backs((vertices, numbers))
        notes = (*notes, f"{sheets} facets of sheets scatter from both sides") if sheets else notes
    vertices = _rounded(vertices)
    faces = np.ascontiguousarray(numbers, np.int32)
    flat = None
    if isinstance(shape, (Cylinder, Myring, Remus100)):  # their ends
        flat = np.ptp(vertices[faces, 0], axis=1) == 0
        flat.flags.writeable = False
    faces.flags.writeable = False
    return Mesh(read_only(np.ascontiguousarray(vertices, np.float64)), faces, notes, flat)


def _read(shape: MeshFile, edge: float, sagitta: float) -> tuple[Surface, tuple[str, ...]]:
    surface, notes = _repaired(replace(shape, edge=None, smooth=False, crease=SHARP, sides="front"), file_stamp(shape))
    longest = min(edge, np.inf if shape.edge is None else shape.edge)
    if not len(surface[1]) or (np.isinf(longest) and not (shape.smooth and np.isfinite(sagitta))):
        return surface, notes
    try:
        if shape.smooth:
            return curved(surface, longest, sagitta, shape.crease), notes
        return (halve_longest_edges if edge < np.inf else split_long_edges)(surface, longest), notes
    except MeshError as error:
        raise MeshError(f"{shape.path}: {error}") from None


@byte_bounded_cache(4)
def _repaired(shape: MeshFile, stamp: tuple[int, int] | None) -> tuple[Surface, tuple[str, ...]]:
    """What a file holds, before any refinement, read once for all of them."""
    from scipy.spatial.transform import Rotation

    path = Path(shape.path)
    vertices, faces = read_surface(path)
    turn = Rotation.from_euler("xyz", [shape.roll, shape.pitch, shape.heading]).as_matrix()
    unit, guessed = _unit(shape, vertices, faces)
    with np.errstate(invalid="ignore", over="ignore"):
        placed = (vertices * UNITS["m"][unit]) @ turn.T + np.array(shape.offset)
    check((placed, faces), shape.path)
    notes: tuple[str, ...] = ()
    if path.suffix.lower().removeprefix(".") in GRIDS:  # its facets look up, whatever they seem to enclose
        vertices = placed
    else:
        (vertices, faces), notes = repair((placed, faces), shape.path, shares_vertices=path.suffix.lower() != ".stl")
    if shape.floor is not None:
        (vertices, faces), area, deepest = over_floor((vertices, faces), shape.floor, shape.least)
        notes = (*notes, f"{area:.3g} m2 are under the floor, up to {deepest:.3g} m: taken as flat") if area else notes
    vertices.flags.writeable = faces.flags.writeable = False
    return (vertices, faces), (*guessed, *notes)


def _unit(shape: MeshFile, vertices: Floats, faces: Ints) -> tuple[str, tuple[str, ...]]:
    """The unit of the numbers in a file, and a note where it is guessed from the size."""
    if shape.unit != "auto" or Path(shape.path).suffix.lower().removeprefix(".") in IN_METRES:
        return ("m" if shape.unit == "auto" else shape.unit), ()
    with np.errstate(invalid="ignore", over="ignore"):
        size = float(
            np.ptp(vertices[np.unique(faces[(faces >= 0) & (faces < len(vertices))])], axis=0).max(initial=0.0)
        )
    if not LARGEST_IN_METRES < size <= 1e3 * LARGEST_IN_METRES:
        return "m", ()
    return "mm", (f"taken to be in mm, {1e-3 * size:.3g} m across: in m it would be {size:.0f}; give the `unit`",)
