"""COLLADA files (.dae, and .zae that packs one): every instance in its place, in metres, with z up.

Khronos (2008), "COLLADA - Digital Asset Schema", release 1.4.1 and 1.5. Read through pycollada; what it would look for
elsewhere (pictures, other documents) is not asked for.
"""

from __future__ import annotations

import io
import warnings
from typing import Any, Final
from xml.etree.ElementTree import Element

import numpy as np

from sonarsynth.conventions import Ints
from sonarsynth.description.file_formats.plain_xml import parsed_xml, plain_xml
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface, join
from sonarsynth.targets.mesh_readers.mesh_archives import only_file
from sonarsynth.targets.mesh_readers.mesh_text import polygons

UP: Final = {
    "Z_UP": np.eye(3),
    "Y_UP": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "X_UP": np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]),
}
"""Matrices that bring the file's axes to x right, z up."""


LOOKS: Final = ("material", "effect", "image", "texture", "sampler", "camera", "light")
"""What a body may lack without changing its shape."""
MOST_PLACED: Final = 100_000


def read_collada(data: bytes) -> Surface:
    """Vertices (m, z up) and triangles of all instances in the scene. Raises MeshError, FileError."""
    text = plain_xml(only_file(data, ".dae") if data[:4] == b"PK\x03\x04" else data)
    if b"<COLLADA" not in text:
        raise MeshError("is no COLLADA file")
    if b"<ph>" in text:
        raise MeshError("has polygons with holes, which are not read")
    _check_placements(parsed_xml(text))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            surfaces, scale, axis = _read(text)
    except (MeshError, MemoryError):
        raise
    except Exception as error:  # whatever a damaged file may bring
        reason = " ".join(str(error).split())[:120]
        raise MeshError(f"cannot be read as COLLADA ({type(error).__name__}: {reason})") from None
    if not surfaces:
        raise MeshError("holds no facets")
    vertices, faces = join(*surfaces)
    return vertices @ UP.get(axis, UP["Y_UP"]).T * scale, faces


def _read(text: bytes) -> tuple[list[Surface], float, str]:
    """Vertices and triangles of each part in its place, metres of the file's unit, and its upward axis."""
    import collada
    from collada.common import DaeBrokenRefError, DaeIncompleteError, DaeUnsupportedError

    ignored = [DaeUnsupportedError, DaeBrokenRefError, DaeIncompleteError]
    document = collada.Collada(io.BytesIO(text), ignore=ignored, aux_file_loader=_no_file)
    if document.scene is None:
        raise MeshError("has no scene that places its meshes")
    if lost := next((e for e in document.errors if not any(word in str(e).lower() for word in LOOKS)), None):
        raise MeshError(f"has a part that cannot be read ({' '.join(str(lost).split())[:80]})")
    return _parts(document), float(document.assetInfo.unitmeter or 1.0), str(document.assetInfo.upaxis)


def _check_placements(root: Element) -> None:
    """Refuses a scene whose nodes contain themselves, or are placed too often (each may place two more)."""
    nodes = {element.get("id"): element for element in root.iter() if element.tag.endswith("}node")}
    sizes: dict[Element, int] = {}
    for start in nodes.values():
        under: list[tuple[Element, bool]] = [(start, False)]
        open_nodes: set[Element] = set()
        while under:
            node, counted = under.pop()
            named = [e.get("url", "").removeprefix("#") for e in node.iter() if e.tag.endswith("}instance_node")]
            placed = [nodes[name] for name in named if name in nodes]
            if counted:
                open_nodes.discard(node)
                sizes[node] = sum(1 for _ in node.iter()) + sum(sizes[inner] for inner in placed)
                if sizes[node] > MOST_PLACED:
                    raise MeshError(f"places more than {MOST_PLACED} nodes")
            elif node in open_nodes:
                raise MeshError("has a node that is placed in itself")
            elif node not in sizes:
                open_nodes.add(node)
                under += [(node, True), *((inner, False) for inner in placed if inner not in sizes)]


def _no_file(name: str) -> bytes:
    raise OSError(f"{name} is not looked for")


def _parts(document: Any) -> list[Surface]:
    """Vertices and triangles of each primitive of each instance."""
    surfaces: list[Surface] = []
    total = 0
    for bound in (*document.scene.objects("geometry"), *_skins(document)):
        for primitive in bound.primitives():
            index, counts = _corners(primitive)
            total += len(index)
            if total > 3 * max_facets():
                raise MeshError(f"places more than {max_facets()} facets")
            if len(counts):
                vertices = np.asarray(primitive.vertex, float)
                if index.size and (index.min() < 0 or index.max() >= len(vertices)):
                    raise MeshError(f"has an index out of range: there are {len(vertices)} vertices")
                faces = polygons(vertices, counts, index)
                mirrored = np.linalg.det(np.asarray(getattr(bound, "matrix", np.eye(4)), float)[:3, :3]) < 0.0
                surfaces.append((vertices, faces[:, ::-1] if mirrored else faces))
    return surfaces


def _skins(document: Any) -> list[Any]:
    """Geometries that skeletons would bend, as they stand at rest."""
    return [bound.geometry for bound in document.scene.objects("controller") if hasattr(bound, "geometry")]


def _corners(primitive: Any) -> tuple[Ints, Ints]:
    """Corners of all polygons of a primitive in a row, and how many each has; none of lines."""
    kind = type(primitive).__name__
    if kind not in ("BoundTriangleSet", "BoundPolylist", "BoundPolygons") or primitive.vertex_index is None:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    index = np.asarray(primitive.vertex_index, np.int64).ravel()
    if kind == "BoundTriangleSet":
        return index, np.full(len(index) // 3, 3)
    counts = np.asarray(primitive.original.vcounts if hasattr(primitive, "original") else primitive.vcounts, np.int64)
    return _at_least_three(index, counts)


def _at_least_three(index: Ints, counts: Ints) -> tuple[Ints, Ints]:
    good = counts >= 3
    return (index, counts) if good.all() else (index[np.repeat(good, counts)], counts[good])
