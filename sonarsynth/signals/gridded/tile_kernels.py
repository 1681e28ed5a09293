"""What every tile that is tried looks at, compiled: amplitudes by degree, and what columns of its paths range over."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled


@compiled
def add_degrees(size: Any, shape: Any, out: Any) -> None:
    """Add moduli of size (x degree * y degree * z degree, path), of shape (x, y, z) degrees, to those of each axis in
    out (xyz, degree, path)."""
    row = 0
    for i in range(shape[0]):
        for j in range(shape[1]):
            for k in range(shape[2]):
                for p in range(out.shape[2]):
                    modulus = abs(size[row, p])
                    out[0, i, p] += modulus
                    out[1, j, p] += modulus
                    out[2, k, p] += modulus
                row += 1


@compiled(fastmath=True)
def extremes(columns: Any, paths: Any) -> Any:
    """The smallest and the largest of some paths (column,) each, from columns (column, path)."""
    low, high = np.empty(len(columns)), np.empty(len(columns))
    for n in range(len(columns)):
        column = columns[n]
        least = most = column[paths[0]]
        for p in paths:
            least, most = min(least, column[p]), max(most, column[p])
        low[n], high[n] = least, most
    return low, high


@compiled(fastmath=True)
def sums(rows: Any, paths: Any) -> Any:
    """Sums over some paths of rows (row, path), and of their squares: (row,) each."""
    total, power = np.zeros(len(rows)), np.zeros(len(rows))
    for n in range(len(rows)):
        row, first, second = rows[n], 0.0, 0.0
        for p in paths:
            first, second = first + row[p], second + row[p] * row[p]
        total[n], power[n] = first, second
    return total, power
