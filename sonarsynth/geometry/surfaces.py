"""Operations on bare triangle meshes (vertices (vertex, xyz), faces (facet, 3)): joining, welding, splitting edges."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description.memory import max_facets

Surface = tuple[Floats, Ints]
"""Vertices (vertex, xyz) in m and faces (facet, 3), counter-clockwise seen from outside."""


Facets = tuple[Floats, Ints | npt.NDArray[np.int32]]
"""The same, with faces as a mesh keeps them."""
BLOCK: Final = 250_000
"""Facets that are looked at at a time."""


class MeshError(ValueError):
    """A mesh that cannot be used: one line that names it and the reason."""


def join(*surfaces: Surface) -> Surface:
    """One surface of several, in order."""
    starts = np.cumsum([0, *(len(v) for v, _ in surfaces[:-1])])
    vertices = np.concatenate([v for v, _ in surfaces])
    return vertices, np.concatenate([f + start for (_, f), start in zip(surfaces, starts, strict=True)])


def weld(surface: Surface, tolerance: float = 0.0) -> Surface:
    """Merge vertices that are equal (or in one cell of a grid of `tolerance`, m), and drop those that no facet uses.

    The first of equal vertices stays, and vertices are numbered in the order in which facets use them first. Facets
    that lose a corner stay, with a repeated index.
    """
    vertices, faces = surface
    used, index = np.unique(faces, return_inverse=True)
    points = vertices[used] + 0.0  # -0 is 0
    key = np.round(points / tolerance) + 0.0 if tolerance > 0 else points
    _, first, same = np.unique(key, axis=0, return_index=True, return_inverse=True)
    corner = first[same.ravel()][index.ravel()]  # the vertex that stays for each corner
    remaining, first_use, corner = np.unique(corner, return_index=True, return_inverse=True)
    order = np.argsort(first_use)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return points[remaining[order]], rank[corner.ravel()].reshape(-1, 3)


def longest_edge(surface: Facets) -> float:
    """The longest edge of any facet (m)."""
    vertices, faces = surface
    longest = 0.0
    for first in range(0, len(faces), BLOCK):
        corners = vertices[faces[first : first + BLOCK]]
        longest = max(longest, float(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max()))
    return longest


def volume(surface: Facets) -> float:
    """Signed volume (m3): positive for a closed surface with outward normals."""
    vertices, faces = surface
    six = 0.0
    for first in range(0, len(faces), BLOCK):
        a, b, c = np.moveaxis(vertices[faces[first : first + BLOCK]], 1, 0)
        six += float(np.einsum("fi,fi->", a, np.cross(b, c)))
    return six / 6.0


def area_of(surface: Facets) -> float:
    """Area of all facets (m2)."""
    vertices, faces = surface
    area = 0.0
    for first in range(0, len(faces), BLOCK):
        a, b, c = np.moveaxis(vertices[faces[first : first + BLOCK]], 1, 0)
        area += 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    return area


def require_possible(area: float, edge: float) -> None:
    """Raise MeshError where even equilateral facets with that edge (m) would be too many on that area (m2)."""
    if area > max_facets() * 0.25 * np.sqrt(3.0) * edge**2:
        raise _too_fine(edge)


def _too_fine(edge: float) -> MeshError:
    return MeshError(f"edges of {edge:g} m would take more than {max_facets()} facets; use a longer edge")


def split_long_edges(surface: Surface, edge: float) -> Surface:
    """Cut facets in two, three or four at the middles of edges longer than `edge` (m), again until none is left.

    Edges are cut for both facets that share them, so a closed surface stays closed; the surface itself stays as it is.
    Raises MeshError where that would take more than `memory.max_facets`.
    """
    vertices, faces = surface
    require_possible(area_of(surface), edge)
    if _split_count(surface, edge) > 1.25 * max_facets():  # known before it is done: the last cuts take seconds
        raise _too_fine(edge)
    while True:
        ends, of_facet = sides(faces)
        length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
        long = length > edge
        if not long.any():
            return vertices, faces
        if len(faces) + np.count_nonzero(long[of_facet]) > max_facets():
            raise _too_fine(edge)
        middle = np.full(len(ends), -1)
        middle[long] = len(vertices) + np.arange(np.count_nonzero(long))
        vertices = np.concatenate([vertices, vertices[ends[long]].mean(axis=1)])
        faces = cut(vertices, faces, middle[of_facet])


def _split_count(surface: Surface, edge: float) -> float:
    """About how many facets `split_long_edges` makes: while three edges of a facet are long, each round makes four of
    it, then three while two are, then two."""
    vertices, faces = surface
    count = 0.0
    for first in range(0, len(faces), BLOCK):
        corners = vertices[faces[first : first + BLOCK]]
        length = np.sort(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2), axis=1)
        short, middle, long = np.ceil(np.log2(np.maximum(length / edge, 1.0))).T
        count += float(np.exp2(2.0 * short + np.log2(3.0) * (middle - short) + (long - middle)).sum())
    return count


def halve_longest_edges(surface: Surface, edge: float) -> Surface:
    """Cut facets across their longest edges until none is longer than `edge` (m); the surface stays as it is.

    Rivara (1984), "Algorithms for refining triangular grids suitable for adaptive and multigrid techniques",
    International Journal for Numerical Methods in Engineering 20, 745-756: a facet with a cut edge is cut across its
    longest one as well, so facets become no thinner. A sixth to a third fewer facets than of `split_long_edges` where
    they are not equilateral, in twice the time. Closed surfaces stay closed. Raises MeshError as that.
    """
    vertices, faces = surface
    require_possible(area_of(surface), edge)
    while True:
        ends, of_facet = sides(faces)
        length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)[of_facet]
        longest = np.take_along_axis(of_facet, np.argmax(length, axis=1)[:, None], axis=1)[:, 0]
        marked = np.zeros(len(ends), bool)
        marked[longest[length.max(axis=1) > edge]] = True
        if not marked.any():
            return vertices, faces
        number = 0
        while number != (number := int(np.count_nonzero(marked))):
            marked[longest[marked[of_facet].any(axis=1)]] = True
        if len(faces) + np.count_nonzero(marked[of_facet]) > max_facets():
            raise _too_fine(edge)
        middle = np.full(len(ends), -1)
        middle[marked] = len(vertices) + np.arange(number)
        vertices = np.concatenate([vertices, vertices[ends[marked]].mean(axis=1)])
        faces = cut(vertices, faces, middle[of_facet])


def sides(faces: Ints) -> tuple[Ints, npt.NDArray[np.intp]]:
    """Edges (edge, 2) with ascending ends, and the edge (facet, 3) from each corner to the next."""
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    code = pairs[:, 0] * (int(faces.max()) + 1) + pairs[:, 1]
    _, first, edge = np.unique(code, return_index=True, return_inverse=True)
    return pairs[first], edge.reshape(-1, 3)


def joined(number: int, first: Ints, second: Ints) -> Ints:
    """The part (thing,), counted from 0, of each of `number` things, of which those of each pair (pair,) are joined."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(first), np.int8), (first, second)), shape=(number, number))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def shared_sides(faces: Ints) -> tuple[Ints, Ints]:
    """Sides (pair,) and (pair,), 3 facet + corner, of two facets that share an edge with no third."""
    edge = sides(faces)[1].ravel()
    order = np.argsort(edge, kind="stable")
    first = np.flatnonzero(np.diff(edge[order], prepend=-1))
    pair = first[np.diff(np.append(first, len(edge))) == 2]
    return order[pair], order[pair + 1]


def cut(vertices: Floats, faces: Ints, middle: Ints) -> Ints:
    """Facets cut at the middles (facet, 3) of their sides, -1 where a side is whole; in the order of the facets."""
    cuts = np.count_nonzero(middle >= 0, axis=1)
    # Turn each facet so that its cut sides come first (the whole side last, the cut side first).
    turn = np.zeros(len(faces), int)
    turn[cuts == 1] = np.argmax(middle[cuts == 1] >= 0, axis=1)
    turn[cuts == 2] = (np.argmin(middle[cuts == 2] >= 0, axis=1) + 1) % 3
    take = (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (ab, bc, ca) = (np.take_along_axis(x, take, axis=1).T for x in (faces, middle))
    pieces = np.full((len(faces), 4, 3), -1)
    one, two, three = cuts == 1, cuts == 2, cuts == 3
    pieces[cuts == 0, 0] = np.stack([a, b, c], 1)[cuts == 0]
    pieces[one, :2] = np.stack([np.stack([a, ab, c], 1), np.stack([ab, b, c], 1)], 1)[one]
    # Two cuts leave a quadrangle a, ab, bc, c: halve it along its shorter diagonal.
    short = np.zeros(len(faces), bool)
    short[two] = np.linalg.norm(vertices[a[two]] - vertices[bc[two]], axis=1) <= np.linalg.norm(
        vertices[ab[two]] - vertices[c[two]], axis=1
    )
    first, second = two & short, two & ~short
    pieces[two, 0] = np.stack([ab, b, bc], 1)[two]
    pieces[first, 1:3] = np.stack([np.stack([a, ab, bc], 1), np.stack([a, bc, c], 1)], 1)[first]
    pieces[second, 1:3] = np.stack([np.stack([a, ab, c], 1), np.stack([ab, bc, c], 1)], 1)[second]
    corners = [np.stack(corner, 1) for corner in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    pieces[three] = np.stack(corners, 1)[three]
    return pieces[pieces[:, :, 0] >= 0]
