"""Checking a mesh, and repairing what has one right answer: repeated vertices, empty facets, winding, inside out."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.description.memory import max_facets
from sonarsynth.geometry.surfaces import MeshError, Surface, joined, shared_sides, sides, weld

SMALLEST, LARGEST = 1e-3, 10e3  # m, of the whole mesh
SAME_VERTEX = 1e-7  # of the size: what single precision leaves of equal coordinates
NO_AREA = 1e-10  # twice the area over the square of the longest edge
NEARLY_CLOSED = 0.25  # area of the opening over the area of the part (0 closed, 1 flat)


def check(surface: Surface, name: str) -> None:
    """Refuse what cannot be a mesh: too many facets, NaN or infinity, indices out of range, an absurd size."""
    vertices, faces = surface
    if len(faces) > max_facets():
        raise MeshError(f"{name}: has {len(faces)} facets, more than {max_facets()}")
    if faces.size == 0:
        raise MeshError(f"{name}: holds no facets")
    outside = (faces < 0) | (faces >= len(vertices))
    if outside.any():
        facet = int(np.argmax(outside.any(axis=1)))
        index = int(faces[facet][outside[facet]][0])
        raise MeshError(f"{name}: facet {facet} has index {index}, out of range: there are {len(vertices)} vertices")
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        raise MeshError(f"{name}: vertex {int(np.argmin(finite))} is not finite")
    size = float(np.ptp(vertices[faces.ravel()], axis=0).max())
    if not SMALLEST <= size <= LARGEST:
        bound = "smaller than 1 mm" if size < SMALLEST else "larger than 10 km"
        raise MeshError(f"{name}: is {size:.3g} m across, {bound}; give the `unit` of its numbers")


def repair(surface: Surface, name: str, *, shares_vertices: bool) -> tuple[Surface, tuple[str, ...]]:
    """A mesh that can be used, and what was repaired, one line each. The surface must have passed `check`.

    Equal vertices are merged (said where the format shares vertices: an STL repeats them all), facets without area and
    repeated facets are dropped; facets wound against their neighbours are turned, and closed parts that are inside out.
    A part that is not closed is turned where its opening is small and its facets look inwards. Parts are turned one
    by one; the wall of an inner cavity, which nothing can see, counts as a part. Deterministic.
    """
    notes = []
    vertices, faces = weld(surface, SAME_VERTEX * float(np.ptp(surface[0][surface[1].ravel()], axis=0).max()))
    merged = len(np.unique(surface[1])) - len(vertices)
    if merged and shares_vertices:
        notes.append(f"{_count(merged, 'duplicate vertex', 'duplicate vertices')} merged")
    solid = ~without_area(vertices[faces])
    if not solid.any():
        raise MeshError(f"{name}: no facet has an area ({_count(len(faces))})")
    if not solid.all():
        notes.append(f"{_count(np.count_nonzero(~solid))} without area dropped")
    faces = faces[solid]
    once = np.sort(np.unique(_turned_to_smallest(faces), axis=0, return_index=True)[1])
    if len(once) < len(faces):
        notes.append(f"{_count(len(faces) - len(once))} repeated, dropped")
        faces = faces[once]
    faces, turned = orient(vertices, faces)
    return weld((vertices, faces)), (*notes, *turned)


def without_area(corners: Floats) -> Bools:
    """Facets (facet, 3, xyz) whose corners lie on a line."""
    a, b, c = np.moveaxis(corners, 1, 0)
    longest = np.max([np.linalg.norm(e, axis=1) for e in (b - a, c - b, a - c)], axis=0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) <= NO_AREA * longest**2)


def orient(vertices: Floats, faces: Ints) -> tuple[Ints, list[str]]:
    """Facets wound alike within each part, and outward; what was turned, one line each."""
    notes = []
    turn, part, twisted = _winding(faces)
    if turn.any():
        notes.append(f"{_count(np.count_nonzero(turn))} wound against their neighbours, turned")
        faces = np.where(turn[:, None], faces[:, ::-1], faces)
    if twisted:
        notes.append(f"{_count(twisted, 'part', 'parts')} one-sided: winding cannot be made consistent")
    closed, outward = _outward(vertices, faces, part)
    inside_out = np.count_nonzero(~outward & closed)
    if inside_out:
        notes.append(f"{inside_out} of {np.count_nonzero(closed)} closed parts inside out, turned")
    if np.any(~outward & ~closed):
        nearly = _count(np.count_nonzero(~outward & ~closed), "nearly closed part", "nearly closed parts")
        notes.append(f"{nearly} inside out, turned")
    if not closed.all():
        border = np.count_nonzero(np.bincount(sides(faces)[1].ravel()) == 1)
        notes.append(
            f"not closed: {np.count_nonzero(~closed)} of {len(closed)} parts open, {border} edges with one facet only; "
            "facets scatter from their front alone"
        )
    return np.where(outward[part][:, None], faces, faces[:, ::-1]), notes


def with_backs(surface: Surface) -> tuple[Surface, int]:
    """The same with a second facet behind each of an open part, turned round, and how many there are."""
    vertices, faces = surface
    part = _winding(faces)[1]
    sheet = ~_outward(vertices, faces, part)[0][part]
    backs = faces[sheet][:, ::-1]
    used, numbers = np.unique(backs, return_inverse=True)  # with corners of their own: a sheet keeps its border
    added = numbers.reshape(-1, 3) + len(vertices)
    return (np.concatenate([vertices, vertices[used]]), np.concatenate([faces, added])), int(np.count_nonzero(sheet))


def _winding(faces: Ints) -> tuple[Bools, Ints, int]:
    """Facets to turn so that neighbours run along their shared edge in opposite directions; parts; one-sided parts.

    Connected components of the double cover: node f is the facet as it is, node F + f the facet turned; neighbours in
    agreement join like with like, others like with unlike. The side of each part with more facets as they are is kept.
    """
    number = len(faces)
    forward = (faces < np.roll(faces, -1, axis=1)).ravel()
    first_side, second_side = shared_sides(faces)
    first, second = first_side // 3, second_side // 3
    differ = number * (forward[first_side] == forward[second_side])
    beside = np.concatenate([second + differ, second + number - differ])
    label = joined(2 * number, np.concatenate([first, first + number]), beside)
    asis, turned = label[:number], label[number:]
    as_they_are = np.bincount(asis, minlength=label.max() + 1)
    turn = (as_they_are[turned] > as_they_are[asis]) | ((as_they_are[turned] == as_they_are[asis]) & (turned < asis))
    part = np.unique(np.minimum(asis, turned), return_inverse=True)[1]
    return turn, part, len(np.unique(asis[asis == turned]))


def _outward(vertices: Floats, faces: Ints, part: Ints) -> tuple[Bools, Bools]:
    """(part,) whether it is closed (its directed edges cancel); whether it looks outwards, or nobody can say."""
    count = int(part.max()) + 1
    edge = sides(faces)[1].ravel()
    owner = np.repeat(part, 3)
    code, index = np.unique(owner * (int(edge.max()) + 1) + edge, return_inverse=True)
    net = np.bincount(index, np.where((faces < np.roll(faces, -1, axis=1)).ravel(), 1.0, -1.0))
    closed = np.bincount(code // (int(edge.max()) + 1), np.abs(net), count) == 0
    corners = vertices[faces]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(doubled, axis=1)
    centroid = corners.mean(axis=1)
    total = np.bincount(part, area, count)
    middle = np.stack([np.bincount(part, area * centroid[:, i], count) for i in range(3)], 1) / total[:, None]
    volume = np.bincount(part, np.einsum("fi,fi->f", centroid - middle[part], doubled), count)
    opening = np.linalg.norm(np.stack([np.bincount(part, doubled[:, i], count) for i in range(3)], 1), axis=1) / total
    sure = closed | (opening < NEARLY_CLOSED)
    return np.asarray(closed), np.asarray(~(sure & (volume < 0)))


def _turned_to_smallest(faces: Ints) -> Ints:
    """Facets with the smallest index first, the winding as it is."""
    return np.take_along_axis(faces, (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3, axis=1)


def _count(number: int | np.integer[Any], singular: str = "facet", plural: str = "facets") -> str:
    return f"{number} {singular if number == 1 else plural}"
