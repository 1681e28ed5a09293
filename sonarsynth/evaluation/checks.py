"""How checks read a store: opened by xarray, or, of a folder of this machine, without it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from sonarsynth.store.frame_reading import FrameReader

if TYPE_CHECKING:
    import xarray as xr


Stored: TypeAlias = "xr.DataTree | FrameReader"
"""A store that is read: a build says its warnings without xarray, which takes 0.7 s to import and to open one."""


def has(tree: Stored, name: str) -> bool:
    """Whether a store has a group or a variable, by its path."""
    if isinstance(tree, FrameReader):
        return name in tree
    try:
        return tree[name] is not None
    except KeyError:
        return False


def other_sounds(tree: Stored) -> list[str]:
    """What is heard in a store beside its sources and targets, by the names of recipes: it may be louder than these."""
    return [str(name) for name in tree.attrs.get("other_sounds", ())]


def every(tree: Stored, name: str) -> np.ndarray:
    """Values of a variable over all frames."""
    return tree.array(name).every() if isinstance(tree, FrameReader) else np.asarray(tree[name].values)


def of_frames(tree: Stored, name: str, frames: np.ndarray) -> np.ndarray:
    """Values of a variable in some frames."""
    if isinstance(tree, FrameReader):
        return np.stack([tree.array(name)[int(frame)] for frame in frames])
    return np.asarray(tree[name].variable.isel(frame=frames).values)


def of_frame(tree: xr.DataTree, name: str, index: int) -> np.ndarray:
    """Values of a variable in one frame."""
    return np.asarray(tree[name].variable.isel(frame=index).values)


BLOCK = 1000
"""Frames whose small variables are read at once: to read one by one takes longer than to check it."""


class SmallVariables:
    """Variables of some frames of a store, without pressure and images: each is read once, when it is asked for."""

    def __init__(self, tree: Stored, frames: np.ndarray) -> None:
        self.tree, self.frames = tree, frames
        self._row = {int(frame): row for row, frame in enumerate(frames)}
        self._read: dict[str, np.ndarray] = {}
        self._has: dict[str, bool] = {}

    def has(self, name: str) -> bool:
        """Whether the store has a group, or a variable of one."""
        if name not in self._has:
            self._has[name] = has(self.tree, name)
        return self._has[name]

    def of(self, name: str, frame: int) -> np.ndarray:
        """Values of a variable in one of the frames."""
        if name not in self._read:
            self._read[name] = of_frames(self.tree, name, self.frames)
        return np.asarray(self._read[name][self._row[int(frame)]])


def blocks(tree: Stored, frames: np.ndarray) -> Iterator[SmallVariables]:
    """Small variables of the frames, some frames after the other."""
    for start in range(0, len(frames), BLOCK):
        yield SmallVariables(tree, np.asarray(frames[start : start + BLOCK]))


def numbered(frames: Iterable[int] | np.ndarray) -> tuple[int, ...]:
    """Frame numbers as a report holds them."""
    return tuple(int(frame) for frame in frames)
