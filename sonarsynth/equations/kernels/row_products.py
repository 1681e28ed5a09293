"""A product of matrices whose rows are rounded the same way, whatever their number and their neighbours.

Libraries of linear algebra round the rows at the ends of a block, and those of small matrices, otherwise than the rest,
and each processor does it in its own way: what is made a block of facets at a time would not be what is made at once.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints


def row_products(rows: Floats, matrix: Floats) -> Floats:
    """Product (row, column) of rows (row, inner) and a matrix (inner, column)."""
    return np.asarray(_products(np.ascontiguousarray(rows, float), np.ascontiguousarray(matrix, float)))


@compiled(forceinline=True, borrows=True)
def _add_product(factor: Floats, matrix: Floats, row: Floats) -> None:
    """Add to a row (column,) the product of factors (inner,) and a matrix (inner, column)."""
    fours = len(matrix) - len(matrix) % 4  # in the order that they are written in: read and written once for all four
    for k in range(0, fours, 4):
        a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
        by_a, by_b, by_c, by_d = factor[k], factor[k + 1], factor[k + 2], factor[k + 3]
        for j in range(len(row)):
            row[j] = (((row[j] + by_a * a[j]) + by_b * b[j]) + by_c * c[j]) + by_d * d[j]
    for k in range(fours, len(matrix)):
        a, by_a = matrix[k], factor[k]
        for j in range(len(row)):
            row[j] += by_a * a[j]


@compiled
def _products(rows: Floats, matrix: Floats) -> Floats:
    out = np.zeros((len(rows), matrix.shape[1]))
    for i in range(len(rows)):
        _add_product(rows[i], matrix, out[i])
    return out


@compiled
def put_cubics(rows: Ints, point: Floats, middle: Floats, half: Floats, coefficients: Floats, out: Floats) -> None:
    """Write to some rows of out (row, column) cubics with coefficients (term, column), those of `aperture_terms`, of
    where their points (row, xyz) are from a middle, in units of `half` (xyz)."""
    term, degree = np.ones(20), np.empty(3)
    for i in rows:
        for a in range(3):
            degree[a] = term[1 + a] = (point[i, a] - middle[a]) / half[a]
        n, third = 4, 10
        for a in range(3):
            for b in range(a, 3):
                term[n] = degree[a] * degree[b]
                for c in range(b, 3):
                    term[third] = term[n] * degree[c]
                    third += 1
                n += 1
        out[i] = 0.0
        _add_product(term, coefficients, out[i])
