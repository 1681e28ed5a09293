"""From nodes over the box round the hydrophones to the hydrophones."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, Ints
from sonarsynth.receiver import Elements
from sonarsynth.signals.gridded.nodes import Axis, chebyshev, interpolation

Axes = tuple[Axis, Axis, Axis]


@lru_cache(maxsize=256)
def box_nodes(elements: Elements, shape: tuple[int, int, int]) -> Floats:
    """Chebyshev nodes (node, xyz) over the box round the hydrophones, x slowest."""
    low, high = elements.position.min(axis=0), elements.position.max(axis=0)
    axes = [0.5 * (a + b) + 0.5 * (b - a) * chebyshev(n) for a, b, n in zip(low, high, shape, strict=True)]
    return np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)


@lru_cache(maxsize=16)
def columns(elements: Elements) -> tuple[Ints, Ints]:
    """One hydrophone of each column along z (column,), and the column of each (sensor,); where most stand alone, each
    is a column."""
    _, first, column = np.unique(elements.position[:, :2], axis=0, return_index=True, return_inverse=True)
    if 2 * first.size > elements.count:
        first = column = np.arange(elements.count)
    return first, column.ravel()


class Interpolation(NamedTuple):
    """From the nodes of a tile to the hydrophones: first onto their columns, then along them."""

    onto: npt.NDArray[Any] | None  # (column, node); None where the nodes are the hydrophones
    column: Ints  # (sensor,)
    weight: npt.NDArray[Any]  # (sensor, node along z)


@lru_cache(maxsize=256)
def to_sensors(elements: Elements, axes: Axes | None, dtype: str) -> Interpolation:
    """Interpolation from the nodes of a tile to the hydrophones; None: they are the hydrophones themselves."""
    first, column = columns(elements)
    every = np.arange(elements.count)
    alone = np.ones((elements.count, 1), dtype)
    if axes is None:
        return Interpolation(None, every, alone)
    low, high = elements.position.min(axis=0), elements.position.max(axis=0)
    centred = (elements.position - 0.5 * (low + high)) / np.where(high > low, 0.5 * (high - low), 1.0)
    x, y, z = (interpolation(centred[:, i], n).astype(dtype) for i, n in enumerate(axes))
    xy = (x[:, :, None] * y[:, None, :]).reshape(elements.count, -1)
    if first.size < elements.count:
        return Interpolation(xy[first], column, z)
    return Interpolation((xy[:, :, None] * z[:, None, :]).reshape(elements.count, -1), every, alone)
