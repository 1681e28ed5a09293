"""How checks read a store: plain xarray."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import xarray as xr


def other_sounds(tree: xr.DataTree) -> list[str]:
    """What is heard in a store beside its sources and targets, by the names of recipes: it may be louder than these."""
    return [str(name) for name in tree.attrs.get("other_sounds", ())]


def every(tree: xr.DataTree, name: str) -> np.ndarray:
    """Values of a variable over all frames."""
    return np.asarray(tree[name].values)


def of_frame(tree: xr.DataTree, name: str, index: int) -> np.ndarray:
    """Values of a variable in one frame."""
    return np.asarray(tree[name].variable.isel(frame=index).values)


BLOCK = 1000
"""Frames whose small variables are read at once: to read one by one takes longer than to check it."""


class SmallVariables:
    """Variables of some frames of a store, without pressure and images: each is read once, when it is asked for."""

    def __init__(self, tree: xr.DataTree, frames: np.ndarray) -> None:
        self.tree, self.frames = tree, frames
        self._row = {int(frame): row for row, frame in enumerate(frames)}
        self._read: dict[str, np.ndarray] = {}
        self._names = {f"{g.path}/{name}".strip("/") for g in tree.subtree for name in ("", *g.dataset.variables)}

    def has(self, name: str) -> bool:
        """Whether the store has a group, or a variable of one."""
        return name in self._names

    def of(self, name: str, frame: int) -> np.ndarray:
        """Values of a variable in one of the frames."""
        if name not in self._read:
            self._read[name] = np.asarray(self.tree[name].variable.isel(frame=self.frames).values)
        return np.asarray(self._read[name][self._row[int(frame)]])


def blocks(tree: xr.DataTree, frames: np.ndarray) -> Iterator[SmallVariables]:
    """Small variables of the frames, some frames after the other."""
    for start in range(0, len(frames), BLOCK):
        yield SmallVariables(tree, np.asarray(frames[start : start + BLOCK]))


def numbered(frames: Iterable[int] | np.ndarray) -> tuple[int, ...]:
    """Frame numbers as a report holds them."""
    return tuple(int(frame) for frame in frames)
