"""How strongly the surface that a mesh stands for is curved, from the angles between its facets."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.surfaces import joined, shared_sides, weld

CREASE: Final = 1.0
"""|n1 - n2| of the normals of two facets from which on their edge is one of the body itself: 60 degrees."""
FLAT: Final = 1e-6
"""|n1 - n2| up to which two facets are one plane."""


class Neighbours(NamedTuple):
    """Pairs of facets that share an edge; edges of one facet, or of more than two, are left out."""

    facet: Ints  # (pair,)
    neighbour: Ints  # (pair,) the facet across the edge
    start: Floats  # (pair, xyz) m: the edge, as `facet` runs along it
    stop: Floats  # (pair, xyz) m
    turn: Floats  # (pair,) |n1 - n2|


def neighbours(mesh: Mesh) -> Neighbours:
    """Facets that share an edge; vertices in the same place are one."""
    _, faces = weld((mesh.vertices, mesh.faces.astype(np.int64)))
    edge_start, beyond = shared_sides(faces)
    facet, neighbour, corner = edge_start // 3, beyond // 3, edge_start % 3
    turn = np.linalg.norm(mesh.normal[facet] - mesh.normal[neighbour], axis=1)
    start, stop = (mesh.vertices[mesh.faces[facet, n]] for n in (corner, (corner + 1) % 3))
    return Neighbours(facet, neighbour, start, stop, turn)


def curvature_radius(mesh: Mesh) -> Floats:
    """Smallest radius of curvature (facet,) in m of the surface about each facet; infinite where it is flat.

    Across an edge the surface turns by the angle between the normals over the way between the middles of the two
    facets: |c1 - c2|/|n1 - n2|. Edges of more than 60 degrees are creases, and the surface ends there. With edges
    of an eighth of the radius it is 0.87 to 1.00 of that of a sphere, 1.02 of that of a cylinder.
    """
    pair = neighbours(mesh)
    smooth = (pair.turn > FLAT) & (pair.turn < CREASE)
    facet, neighbour = pair.facet[smooth], pair.neighbour[smooth]
    radius = np.linalg.norm(mesh.centroid[facet] - mesh.centroid[neighbour], axis=1) / pair.turn[smooth]
    out = np.full(len(mesh.faces), np.inf)
    np.minimum.at(out, facet, radius)
    np.minimum.at(out, neighbour, radius)
    return out


class Bend(NamedTuple):
    """How far the flat facets of a mesh lie inside the curved surface through their corners."""

    sagitta: Floats  # (facet,) m: mean distance over the flat piece that the facet belongs to
    across: Floats  # (facet,) m: edge of an equilateral facet as long as that piece across the curve; 0 where flat


@byte_bounded_cache(4)
def bend(mesh: Mesh) -> Bend:
    """Mean sagitta and extent across the curve, of the flat pieces of a mesh: facets in one plane are one piece.

    The mean distance of a triangle from the paraboloid through its corners is tr(S C) 3/2, with the shape operator S
    (1/m) and the covariance C (m2) of its area: L^2/(8 a) where its edges are L and the radius is a. What is long
    along a flat direction, or cut in its plane, is so neither better nor worse for it. S is the mean gradient of the
    normal, by the divergence theorem: the sum over the piece's rim of (edge's normal) (outward) length over area,
    the edge's normal halving the angle between the facets. Principal curvatures count by their size, on a saddle too.
    """
    piece, pairs = flat_pieces(mesh)
    count = int(piece.max()) + 1
    area = np.bincount(piece, mesh.area, count).astype(float)
    middle = _sums(piece, mesh.area[:, None] * mesh.centroid, count) / area[:, None]
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    off = mesh.centroid - middle[piece]
    spread = np.einsum("fei,fej->fij", edges, edges) / 36.0 + off[:, :, None] * off[:, None, :]
    covariance = _sums(piece, (mesh.area[:, None, None] * spread).reshape(-1, 9), count) / area[:, None]
    c = covariance.reshape(-1, 3, 3)
    s = _shape_operators(mesh, piece, _smooth(mesh, pairs), area)
    # |S| = (S^2 + |det S| 1)/sqrt(tr S^2 + 2 |det S|), by Cayley and Hamilton: S as if no curvature were negative.
    square = s @ s
    trace = np.trace(square, axis1=1, axis2=2)
    determinant = 0.5 * np.abs(np.trace(s, axis1=1, axis2=2) ** 2 - trace)
    total = np.sqrt(trace + 2.0 * determinant)  # tr |S|
    wanted = np.einsum("pij,pij->p", square, c) + determinant * np.trace(c, axis1=1, axis2=2)  # tr |S| times tr(|S| C)
    nonzero = np.where(total > 0, total, 1.0)
    sagitta = 1.5 * wanted / nonzero
    across = np.sqrt(24.0 * wanted) / nonzero
    return Bend(sagitta[piece], across[piece])


def flat_pieces(mesh: Mesh) -> tuple[Ints, Neighbours]:
    """The flat piece (facet,) that each facet belongs to, numbered from 0, and the neighbours."""
    pairs = neighbours(mesh)
    flat = pairs.turn <= FLAT
    return joined(len(mesh.faces), pairs.facet[flat], pairs.neighbour[flat]), pairs


def _smooth(mesh: Mesh, pairs: Neighbours) -> Neighbours:
    """The pairs across whose edge the surface goes on in a curve."""
    smooth = (pairs.turn > FLAT) & (pairs.turn < CREASE)
    if mesh.flat is not None:
        smooth &= ~(mesh.flat[pairs.facet] | mesh.flat[pairs.neighbour])
    facet, neighbour, start, stop, turn = pairs
    return Neighbours(facet[smooth], neighbour[smooth], start[smooth], stop[smooth], turn[smooth])


def _shape_operators(mesh: Mesh, piece: Ints, pairs: Neighbours, area: Floats) -> Floats:
    """(piece, 3, 3) mean gradient of the normal over each flat piece (1/m): symmetric, in its plane."""
    along = pairs.stop - pairs.start
    half = mesh.normal[pairs.facet] + mesh.normal[pairs.neighbour]
    half /= np.linalg.norm(half, axis=1)[:, None]
    total = np.zeros((len(area), 9))
    for facet, sense in ((pairs.facet, 1.0), (pairs.neighbour, -1.0)):
        normal = mesh.normal[facet]
        tangent = half - np.einsum("pi,pi->p", half, normal)[:, None] * normal
        outward = np.cross(sense * along, normal)
        total += _sums(piece[facet], (tangent[:, :, None] * outward[:, None, :]).reshape(-1, 9), len(area))
    gradient = (total / area[:, None]).reshape(-1, 3, 3)
    return np.asarray(0.5 * (gradient + np.swapaxes(gradient, 1, 2)))


def _sums(group: Ints, values: Floats, count: int) -> Floats:
    """(group, column) sums of values (row, column)."""
    return np.stack([np.bincount(group, column, count) for column in values.T], axis=1)
