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

    from sonarsynth.pictures.figures.painting_kernel import paint

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
    mask = np.zeros((size[1], size[0]), np.uint8)
    paint((at - low) / cell + 2.0, corners, mask)
    x, y = (low[axis] + (np.arange(size[axis]) - 2.0) * cell for axis in (0, 1))
    return [np.asarray(line) for line in contour_generator(x, y, mask.astype(float)).lines(0.5)]
