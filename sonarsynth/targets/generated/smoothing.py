"""Meshes that stand for curved surfaces: cut along curves through their corners, with smooth normals and sharp creases.

As the curved triangles of Vlachos, Peters, Boyd and Mitchell (2001), "Curved PN triangles", Interactive 3D Graphics
159-166, the curve along an edge is known by its ends and their normals alone, so that facets share it and no gap opens.
Its middle is that of a circle, as in Yang (2005), "Normal based subdivision scheme for curve design", Computer Aided
Geometric Design 22, 243-260: spheres and cylinders come out exact, up to their normals.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface, cut, joined, require_possible, shared_sides, sides

FLAT: Final = 1e-6
"""Angle (rad) up to which two facets are one plane."""
SAME: Final = 1e-3
"""Angle (rad) up to which two normals beside an edge are one."""
STEEP: Final = 0.3
"""Cosine of the angle between an edge and the surface at its end beyond which the edge stays straight there."""
LONG: Final = 2.0
"""Edges of a facet over those of the others at a corner from which on it weighs more in the normal there."""
BEHIND: Final = 0.15
"""Cosine of the angle between a facet and the normal at its corner beyond which the facet keeps its own."""
TINY: Final = 1e-300
LEVELS: Final = 40
"""Halvings of an edge at most."""


def curved(surface: Surface, edge: float, sagitta: float, crease: float) -> Surface:
    """The surface cut until no edge is longer than `edge` (m), nor farther than `sagitta` (m) from its curve.

    Edges that turn by more than `crease` (rad) stay sharp, and straight where both sides are flat; corners stay where
    they are. Raises MeshError where that would take more than `memory.max_facets`.
    """
    vertices, faces = surface
    if np.isfinite(edge):
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        require_possible(0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()), edge)
    normals = corner_normals(surface, crease)
    for _ in range(LEVELS):
        ends, of_facet = sides(faces)
        curves = _curves(vertices, faces, normals, ends, of_facet)
        length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
        long = (length > edge) | (curves.height > sagitta)
        if not long.any():
            break
        if len(faces) + np.count_nonzero(long[of_facet]) > max_facets():
            raise MeshError(f"so smooth a surface would take more than {max_facets()} facets; use a longer edge")
        number = np.full(len(ends), -1)
        number[long] = len(vertices) + np.arange(np.count_nonzero(long))
        vertices = np.concatenate([vertices, curves.middle[long]])
        faces, normals = _cut(vertices, faces, normals, number[of_facet], curves.tangent[of_facet])
    return vertices, faces


def corner_normals(surface: Surface, crease: float) -> Floats:
    """Unit normals (facet, 3, xyz) at the corners of facets: one for all facets round a vertex that no crease parts.

    The mean of the facets' normals with the weights of Max (1999), "Weights for computing vertex normals from facet
    normals", Journal of Graphics Tools 4(2), 1-6: sin(angle)/(product of the edges), exact on a sphere.
    Facets in one plane count as one, so that it is the same by which diagonal a face is halved. Faces with
    edges far longer than the others' at a corner weigh more: what runs on flat beside small facets stays nearly flat.
    """
    vertices, faces = surface
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(cross, axis=1)
    normal = cross / size[:, None]
    facet, neighbour, joint = _pairs(faces)
    turn = np.linalg.norm(normal[facet] - normal[neighbour], axis=1)  # 2 sin(angle/2)
    flat, smooth = turn <= FLAT, turn <= 2.0 * np.sin(0.5 * crease)
    group = joined(3 * len(faces), joint[smooth, :2].ravel(), joint[smooth, 2:].ravel())  # corners with one normal
    sector = joined(3 * len(faces), joint[flat, :2].ravel(), joint[flat, 2:].ravel())  # those in one plane besides
    weight = _weights(corners, group, sector, joint[flat])
    total = np.stack([np.bincount(group, weight * n) for n in np.repeat(normal, 3, axis=0).T], axis=1)
    length = np.linalg.norm(total, axis=1)[:, None]
    mean = (total / np.where(length > 0, length, 1.0))[group].reshape(-1, 3, 3)
    # Round a tip no mean need exist, or look out of every facet: there the facet keeps its own normal.
    good = np.einsum("fci,fi->fc", mean, normal) > BEHIND
    return np.where(good[:, :, None], mean, normal[:, None, :])


def _weights(corners: Floats, group: Ints, sector: Ints, flat: Ints) -> Floats:
    """Weight (corner,) of each corner's facet in the normal of its group.

    sector (corner,): corners of facets in one plane round a vertex; flat (pair, 4): corners beside edges in a plane.
    """
    forward, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    angle = np.arctan2(np.linalg.norm(np.cross(forward, back), axis=2), np.einsum("fci,fci->fc", forward, back)).ravel()
    # The edges of a sector are those of its corners without the edges within the plane, which two corners share.
    within = np.zeros((len(angle), 2), bool)  # whether the edge from a corner forward, and back, is within a plane
    for start, stop in (flat[:, :2].T, flat[:, 2:].T):
        ahead = stop == start - start % 3 + (start + 1) % 3
        within[start, np.where(ahead, 0, 1)] = True
        within[stop, np.where(ahead, 1, 0)] = True
    edges = np.stack([np.linalg.norm(forward, axis=2).ravel(), np.linalg.norm(back, axis=2).ravel()], axis=1)
    outer = np.where(within, np.inf, edges)
    number = np.bincount(group, np.isfinite(outer).sum(axis=1))
    usual = np.sqrt(number / np.maximum(np.bincount(group, (outer**-2.0).sum(axis=1)), TINY))[group]  # m
    share = np.log(np.maximum(edges / (LONG * np.maximum(usual, TINY))[:, None], 1.0))
    share = np.where(within, 0.0, 4.0 * share - np.log(edges))
    sector_angle = np.maximum(np.bincount(sector, angle)[sector], TINY)
    # Of a straight side (180 degrees) the sine is 0, and a small share of the angle stands in for it.
    sine = np.maximum(np.sin(sector_angle), 0.0) + 1e-4 * sector_angle
    return np.asarray(sine * np.exp(np.bincount(sector, share.sum(axis=1)))[sector] * angle / sector_angle)


def _pairs(faces: Ints) -> tuple[Ints, Ints, Ints]:
    """Facets (pair,) and (pair,) that share an edge with no third, and their corners (pair, 4) at its ends: the
    first facet's at one end and at the other, the second's at the same ends. A corner is 3 facet + place."""
    half_edge, opposite = shared_sides(faces)
    ends = [np.stack([x, x - x % 3 + (x + 1) % 3], axis=1) for x in (half_edge, opposite)]
    same = faces.ravel()[ends[0][:, 0]] == faces.ravel()[ends[1][:, 0]]  # wound against each other
    second = np.where(same[:, None], ends[1], ends[1][:, ::-1])
    joint = np.stack([ends[0][:, 0], ends[0][:, 1], second[:, 0], second[:, 1]], axis=1)
    return half_edge // 3, opposite // 3, joint


class _Curves(NamedTuple):
    middle: Floats  # (edge, xyz) m
    tangent: Floats  # (edge, xyz) unit vectors along the curve in the middle, either way
    height: Floats  # (edge,) m between the curve and the edge


def _curves(vertices: Floats, faces: Ints, normals: Floats, ends: Ints, of_facet: Ints) -> _Curves:
    """The curve along each edge (edge, 2), from the corners' normals of the facets beside it.

    Its tangents at the ends are the edge brought into the plane of the surface there, or into both planes at a crease.
    With unit tangents d0, d1, the edge's own direction e, c = e.(d0 + d1)/2 and the edge's length L, the middle is
    L (d0 - d1)/(4 (1 + c)) off the edge, exactly on a circle; an edge of three facets and more stays straight.
    """
    edge = of_facet.ravel()
    corner, following = np.arange(3 * len(faces)), np.arange(3 * len(faces)).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    forward = faces.ravel() == ends[edge, 0]
    first = np.unique(edge, return_index=True)[1]
    last = len(edge) - 1 - np.unique(edge[::-1], return_index=True)[1]
    span = vertices[ends[:, 1]] - vertices[ends[:, 0]]
    length = np.linalg.norm(span, axis=1)[:, None]
    e = span / length
    several = (np.bincount(edge, minlength=len(ends)) > 2)[:, None]
    n = normals.reshape(-1, 3)
    low, high = (np.where(forward, *order) for order in ((corner, following), (following, corner)))
    d0, d1 = (np.where(several, e, _into_planes(e, n[at[first]], n[at[last]])) for at in (low, high))
    off = 1.0 + 0.5 * np.einsum("ei,ei->e", e, d0 + d1)[:, None]
    tangent = 1.5 * e - 0.5 * (d0 + d1) / off
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    height = 0.125 * length[:, 0] * (np.linalg.norm(d0 - e, axis=1) + np.linalg.norm(d1 - e, axis=1))
    return _Curves(vertices[ends].mean(axis=1) + 0.25 * length * (d0 - d1) / off, tangent, height)


def _into_planes(e: Floats, normal: Floats, other_normal: Floats) -> Floats:
    """Unit vectors (edge, xyz) along the surface nearest to e, its normals normal and other_normal (edge, xyz)."""
    t = e - _dot(e, normal) * normal
    across = other_normal - _dot(other_normal, normal) * normal
    size = np.linalg.norm(across, axis=1)[:, None]
    across = np.where(size > SAME, across / np.where(size > SAME, size, 1.0), 0.0)
    t = t - _dot(t, across) * across
    size = np.linalg.norm(t, axis=1)[:, None]
    return np.asarray(np.where(size > STEEP, t / np.where(size > STEEP, size, 1.0), e))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ei,ei->e", a, b)[:, None])


def _cut(vertices: Floats, faces: Ints, normals: Floats, middle: Ints, tangent: Floats) -> tuple[Ints, Floats]:
    """Facets cut at the middles (facet, 3) of their sides, -1 where whole, and the normals at their corners.

    tangent (facet, 3, xyz) of the curves along the sides: in the middle the normal is the mean of those at the ends,
    brought square to it.
    """
    mean = normals + np.roll(normals, -1, axis=1)
    mean = mean - np.einsum("fci,fci->fc", mean, tangent)[:, :, None] * tangent
    size = np.linalg.norm(mean, axis=2)[:, :, None]
    mean = np.where(size > SAME, mean / np.where(size > SAME, size, 1.0), normals)
    number = 6 * np.arange(len(faces))[:, None]  # of a facet's corners, then the middles of its sides
    vertex = np.concatenate([faces, middle], axis=1).ravel()
    normal = np.concatenate([normals, mean], axis=1).reshape(-1, 3)
    pieces = cut(vertices[vertex], number + np.arange(3), np.where(middle >= 0, number + np.arange(3, 6), -1))
    return vertex[pieces], normal[pieces]
