"""Outlines of meshes as they are seen: exact projections of every facet, joined into one shape."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, azimuth_elevation

CELLS = 512
"""An outline is found on a grid of this many cells over the larger side of the shape: it errs by less than a cell."""

FILM_CELLS = 320
"""Cells of a film: there a shape is hardly larger than so many pixels."""


def view_outline(vertices: npt.ArrayLike, faces: npt.ArrayLike, cells: int = CELLS) -> list[Floats]:
    """Outline of a mesh as seen from the origin along +x: closed lines (point, azimuth and elevation) in rad.

    vertices (vertex, xyz) in m in the sonar frame, faces (facet, 3). The shape is joined in the plane x = 1, where
    straight edges stay straight. Facets that reach behind the plane x = 0 are left out; no facet gives no lines.
    """
    points = np.asarray(vertices, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        plane = np.where(points[:, :1] > 0.0, points[:, 1:] / points[:, :1], np.nan)
    lines = union_outline(plane, faces, cells)
    angles = [np.stack(azimuth_elevation(np.insert(line, 0, 1.0, axis=1)), axis=1) for line in lines]
    return [np.asarray(line) for line in angles]


def union_outline(points: npt.ArrayLike, faces: npt.ArrayLike, cells: int = CELLS) -> list[Floats]:
    """Outline of the union of triangles in a plane: closed lines (point, 2), holes included, in the units of `points`.

    points (vertex, 2), faces (facet, 3). Facets with a NaN corner are left out. Error: one part in `cells` of the size.
    """
    from contourpy import contour_generator

    at, corners = np.asarray(points, float), np.asarray(faces)
    used = np.zeros(len(at), bool)
    used[corners] = True
    used &= np.isfinite(at).all(axis=1)
    if not used.any():
        return []
    low, high = at[used].min(axis=0), at[used].max(axis=0)
    cell = float((high - low).max()) / cells
    if cell <= 0.0:
        return []
    size = np.ceil((high - low) / cell).astype(int) + 5  # two empty cells all round: every line closes
    mask = _painted((at - low) / cell + 2.0, corners, (int(size[1]), int(size[0])))
    x, y = (low[axis] + (np.arange(size[axis]) - 2.0) * cell for axis in (0, 1))
    return [np.asarray(line) for line in contour_generator(x, y, mask).lines(0.5)]


def _painted(points: Floats, faces: npt.NDArray[np.integer], shape: tuple[int, int]) -> Floats:
    """1 in the cells (row, column) that triangles (facet, 3) of points (point, column and row) touch, 0 elsewhere.

    A triangle covers one span of each row that it touches; all spans are laid down at once, by their two ends.
    """
    x, y = (axis[faces.T] for axis in points.T)  # (corner, facet)
    there = np.isfinite(x + y).all(axis=0)
    x, y = x[:, there], y[:, there]
    first = np.rint(y.min(axis=0)).astype(int)
    rows = np.rint(y.max(axis=0)).astype(int) - first + 1
    facet = np.repeat(np.arange(len(rows)), rows)
    row = np.arange(len(facet)) + np.repeat(first - np.cumsum(rows) + rows, rows)
    left, right = np.full(len(row), np.inf), np.full(len(row), -np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        steep = y[b] - y[a]
        start = row - y[a, facet]  # where a side enters and leaves the row, in parts of its length
        with np.errstate(divide="ignore", invalid="ignore"):
            low, high = (start - 0.5) / steep[facet], (start + 0.5) / steep[facet]
        level = steep[facet] == 0.0
        enters = np.where(level, 0.0, np.minimum(low, high))
        leaves = np.where(level, 1.0, np.maximum(low, high))
        beside = (enters > 1.0) | (leaves < 0.0) | (level & (np.abs(start) > 0.5))
        along = (x[b] - x[a])[facet]
        for end in (enters, leaves):
            at = x[a, facet] + np.clip(end, 0.0, 1.0) * along
            left = np.where(beside, left, np.minimum(left, at))
            right = np.where(beside, right, np.maximum(right, at))
    width = shape[1] + 1
    cells = [row * width + np.rint(end).astype(int) for end in (left, right + 1.0)]
    starts, ends = (np.bincount(cell, minlength=shape[0] * width) for cell in cells)
    return (np.cumsum((starts - ends).reshape(shape[0], width)[:, :-1], axis=1) > 0).astype(float)
