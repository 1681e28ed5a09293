"""3MF files: the meshes of the build, each in its place, in metres.

3MF Consortium (2018), "3D Manufacturing Format: Core Specification", version 1.2. Parts of other files of the archive
(production extension) are refused.
"""

from __future__ import annotations

from typing import Final
from xml.etree.ElementTree import Element

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.file_formats.plain_xml import parsed_xml
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface
from sonarsynth.targets.mesh_readers.mesh_archives import only_file

CORE: Final = "{http:" + "//schemas.microsoft.com/3dmanufacturing/core/2015/02}"
METRES: Final = {"micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0}
DEEPEST: Final = 20
"""Components within components."""
MOST_PLACED: Final = 100_000
"""Objects in all."""


def read_3mf(data: bytes) -> Surface:
    """Vertices (m) and triangles of all items of the build. Raises MeshError, FileError."""
    root = parsed_xml(only_file(data, ".model"))
    scale = METRES.get(root.get("unit", "millimeter"))
    if scale is None:
        raise MeshError(f"is in a unit that no 3MF has: '{str(root.get('unit'))[:20]}'")
    objects = {node.get("id", ""): node for node in root.iter(f"{CORE}object")}
    vertices: list[Floats] = []
    faces: list[np.ndarray] = []
    placed: list[str] = []
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # places that are not finite are refused of all files alike
            for item in root.iter(f"{CORE}item"):
                _refuse_other_parts(item)
                _place(objects, item.get("objectid", ""), _matrix(item), vertices, faces, placed)
    except (ValueError, TypeError, KeyError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"cannot be read as 3MF ({type(error).__name__}: {str(error)[:80]})") from None
    if not faces:
        raise MeshError("holds no facets")
    first = np.cumsum([0, *(len(v) for v in vertices)])
    every = np.concatenate([f + start for f, start in zip(faces, first[:-1], strict=True)])
    return np.concatenate(vertices) * scale, every


def _place(
    objects: dict[str, Element],
    name: str,
    matrix: Floats,
    vertices: list[Floats],
    faces: list[np.ndarray],
    placed: list[str],
    depth: int = DEEPEST,
) -> None:
    """The mesh of an object through a matrix, and those of its components. Raises MeshError."""
    node = objects.get(name)
    if node is None:
        raise MeshError(f"places object '{name[:20]}', which is not in its model")
    placed.append(name)
    if depth == 0 or len(placed) > MOST_PLACED:
        raise MeshError("has components within components without end")
    for component in node.iter(f"{CORE}component"):
        _refuse_other_parts(component)
        inner = _matrix(component)
        _place(objects, component.get("objectid", ""), inner @ matrix, vertices, faces, placed, depth - 1)
    mesh = node.find(f"{CORE}mesh")
    if mesh is None or node.get("type", "model") not in ("model", "solidsupport", "surface", "other"):
        return
    places = np.array([[float(v.get(axis, "nan")) for axis in "xyz"] for v in mesh.iter(f"{CORE}vertex")])
    corners = np.array([[int(t.get(f"v{k}", -1)) for k in (1, 2, 3)] for t in mesh.iter(f"{CORE}triangle")], np.int64)
    if not corners.size:
        return
    if corners.min() < 0 or corners.max() >= len(places):
        raise MeshError(f"object '{name[:20]}' has an index out of range: there are {len(places)} vertices")
    if sum(map(len, faces)) + len(corners) > max_facets():
        raise MeshError(f"places more than {max_facets()} facets")
    used, corners = np.unique(corners, return_inverse=True)  # so that facets bound vertices
    corners = corners.reshape(-1, 3)
    vertices.append(places[used] @ matrix[:3, :3] + matrix[3, :3])
    faces.append(corners if np.linalg.det(matrix[:3, :3]) > 0.0 else corners[:, ::-1])


def _refuse_other_parts(element: Element) -> None:
    """Objects of the production extension lie in other files of the archive."""
    if any(key.rpartition("}")[2] == "path" for key in element.attrib):
        raise MeshError("has parts in other files of the archive, which are not read")


def _matrix(element: Element) -> Floats:
    """Rows of a transform (4, 4): three of the axes, then the shift; a point is a row to their left."""
    numbers = [float(n) for n in element.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0").split()]
    if len(numbers) != 12 or not np.isfinite(numbers).all():
        raise MeshError("has a transform that is not 12 finite numbers")
    return np.hstack([np.array(numbers).reshape(4, 3), [[0.0], [0.0], [0.0], [1.0]]])
