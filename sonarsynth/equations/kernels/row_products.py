"""A product of matrices whose rows are rounded the same way, whatever their number and their neighbours.

Libraries of linear algebra round the rows at the ends of a block, and those of small matrices, otherwise than the rest,
and each processor does it in its own way: what is made a block of facets at a time would not be what is made at once.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats


def row_products(rows: Floats, matrix: Floats) -> Floats:
    """Product (row, column) of rows (row, inner) and a matrix (inner, column)."""
    return np.asarray(_products(np.ascontiguousarray(rows, float), np.ascontiguousarray(matrix, float)))


@compiled
def _products(rows: Floats, matrix: Floats) -> Floats:
    out = np.zeros((len(rows), matrix.shape[1]))
    for i in range(len(rows)):
        for k in range(len(matrix)):
            factor = rows[i, k]
            for j in range(matrix.shape[1]):
                out[i, j] += factor * matrix[k, j]
    return out
