"""How much the terms of paths over the aperture are, compiled: tiles that are tried look at all of their paths."""

from __future__ import annotations

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
