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
    inner, out = len(matrix), np.zeros((len(rows), matrix.shape[1]))
    fours = inner - inner % 4  # four at a time, in the order that they are written in: read and written once for all
    for i in range(len(rows)):
        row, factor = out[i], rows[i]
        for k in range(0, fours, 4):
            a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
            by_a, by_b, by_c, by_d = factor[k], factor[k + 1], factor[k + 2], factor[k + 3]
            for j in range(len(row)):
                row[j] = (((row[j] + by_a * a[j]) + by_b * b[j]) + by_c * c[j]) + by_d * d[j]
        for k in range(fours, inner):
            a, by_a = matrix[k], factor[k]
            for j in range(len(row)):
                row[j] += by_a * a[j]
    return out
