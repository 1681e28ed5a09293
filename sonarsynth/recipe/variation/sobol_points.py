"""Points of Sobol sequences: the repeats of a grid point spread more evenly than by chance."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.randomness import share

BITS = 30
BLOCK = 1024
"""Points that are made at once."""
TOGETHER = 64
"""Dimensions that are."""
OF_VARIATIONS = 64
"""Dimensions, the first, that are left to single variations."""


def sobol_shares(seed: int, point: str, names: list[str], first: int, repeat: int) -> Floats:
    """Numbers (name,), evenly in 0 to 1 (not 1), of a repeat of a grid point, in dimensions from `first` on.

    Each dimension is shifted at random for each grid point, by its name (digital shift): any 2^k repeats that follow
    one another from a multiple of 2^k have one in each interval of 2^-k. Source: Sobol (1967), directions of Joe and
    Kuo (2008).
    """
    block, row = divmod(repeat, BLOCK)
    shares = np.empty(len(names))
    for n, name in enumerate(names):
        dimension = first + n
        points = _points(dimension // TOGETHER, block)
        shift = int(share(seed, "sobol", point, name) * (1 << BITS))
        shares[n] = (int(points[row, dimension % TOGETHER]) ^ shift) / (1 << BITS)
    return shares


@lru_cache(maxsize=64)
def _points(dimensions: int, block: int) -> Ints:
    """Points (point, dimension) of a block before they are shifted, in units of 2^-BITS.

    dimensions: which TOGETHER of them, by number.
    """
    from scipy.stats.qmc import Sobol

    sequence = Sobol((dimensions + 1) * TOGETHER, scramble=False, bits=BITS)
    if block:
        sequence.fast_forward(block * BLOCK)
    return np.asarray(sequence.random(BLOCK)[:, -TOGETHER:] * (1 << BITS)).astype(np.int64)
