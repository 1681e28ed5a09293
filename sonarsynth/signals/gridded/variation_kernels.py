"""What tiles that are tried look at of all of their paths, compiled: extremes, and how much terms over the aperture
are."""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.signals.gridded.deposit_kernels import BLOCK


@compiled(fastmath=True, borrows=True)
def moduli(terms: Floats, paths: Ints, middle: Floats, own: Floats, beside: Floats) -> bool:
    """Write the moduli of terms (path, term) of some paths, summed, to own (some,), and those of what they are beside
    the middle (term,) to beside (some,): whether this is more than its own of any path."""
    more = False
    for i in range(len(paths)):
        row, total, left = terms[paths[i]], 0.0, 0.0
        for t in range(len(row)):
            total += abs(row[t])
            left += abs(row[t] - middle[t])
        own[i], beside[i] = total, left
        more = more or left > total
    return more


@compiled(fastmath=True, forceinline=True, borrows=True)
def _widen(rows: Floats, first: int, point: Floats, low: Floats, high: Floats) -> None:
    """Widen the ends (xyz, path) of directions at a point by those of a block of paths."""
    qx, qy, qz = point[0], point[1], point[2]
    dx, dy, dz, curvature = rows[0, first:], rows[1, first:], rows[2, first:], rows[3, first:]
    lx, ly, lz = rows[4, first:], rows[5, first:], rows[6, first:]
    for j in range(BLOCK):
        k = curvature[j]
        x, y, z = dx[j] - k * qx, dy[j] - k * qy, dz[j] - k * qz
        near = 1.0 / np.sqrt(x * x + y * y + z * z)
        x, y, z = near * x + lx[j], near * y + ly[j], near * z + lz[j]
        low[0, j], high[0, j] = min(low[0, j], x), max(high[0, j], x)
        low[1, j], high[1, j] = min(low[1, j], y), max(high[1, j], y)
        low[2, j], high[2, j] = min(low[2, j], z), max(high[2, j], z)


@compiled(fastmath=True)
def extremes(
    direction: Floats, curvature: Floats, loss: Floats, late: Floats, lean: Floats, paths: Ints, points: Floats
) -> Floats:
    """The smallest and the largest (2, column) that some paths have of direction, curvature, absorption, each delay
    term; and, at points (point, xyz), of the unit vectors towards sources with lean (point, xyz, path), if any."""
    count, terms, blocks = len(paths), 5 + late.shape[1], -(-len(paths) // BLOCK)
    rows, apart, ends = np.zeros((7, blocks * BLOCK)), np.empty((2, 3, BLOCK)), np.empty((2, terms + points.size))
    low, high = ends
    low[:], high[:] = np.inf, -np.inf
    for n in range(blocks * BLOCK):
        i = paths[min(n, count - 1)]
        rows[0, n], rows[1, n], rows[2, n], rows[3, n] = direction[i, 0], direction[i, 1], direction[i, 2], curvature[i]
        for c in range(terms):
            value = rows[c, n] if c < 4 else loss[i] if c == 4 else late[i, c - 5]
            low[c], high[c] = min(low[c], value), max(high[c], value)
    for p in range(len(points)):
        for n in range(blocks * BLOCK if lean.size else 0):
            rows[4:, n] = lean[p, :, min(n, count - 1)]
        apart[0], apart[1] = np.inf, -np.inf
        for first in range(0, blocks * BLOCK, BLOCK):
            _widen(rows, first, points[p], apart[0], apart[1])
        for c in range(3):
            low[terms + 3 * p + c], high[terms + 3 * p + c] = apart[0, c].min(), apart[1, c].max()
    return ends
