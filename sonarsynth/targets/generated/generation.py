"""Surfaces of the shapes that are generated: closed, outward, refined on the true surface."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.geometry.surfaces import (
    Surface,
    area_of,
    join,
    longest_edge,
    require_possible,
    split_long_edges,
    volume,
)
from sonarsynth.targets.generated.blocks import blocks
from sonarsynth.targets.generated.myring import hull_meridian
from sonarsynth.targets.generated.octahedra import knots, members, octahedra
from sonarsynth.targets.generated.remus import HULL, remus100
from sonarsynth.targets.generated.revolution import Arc, enclosed_volume, line, revolve
from sonarsynth.targets.shapes import Box, Cylinder, Knots, LShape, MeshFile, Myring, Remus100, School, Shape, Sphere

DEFAULT = 8.0
"""Edges of curved shapes, where left out: the radius over this."""


def generate(shape: Shape, edge: float = np.inf, sagitta: float = np.inf) -> tuple[Surface, tuple[str, ...]]:
    """Surface and notes of a generated shape; raises MeshError where it would take too many facets.

    edge, sagitta (m): no edge longer than that, and a mean distance from the true surface of about that at most, where
    the shape's own edge is not finer. Long thin facets serve where a body is flat along one direction.
    """
    match shape:
        case Sphere():
            finest = min(edge, 1.15 * np.sqrt(8.0 * shape.radius * sagitta))  # the longest edge is 1.15 times the mean
            surface = sphere(shape.radius, min(shape.edge or shape.radius / DEFAULT, finest))
            return surface, _inscribed(surface, 4 / 3 * np.pi * shape.radius**3)
        case Cylinder():
            meridian = _cylinder(shape)
            surface = revolve(meridian, min(shape.edge or shape.radius / DEFAULT, edge), sagitta)
            return surface, _inscribed(surface, np.pi * shape.radius**2 * shape.length)
        case Myring():
            meridian = hull_meridian(shape)
            surface = revolve(meridian, min(shape.edge or 0.5 * shape.diameter / DEFAULT, edge), sagitta)
            return surface, _inscribed(surface, enclosed_volume(meridian))
        case Remus100():
            hull, fins = remus100(shape, edge, sagitta)
            return join(hull, *fins), _inscribed(hull, enclosed_volume(hull_meridian(HULL)))
        case Box():
            return (_refined(box(shape), shape.edge) if _finer(shape.edge, edge) else _box(shape, edge)), ()
        case LShape():
            return (_refined(l_shape(shape), shape.edge) if _finer(shape.edge, edge) else _l_shape(shape, edge)), ()
        case Knots():
            return _refined(octahedra(knots(shape), shape.radius), edge), ()
        case School():
            return _refined(octahedra(members(shape), shape.radius), edge), ()
        case MeshFile():
            raise TypeError("a mesh file is read, not generated")


def _finer(own: float | None, edge: float) -> bool:
    return (np.inf if own is None else own) <= edge


def _inscribed(surface: Surface, true_volume: float) -> tuple[str, ...]:
    """The note that says how much smaller than the true body its inscribed mesh is."""
    missing = true_volume - volume(surface)
    return (f"mesh lies on average {1e3 * missing / area_of(surface):.2g} mm inside the true surface",)


def _refined(surface: Surface, edge: float | None) -> Surface:
    return surface if edge is None else split_long_edges(surface, edge)


def _cylinder(shape: Cylinder) -> list[Arc]:
    half, r = 0.5 * shape.length, shape.radius
    corners = [(half, 0.0), (half, r), (-half, r), (-half, 0.0)]
    return [line(a, b) for a, b in pairwise(corners)]


def sphere(radius: float, edge: float) -> Surface:
    """Geodesic sphere: the facets of an icosahedron cut in n^2 and brought onto the sphere, no longer than `edge`."""
    corners, faces = _icosahedron()
    require_possible(4.0 * np.pi * radius**2, edge)
    n = max(1, int(np.ceil(np.arccos(1 / np.sqrt(5)) * radius / edge)))
    while True:
        points, fine = _cut_evenly(corners, faces, n)
        points *= radius / np.linalg.norm(points, axis=1)[:, None]
        longest = longest_edge((points, fine))
        if longest <= edge:
            return points, fine
        n = max(n + 1, int(n * longest / edge))


def _icosahedron() -> Surface:
    """Regular icosahedron on the unit sphere, with vertices at the poles of z."""
    turn = 0.4 * np.pi * np.arange(5)
    z, r = 1 / np.sqrt(5), 2 / np.sqrt(5)
    upper = np.stack([r * np.cos(turn), r * np.sin(turn), np.full(5, z)], 1)
    lower = np.stack([r * np.cos(turn + 0.2 * np.pi), r * np.sin(turn + 0.2 * np.pi), np.full(5, -z)], 1)
    i, j = np.arange(5), (np.arange(5) + 1) % 5
    north, south, u, v, lo, hi = np.full(5, 0), np.full(5, 11), 1 + i, 1 + j, 6 + i, 6 + j
    triples = [(north, u, v), (u, lo, v), (v, lo, hi), (south, hi, lo)]
    faces = np.concatenate([np.stack(t, 1) for t in triples])
    return np.concatenate([[[0.0, 0, 1]], upper, lower, [[0.0, 0, -1]]]), faces


def _cut_evenly(vertices: Floats, faces: Ints, n: int) -> Surface:
    """Each facet cut in n^2 by lines parallel to its sides; vertices on shared sides are shared."""
    a, b = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    a, b = a[a + b <= n], b[a + b <= n]
    weight = np.stack([n - a - b, a, b], axis=1)  # (point, corner), whole numbers that add up to n
    number = np.full((n + 2, n + 2), -1)
    number[a, b] = np.arange(len(a))
    up = np.stack([number[a, b], number[a + 1, b], number[a, b + 1]], 1)[a + b < n]
    down = np.stack([number[a + 1, b], number[a + 1, b + 1], number[a, b + 1]], 1)[a + b < n - 1]
    pattern = np.concatenate([up, down])
    points = np.einsum("pc,fcx->fpx", weight / n, vertices[faces]).reshape(-1, 3)
    # A vertex is known by its corners and their weights, not by rounded coordinates.
    code = np.where(weight[None] > 0, faces[:, None, :] * (n + 1) + weight[None], 0)
    code = np.sort(code.reshape(-1, 3), axis=1) @ (len(vertices) * (n + 1)) ** np.arange(2, -1, -1)
    _, first, same = np.unique(code, return_index=True, return_inverse=True)
    fine = (pattern[None] + len(a) * np.arange(len(faces))[:, None, None]).reshape(-1, 3)
    return points[first], same.ravel()[fine]


def box(shape: Box) -> Surface:
    """A box of twelve facets."""
    half = 0.5 * np.array(shape.size)
    sign = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return sign * half, _halved(quads)


def l_shape(shape: LShape) -> Surface:
    """An L of twenty facets: its outline in the plane of x and z, drawn out along y."""
    t = shape.thickness
    outline = [(-t, -t), (shape.length, -t), (shape.length, 0.0), (0.0, 0.0), (0.0, shape.height), (-t, shape.height)]
    points = [(x, sign * 0.5 * shape.width, z) for sign in (-1, 1) for x, z in outline]
    edges = [(i, (i + 1) % 6) for i in range(6)]
    sides = [(j, i, i + 6, j + 6) for i, j in edges]
    starboard, port = [(0, 1, 2, 3), (0, 3, 4, 5)], [(9, 8, 7, 6), (11, 10, 9, 6)]
    return np.array(points), _halved([*starboard, *port, *sides])


def _box(shape: Box, edge: float) -> Surface:
    half = [0.5 * length for length in shape.size]
    return blocks([(-h, h) for h in half], np.ones((1, 1, 1), bool), edge)


def _l_shape(shape: LShape, edge: float) -> Surface:
    t, half = shape.thickness, 0.5 * shape.width
    solid = np.array([[[True, True]], [[True, False]]])  # (x, y, z): foot, upright plate above it, lying plate forward
    return blocks([(-t, 0.0, shape.length), (-half, half), (-t, 0.0, shape.height)], solid, edge)


def _halved(quads: list[tuple[int, int, int, int]]) -> Ints:
    return np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])
