"""What tiles that are tried look at of all of their paths, compiled: extremes, and how much terms over the aperture
are."""

from __future__ import annotations

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints


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


@compiled
def extremes(columns: Floats, paths: Ints) -> tuple[Floats, Floats]:
    """The smallest and the largest (column,) of columns (path, column) of some paths."""
    low, high = columns[paths[0]].copy(), columns[paths[0]].copy()
    for i in range(1, len(paths)):
        row = columns[paths[i]]
        for c in range(len(row)):
            low[c], high[c] = np.minimum(low[c], row[c]), np.maximum(high[c], row[c])
    return low, high
