"""Polygons cut in triangles that cover them exactly: a fan where they are convex, ears of them where they are not.

A fan from the first corner of a concave polygon lies partly outside it, and some of its triangles face backwards.
Ears: Meisters (1975), "Polygons have ears", Am. Math. Monthly 82.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints

MOST_CORNERS: Final = 500
"""Of a polygon that is not convex: looking for ears takes the square of it."""
FLAT: Final = 1e-10
"""Twice an area over the square of the size: nothing but rounding."""


class PolygonError(ValueError):
    """A polygon that has no right triangles: `number` says which one, str() is the reason."""

    def __init__(self, number: int, reason: str) -> None:
        super().__init__(reason)
        self.number = number


def triangles(vertices: Floats, counts: Ints, corners: Ints) -> Ints:
    """Triangles (triangle, 3) of polygons, in their order.

    `vertices` (vertex, xyz), `counts` (polygon,) how many corners each has, 3 or more, `corners` the vertices of all of
    them, one polygon after the other, all in range. Polygons that are not flat are cut as seen along their mean normal.
    Raises PolygonError for one that crosses itself, or is neither convex nor of few corners.
    """
    starts = np.cumsum(counts) - counts
    cuts, owners = [], []
    for count in np.unique(counts):
        rows = np.flatnonzero(counts == count)
        block = corners[starts[rows, None] + np.arange(count)]
        cut = block[:, None, :] if count == 3 else _cut(vertices, block, rows)
        cuts.append(cut.reshape(-1, 3))
        owners.append(np.repeat(rows, cut.shape[1]))
    if not cuts:
        return np.empty((0, 3), np.int64)
    return np.asarray(np.concatenate(cuts)[np.argsort(np.concatenate(owners), kind="stable")])


def _cut(vertices: Floats, block: Ints, numbers: Ints) -> Ints:
    """(polygon, count - 2, 3) of polygons (polygon, count) of one count."""
    count = block.shape[1]
    fans = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=-1)
    plane, size = _projected(vertices[block])
    chosen = np.broadcast_to(fans, (len(block), *fans.shape)).copy()
    least = FLAT * size**2
    flat = np.abs(_area(plane)) <= least  # a line, or a bow tie of two equal halves
    turn = _doubled(np.roll(plane, 1, axis=1), plane, np.roll(plane, -1, axis=1))  # (polygon, corner)
    convex = (turn > least[:, None]).all(axis=1) & (np.abs(_turning(plane) - 2 * np.pi) < 1.0)
    for n in np.flatnonzero(~convex):
        if flat[n] and np.abs(_triangle_areas(plane[n], fans)).max() <= least[n]:
            continue  # corners on a line: no area, however cut
        chosen[n] = _ears(plane[n], least[n], int(numbers[n]))
    return np.take_along_axis(block[:, None, :], chosen, axis=2)


def _projected(corners: Floats) -> tuple[Floats, Floats]:
    """Polygons (polygon, corner, xyz) in their mean planes (polygon, corner, 2), counter-clockwise; their sizes."""
    away = corners - corners[:, :1]
    size = np.asarray(np.abs(away).max(axis=(1, 2)))
    normal = np.cross(away, np.roll(away, -1, axis=1)).sum(axis=1)  # Newell's
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.where(length > FLAT * size[:, None] ** 2, normal / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    least = np.eye(3)[np.abs(normal).argmin(axis=-1)]
    first = np.cross(least, normal)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    second = np.cross(normal, first)
    return np.stack([np.einsum("pci,pi->pc", away, first), np.einsum("pci,pi->pc", away, second)], axis=-1), size


def _doubled(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the areas of triangles (..., 2), positive where counter-clockwise."""
    (ux, uy), (vx, vy) = np.moveaxis(b - a, -1, 0), np.moveaxis(c - a, -1, 0)
    return np.asarray(ux * vy - uy * vx)


def _area(plane: Floats) -> Floats:
    x, y = np.moveaxis(plane, -1, 0)
    return np.asarray((x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))


def _triangle_areas(plane: Floats, faces: Ints) -> Floats:
    return _doubled(*np.moveaxis(plane[faces], 1, 0))


def _turning(plane: Floats) -> Floats:
    """By how much (rad) the border turns on its way round: 2 pi for a convex polygon, 4 pi for a pentagram."""
    step = np.roll(plane, -1, axis=1) - plane
    heading = np.arctan2(step[..., 1], step[..., 0])
    turn = np.roll(heading, -1, axis=1) - heading
    return np.asarray(((turn + np.pi) % (2 * np.pi) - np.pi).sum(axis=1))


def _ears(plane: Floats, least: float, number: int) -> Ints:
    """(count - 2, 3) of one polygon (corner, 2), cut off ear by ear."""
    if len(plane) > MOST_CORNERS:
        raise PolygonError(number, f"a polygon of {len(plane)} corners that is not convex, more than {MOST_CORNERS}")
    ring, ears = list(range(len(plane))), []
    while len(ring) > 3:
        at = next((n for n in range(len(ring)) if _is_ear(plane, ring, n, least)), None)
        if at is None:  # what is left has no area, or crosses itself
            at = next((n for n in range(len(ring)) if abs(_corner_area(plane, ring, n)) <= least), None)
        if at is None:
            raise PolygonError(number, "a polygon that crosses itself")
        ears.append((ring[at - 1], ring[at], ring[(at + 1) % len(ring)]))
        del ring[at]
    faces = np.array([*ears, tuple(ring)])
    if _triangle_areas(plane, faces).min() < -least:
        raise PolygonError(number, "a polygon that crosses itself")
    return faces


def _corner_area(plane: Floats, ring: list[int], n: int) -> float:
    return float(_doubled(plane[ring[n - 1]], plane[ring[n]], plane[ring[(n + 1) % len(ring)]]))


def _is_ear(plane: Floats, ring: list[int], n: int, least: float) -> bool:
    """True where a corner turns the right way and no other corner lies in its triangle or on the border of it."""
    if _corner_area(plane, ring, n) <= least:
        return False
    a, b, c = (plane[ring[n - 1]], plane[ring[n]], plane[ring[(n + 1) % len(ring)]])
    corners = plane[ring]
    inside = np.min([_doubled(a, b, corners), _doubled(b, c, corners), _doubled(c, a, corners)], axis=0) >= -least
    same = (corners == a).all(axis=1) | (corners == b).all(axis=1) | (corners == c).all(axis=1)
    return not bool((inside & ~same).any())
