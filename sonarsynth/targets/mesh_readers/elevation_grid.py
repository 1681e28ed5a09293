"""Elevation grids as surfaces: heights over a grid of x (east) and y (north), in text, NumPy's npz, netCDF, or as
Bellhop has its bottom.

Two triangles a cell. The grid may be uneven; a name `depth`, or `positive: down`, says that heights count downwards.
"""

from __future__ import annotations

import io
import re
import zipfile
from typing import Any, Final

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.description.file_formats import netcdf_files
from sonarsynth.description.file_formats.fortran_rows import FortranRow, fortran_rows
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface, weld
from sonarsynth.targets.mesh_readers.mesh_repair import without_area
from sonarsynth.targets.mesh_readers.mesh_text import lines_of

NAMES: Final = {
    "x": ("x", "east", "easting"),
    "y": ("y", "north", "northing"),
    "z": ("z", "height", "elevation", "depth"),
}
"""What columns, arrays and variables are called, in small letters; what follows, a unit in brackets, is not read."""


LEVEL: Final = 1e-6
"""m: what is no farther from a floor lies in it."""


def grid_surface(x: Floats, y: Floats, z: Floats) -> Surface:
    """The surface, seen from above, of heights z (y, x) at x (x,) and y (y,), each in ascending or descending order.

    Raises MeshError where they make no grid.
    """
    if x.ndim != 1 or y.ndim != 1 or z.shape != (len(y), len(x)):
        raise MeshError(f"has heights of shape {z.shape} for {y.shape} numbers y and {x.shape} x: they must be (y, x)")
    if min(z.shape) < 2:
        raise MeshError(f"has a grid of {z.shape[1]} by {z.shape[0]}: it takes two by two at least")
    if 2 * z.size > max_facets():
        raise MeshError(f"has a grid of {z.shape[1]} by {z.shape[0]}, more than {max_facets()} facets")
    for name, numbers in (("x", x), ("y", y)):
        if not (np.isfinite(numbers).all() and ((np.diff(numbers) > 0).all() or (np.diff(numbers) < 0).all())):
            raise MeshError(f"has numbers {name} that neither only rise nor only fall")
    if not np.isfinite(z).all():
        row, column = np.argwhere(~np.isfinite(z))[0]
        missing = np.count_nonzero(~np.isfinite(z))
        raise MeshError(f"has no height at {missing} of {z.size} points, the first at x {x[column]:g}, y {y[row]:g}")
    x, z = (x, z) if x[0] < x[-1] else (x[::-1], z[:, ::-1])
    y, z = (y, z) if y[0] < y[-1] else (y[::-1], z[::-1])
    east, north = np.meshgrid(x, y)
    number = np.arange(z.size).reshape(z.shape)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2)
    return np.stack([east, north, z], axis=-1).reshape(-1, 3), faces.reshape(-1, 3)


def read_grid_text(data: bytes) -> Surface:
    """Rows of x, y and z, in any order, that fill a grid; a line of names may come first. Raises MeshError."""
    rows = [
        (number, [word for word in re.split(rb"[,;\s]+", line.strip()) if word])
        for number, line in enumerate(lines_of(data), 1)
        if line.strip() and not line.lstrip().startswith(b"#")
    ]
    order, sign = [0, 1, 2], 1.0
    if rows and not _number(rows[0][1][0]):
        line = re.sub(rb"[\[(][^\])]*[\])]", b"", lines_of(data)[rows[0][0] - 1])
        heads = [word for word in re.split(r"[,;\s]+", line.decode("utf-8", "replace").strip().lower()) if word]
        places = {axis: [n for n, word in enumerate(heads) if word in names] for axis, names in NAMES.items()}
        if any(len(columns) != 1 for columns in places.values()):
            raise MeshError(f"line {rows[0][0]}: names {', '.join(heads[:8])} are not x, y and z (or depth)")
        order = [places[axis][0] for axis in "xyz"]
        sign, rows = -1.0 if heads[order[2]] == "depth" else 1.0, rows[1:]
    table = np.empty((len(rows), 3))
    for at, (number, words) in enumerate(rows):
        try:
            table[at] = [float(words[n]) for n in order]
        except (ValueError, IndexError):
            raise MeshError(f"line {number}: is not a row of numbers x, y and z") from None
    x, column = np.unique(table[:, 0], return_inverse=True)
    y, row = np.unique(table[:, 1], return_inverse=True)
    if len(x) * len(y) != len(table) or len(np.unique(row * len(x) + column)) != len(table):
        raise MeshError(f"has {len(table)} rows that do not fill a grid: {len(x)} different x, {len(y)} different y")
    z = np.empty((len(y), len(x)))
    z[row, column] = sign * table[:, 2]
    return grid_surface(x, y, z)


def read_bathymetry(data: bytes) -> Surface:
    """A `.bty` of Bellhop, ranges in km and depths in m: along x, and alike across for half as far to either side, or
    over a grid of x and y, of Bellhop3D. Between its points it is flat, whatever the file says. Raises MeshError.
    """
    lines = [line.decode("utf-8", "replace") for line in lines_of(data)]
    option = re.match(r"\s*['\"]\s*([LCR])", lines[0].upper())
    if option is None:
        raise MeshError("line 1: is no option of a bathymetry of Bellhop: 'L', 'C' or 'R'")
    try:
        rows = fortran_rows(lines[1:], 2)
        count, *points = rows
        if option[1] != "R" and count.axis(1)[0] == len(points) and all(len(row.numbers) > 1 for row in points):
            x, depth = np.array([row.numbers[:2] for row in points]).T * [[1e3], [1.0]]
            across = 0.5 * np.ptp(x) * np.array([-1.0, 1.0])
            return grid_surface(x, across, -np.tile(depth, (2, 1)))
        return grid_surface(*_bathymetry_grid(rows))
    except ValueError as error:
        raise MeshError(str(error)) from None


def _bathymetry_grid(rows: list[FortranRow]) -> tuple[Floats, Floats, Floats]:
    """x, y and heights (y, x) in m. Raises ValueError."""
    if len(rows) < 4:
        raise ValueError("is cut off: it has no axes, nor depths")
    (columns,), (lines,) = rows[0].axis(1), rows[2].axis(1)
    x, y = rows[1].axis(columns, 1e3), rows[3].axis(lines, 1e3)
    if len(rows) - 4 < lines:
        raise ValueError(f"is cut off: {len(rows) - 4} rows of depths, not {lines:g}")
    depth = [row.axis(columns) for row in rows[4 : 4 + int(lines)]]
    return np.array(x), np.array(y), -np.array(depth)


def read_npz(data: bytes) -> Surface:
    """Arrays x (x,), y (y,) and z, or depth, (y, x). Raises MeshError."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(member.file_size for member in archive.infolist())
        if unpacked > 64 * max_facets():
            raise MeshError(f"would unpack to {unpacked} bytes")
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: np.asarray(archive[name], float) for name in archive.files}
    except MeshError:
        raise
    except Exception as error:  # whatever a damaged file may bring
        raise MeshError(f"cannot be read as npz ({type(error).__name__})") from None
    return grid_surface(*_picked(arrays))


def read_netcdf_grid(data: bytes) -> Surface:
    """A variable of two dimensions with a coordinate in metres each. Raises MeshError, FileError."""
    flat: dict[str, Floats] = {}
    with netcdf_files.netcdf(data, MeshError) as grid:
        for name, variable in grid.variables.items():
            wanted = _in_metres(str(name), str(variable.attrs.get("units", "m")).lower())
            if wanted and variable.size > max_facets():
                raise MeshError(f"has {variable.size} numbers '{name}', more than {max_facets()}")
            if wanted:
                down = str(variable.attrs.get("positive", "")).lower() == "down" and str(name).lower() != "depth"
                values = np.asarray(variable.values, float)
                transposed = values.ndim == 2 and str(variable.dims[0]).lower() in NAMES["x"]
                flat[str(name)] = (-1.0 if down else 1.0) * (values.T if transposed else values)
    return grid_surface(*_picked(flat))


def _in_metres(name: str, unit: str) -> bool:
    """Whether a variable is one of the grid. Raises MeshError where its unit is not the metre."""
    wanted = name.lower() in sum(NAMES.values(), ())
    if "degree" in unit and (wanted or name.lower() in ("lat", "lon", "latitude", "longitude")):
        raise MeshError(f"has '{name}' in degrees: a grid in metres, east and north, is needed")
    if wanted and unit not in ("m", "metre", "metres", "meter", "meters", "1", ""):
        raise MeshError(f"has '{name}' in {unit[:20]}: it must be in m")
    return wanted


def _picked(arrays: dict[str, Any]) -> tuple[Floats, Floats, Floats]:
    """x, y and z by their names; heights that are depths with their sign turned."""
    picked = []
    for axis, names in NAMES.items():
        matching = [name for name in arrays if name.lower() in names]
        if len(matching) != 1:
            listed = ", ".join(list(arrays)[:8]) or "nothing"
            raise MeshError(f"must hold {' or '.join(names)} once, for {axis}; it holds {listed}")
        picked.append(arrays[matching[0]] * (-1.0 if matching[0].lower() == "depth" else 1.0))
    return picked[0], picked[1], picked[2]


def _number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def over_floor(surface: Surface, floor: float, least: float) -> tuple[Surface, float, float]:
    """What of a surface rises over a floor (z, m) by more than `least` (m): other vertices are brought to the floor,
    facets in it are dropped, and where the rest has a border over it a wall goes down. Also the area (m2) and the
    greatest depth (m) of what was under the floor.
    """
    vertices, faces = surface
    under = faces[(vertices[:, 2] < floor - LEVEL)[faces].any(axis=1)]
    area = 0.5 * float(np.abs(_plan_area(vertices[under])).sum())
    deepest = float(floor - vertices[under, 2].min(initial=floor))
    vertices = vertices.copy()
    on_floor: Bools = vertices[:, 2] <= floor + max(least, LEVEL)
    vertices[on_floor, 2] = floor
    faces = faces[~on_floor[faces].all(axis=1)]
    sides = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    code = np.sort(sides, axis=1)
    _, first, count = np.unique(code, axis=0, return_index=True, return_counts=True)
    border = sides[first[count == 1]]
    border = border[~on_floor[border].all(axis=1)]
    below = np.arange(len(border) * 2).reshape(-1, 2) + len(vertices)
    feet = vertices[border.ravel()] * [1.0, 1.0, 0.0] + [0.0, 0.0, floor]
    wall = [np.stack([border[:, 1], border[:, 0], below[:, 0]], 1), np.stack([border[:, 1], *below.T], 1)]
    vertices, faces = np.concatenate([vertices, feet]), np.concatenate([faces, *wall])
    return weld((vertices, faces[~without_area(vertices[faces])])), area, deepest


def _plan_area(corners: Floats) -> Floats:
    """Twice the signed area (facet,) of facets (facet, 3, xyz) seen from above."""
    (ax, ay), (bx, by) = (corners[:, 1] - corners[:, 0]).T[:2], (corners[:, 2] - corners[:, 0]).T[:2]
    return np.asarray(ax * by - ay * bx)
