"""Which echoes of a snap are loud enough to be kept."""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints


class EchoLevels(NamedTuple):
    """Echoes, and how loud they are."""

    strength: Floats  # (echo,) the largest amplitude that it has anywhere on the array
    coherent: Bools  # (echo,)
    owner: Ints  # (echo,) index into `FrameContext.scattering`
    heard: Bools  # (echo,) for certain, by some hydrophone
    group: Ints  # (echo,)


def loud_of_all(levels: list[EchoLevels], negligible: float) -> list[Bools]:
    """Which echoes of each block are kept, by all of them in the order of one block."""
    columns = [np.concatenate(column) for column in zip(*levels, strict=True)]
    order = np.argsort(columns[-1], kind="stable")
    keep = np.empty(len(order), bool)
    in_order: Any = [column[order] for column in columns]
    keep[order] = loud_ones(EchoLevels(*in_order), negligible)
    return np.split(keep, np.cumsum([len(block.strength) for block in levels])[:-1])


def loud_ones(levels: EchoLevels, negligible: float) -> Bools:
    """Which (path,) are kept: all but the faintest of each target, re what is heard of it for certain."""
    strength, coherent, owner, heard, _ = levels
    keep = np.ones(len(strength), bool)
    for number, exponent in product(np.flatnonzero(np.bincount(owner)), (1, 2)):
        rows = np.flatnonzero((owner == number) & (coherent == (exponent == 1)))
        if not len(rows):
            continue
        loudest = strength[rows].max()
        size = (strength[rows] / (loudest or 1.0)) ** exponent  # amplitudes may be too small to be squared
        most = size[heard[rows]]
        least = negligible * most.sum() if exponent == 2 else np.sqrt(negligible) * most.max(initial=0.0)
        faint = np.sort(size[size <= least])  # of all others none can be left out
        kept = np.append(faint, np.nextafter(least, np.inf))[np.count_nonzero(np.cumsum(faint) <= least)]
        keep[rows[size < kept]] = False  # of equal ones all are kept, or none
    return keep
