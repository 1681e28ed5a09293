"""Cells of the world that hold scatterers: the same scatterers in every frame, from wherever they are lit and heard.

A scatterer is a hash of its cell and of its number there alone. How many of a cell count depends on what it sends: the
first ones, so that a sonar that moves sees hardly any come and go.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import ceil, log2

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.randomness import uniforms

SIDE = 2.0
"""m: of a cell; of far larger scenes a power of two times that. Scatterers keep their places as long as this stays."""
MANY = 3000
"""Cells of a boundary, about, at most."""


class Draw(IntEnum):
    """What a random number is for: part of its key."""

    X = 0
    Y = 1
    Z = 2
    SIGN = 3
    COUNT = 4
    TEXTURE = 5


@dataclass(frozen=True, eq=False)
class Cells:
    """Boxes, or pieces of a boundary.

    key         (cell, xyz)   -     number along each axis
    low         (cell, xyz)   m     corner
    size        (xyz,)        m     sides; along z 0 on a boundary
    """

    key: Ints
    low: Floats
    size: Floats

    @property
    def middle(self) -> Floats:
        """(cell, xyz) m."""
        return np.asarray(self.low + 0.5 * self.size)

    @property
    def measure(self) -> float:
        """m2 of a piece of a boundary, m3 of a box."""
        return float(np.prod(self.size[self.size > 0.0]))


def side_for(reach: float) -> float:
    """Side (m) of the cells of a scene that is heard so far (m) from the middle between source and array."""
    wide = 2.0 * reach / (SIDE * MANY**0.5)
    return SIDE * float(2 ** max(ceil(log2(wide)), 0)) if wide > 0.0 else SIDE


def cells_about(middle: Floats, reach: float, side: float, owner: str, bottom_depth: float) -> Cells:
    """Those within `reach` (m) of a point (xy) m, in order."""
    first, last = (np.floor((middle + sign * reach) / side).astype(np.int64) for sign in (-1, 1))
    x, y = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij")
    layers = max(int(np.ceil(bottom_depth / side)), 1) if owner == "volume" else 1
    height = bottom_depth / layers if owner == "volume" else 0.0
    key = np.column_stack([np.repeat(a.ravel(), layers) for a in (x, y)] + [np.tile(np.arange(layers), x.size)])
    top = {"surface": 0.0, "bottom": -bottom_depth}.get(owner)
    low_z = -height * (key[:, 2] + 1.0) if top is None else np.full(len(key), top)
    size = np.array([side, side, height])
    off = np.hypot(*(side * (key[:, :2] + 0.5) - middle).T)
    near = off <= reach + side
    return Cells(key[near], np.column_stack([side * key[:, :2], low_z])[near], size)


def counts(seed: int, cells: Cells, expected: Floats) -> Ints:
    """How many scatterers (cell,) of each count: a whole number of this mean (cell,), the same wherever it is asked."""
    return np.floor(expected + uniforms(seed, Draw.COUNT, *cells.key.T)).astype(np.int64)


def scatterers(seed: int, cells: Cells, count: Ints) -> tuple[Floats, Ints, Floats]:
    """Places (point, xyz) m, the cell of each (point,), and a number evenly in 0 to 1 that random signs are from."""
    cell = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(cell)) - np.repeat(np.cumsum(count) - count, count)
    key = (*cells.key[cell].T, number)
    inside = np.column_stack([uniforms(seed, axis, *key) for axis in (Draw.X, Draw.Y, Draw.Z)])
    return cells.low[cell] + inside * cells.size, cell, uniforms(seed, Draw.SIGN, *key)


def texture(seed: int, position: Floats, patch: float, patchiness: float | None) -> Floats:
    """How much brighter than its mean (point,) the patch of each position (point, xyz) m is, by the gamma law."""
    if patchiness is None or not len(position):
        return np.ones(len(position))
    from scipy.special import gammaincinv

    patches, which = np.unique(np.floor(position / patch).astype(np.int64), axis=0, return_inverse=True)
    bright = gammaincinv(patchiness, uniforms(seed, Draw.TEXTURE, *patches.T)) / patchiness
    return np.asarray(bright[which.ravel()])
