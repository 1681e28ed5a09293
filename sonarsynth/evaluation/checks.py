"""One line of the report, and how checks read a store: plain xarray."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import xarray as xr


@dataclass(frozen=True)
class Check:
    """One line of the report. `ok` is None where a figure is reported, or the store has nothing to check.

    `frames` are those that are not as they should be, where that can be said of a frame. `warning`: a line on data that
    are as they say, but of little use; the check holds all the same.
    """

    name: str
    expected: str
    got: str
    ok: bool | None
    numbers: dict[str, float]
    frames: tuple[int, ...] = ()
    warning: str = ""


def every(tree: xr.DataTree, name: str) -> np.ndarray:
    """Values of a variable over all frames."""
    return np.asarray(tree[name].values)


def of_frame(tree: xr.DataTree, name: str, index: int) -> np.ndarray:
    """Values of a variable in one frame."""
    return np.asarray(tree[name].isel(frame=index).values)


def numbered(frames: Iterable[int] | np.ndarray) -> tuple[int, ...]:
    """Frame numbers as a report holds them."""
    return tuple(int(frame) for frame in frames)
