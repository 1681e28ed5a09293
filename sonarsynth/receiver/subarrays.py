"""An array cut into parts, each of which is small enough to be taken for one place."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.receiver.hydrophones import Elements

STEPS = 64
"""Towards the middle of a part."""


@dataclass(frozen=True, eq=False)
class Subarray:
    """Some elements of an array, round a centre of their own."""

    sensor: Ints  # (element,) numbers in the array, ascending
    centre: Floats  # (xyz) m, sonar frame
    elements: Elements  # positions from the centre


@lru_cache(maxsize=16)
def subarrays(elements: Elements, count: int) -> tuple[Subarray, ...]:
    """Cut an array into at least `count` parts, by halves along their longer sides; no more than it has elements.

    Parts of dead elements alone are left out: nothing is heard there.
    """
    parts = [np.arange(elements.count)]
    while len(parts) < min(count, elements.count):
        parts = [half for part in parts for half in _halves(elements.position, part)]
    return tuple(subarray(elements, part) for part in parts if elements.gain[part].any())


def subarray(elements: Elements, sensor: Ints) -> Subarray:
    """The part of an array with these elements, about the middle of the ball round them."""
    chosen = elements.select(sensor)
    centre = _middle(chosen.position)
    own = replace(chosen, position=chosen.position - centre)
    return Subarray(sensor, centre, own)


def _middle(position: Floats) -> Floats:
    """Centre (xyz) of the smallest ball round points (point, xyz), to some per cent of its radius.

    Source: Badoiu and Clarkson (2003), Proc. 14th SODA, 801: steps towards the farthest point, of 1/(n + 1) of the way.
    """
    centre = 0.5 * (position.min(axis=0) + position.max(axis=0))
    for n in range(1, STEPS if len(position) > 2 else 0):
        farthest = position[np.argmax(np.linalg.norm(position - centre, axis=1))]
        centre = centre + (farthest - centre) / (n + 1)
    return np.asarray(centre)


def _halves(position: Floats, part: Ints) -> list[Ints]:
    """A part cut in two across its longest side, where it has more than one element."""
    if len(part) == 1:
        return [part]
    along = position[part, np.argmax(np.ptp(position[part], axis=0))]
    order = part[np.argsort(along, kind="stable")]
    middle = len(part) // 2
    return [np.sort(order[:middle]), np.sort(order[middle:])]
