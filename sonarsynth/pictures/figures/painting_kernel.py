"""Triangles painted on a grid, compiled."""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

WITHIN = 0.5
"""Cells beside a triangle that are painted too: what is thinner than a cell is there."""


@nb.njit(cache=True, nogil=True)
def paint(points: Any, faces: Any, mask: Any) -> None:
    """Set cells of mask (row, column) to 1 whose middle is in a triangle of faces (facet, 3) between points (point,
    column and row), or within `WITHIN` cells of its sides and in its box. Triangles with a NaN corner are left out."""
    rows, columns = mask.shape
    normal, offset = np.empty((3, 2)), np.empty(3)
    for n in range(len(faces)):
        a, b, c = points[faces[n, 0]], points[faces[n, 1]], points[faces[n, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if not np.isfinite(area):
            continue
        turn = 1.0 if area >= 0.0 else -1.0
        for k in range(3):
            start, end = points[faces[n, k]], points[faces[n, (k + 1) % 3]]
            across, along = end[0] - start[0], end[1] - start[1]
            length = np.sqrt(across**2 + along**2)
            normal[k, 0] = -turn * along / length if length > 0.0 else 0.0
            normal[k, 1] = turn * across / length if length > 0.0 else 0.0
            offset[k] = WITHIN - normal[k, 0] * start[0] - normal[k, 1] * start[1]
        left, right = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        low, high = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        for i in range(max(int(np.round(low)), 0), min(int(np.round(high)) + 1, rows)):
            for j in range(max(int(np.round(left)), 0), min(int(np.round(right)) + 1, columns)):
                inside = True
                for k in range(3):
                    if normal[k, 0] * j + normal[k, 1] * i + offset[k] < 0.0:
                        inside = False
                if inside:
                    mask[i, j] = 1
