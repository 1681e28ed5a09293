"""The layout of a store, from a plan alone: every array with its shape, chunks and type. No frame is rendered for it.

A frame is one chunk, and a shard of frames is one file of each array, in the array's own folder (image/energy/c.3.0.0).
Variables so small that a chunk would be mostly overhead (positions, counts) put a whole shard of frames into one chunk,
and lists of points, which are mostly room for more, some frames; the rule "one task, one file" is the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.pipeline import Values, Variable, coordinates, variables

if TYPE_CHECKING:
    from sonarsynth.planning import Plan

SMALL_BYTES: Final = 4096
"""A frame of an array under this size gets no chunk of its own."""

POINTS_BYTES: Final = 2**18
"""Of a chunk of points at most, decoded: readers take a millisecond a chunk, whatever is in it."""

_FIXED: Final = {"xyz": 3, "xyz_other": 3, "wxyz": 4, "corner": 8, "loudest": 3}
"""Sizes of axes that no scene changes."""


@dataclass(frozen=True, eq=False)
class ArrayLayout:
    """One array whose first axis is `frame`."""

    variable: Variable
    shape: tuple[int, ...]
    shard: int  # frames in a file
    chunk: int  # frames in a chunk

    @cached_property
    def key(self) -> tuple[str, str]:
        """(group, name)."""
        return self.variable.group, self.variable.name

    @cached_property
    def path(self) -> str:
        """Path of the array in the store, such as signals/pressure."""
        return f"{self.variable.group}/{self.variable.name}".strip("/")

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Type of the numbers as stored."""
        return np.dtype(self.variable.dtype)

    @cached_property
    def inner(self) -> tuple[int, ...]:
        """Shape of a frame."""
        return self.shape[1:]

    @property
    def empty(self) -> bool:
        """True where an axis has no entries (no target, no snap): there is nothing to write."""
        return 0 in self.shape

    def file(self, shard: int) -> str:
        """Path in the store of the file of a shard."""
        return f"{self.path}/" + ".".join(["c", str(shard), *["0"] * (len(self.shape) - 1)])

    def is_fill(self, block: np.ndarray) -> bool:
        """True where every number is the fill value."""
        fill = np.asarray(self.variable.fill, self.dtype)
        first = block.flat[0] if block.size else fill
        if first != fill and not (np.isnan(first) and np.isnan(fill)):
            return False  # which spares reading the rest
        return bool(np.all(np.isnan(block) if np.isnan(fill) else block == fill))

    def cast(self, value: np.ndarray) -> np.ndarray:
        """A frame's value in the array's own type (the same array where it has that); raises ValueError where shape or
        type do not fit."""
        value = np.asarray(value)
        if value.shape != self.inner and not (self.variable.listed and value.ndim == 1 and value.shape < self.inner):
            raise ValueError(f"{self.path} has shape {value.shape}, but the store is laid out for {self.inner}")
        if value.dtype == self.dtype:
            return value
        if not np.can_cast(value.dtype, self.dtype, "same_kind"):
            raise ValueError(f"{self.path} is {value.dtype}, but the store is laid out for {self.dtype}")
        cast = value.astype(self.dtype)
        if self.dtype.kind in "iu" and not np.array_equal(cast, value):
            raise ValueError(f"{self.path} does not fit in {self.dtype}")
        return cast


@dataclass(frozen=True, eq=False)
class Layout:
    """All arrays of a store that are written frame by frame."""

    arrays: tuple[ArrayLayout, ...]
    frames: int
    shard_frames: int
    static: int  # arrays that no frame changes

    @property
    def shards(self) -> int:
        """Number of shards; the last may be short."""
        return -(-self.frames // self.shard_frames)

    def region(self, shard: int) -> range:
        """Frames of a shard. Raises IndexError outside the store."""
        if not 0 <= shard < self.shards:
            raise IndexError(f"shard {shard} is outside 0..{self.shards - 1}")
        return range(shard * self.shard_frames, min((shard + 1) * self.shard_frames, self.frames))

    def files(self, shards: int | None = None) -> int:
        """Files and folders of a store with so many shards (left out: all) at most: each array has a file of each."""
        shards = self.shards if shards is None else shards
        arrays, groups = len(self.arrays), len({a.variable.group for a in self.arrays})
        return 8 + 2 * groups + 5 * self.static + 2 * arrays + shards * (arrays + 1)

    @cached_property
    def keys(self) -> frozenset[tuple[str, str]]:
        """(group, name) of every array."""
        return frozenset(a.key for a in self.arrays)

    def check(self, values: Values) -> Values:
        """A frame's values in the types of the store. Raises ValueError for a name, shape or type that does not fit."""
        odd = values.keys() ^ self.keys
        if odd:
            names = ", ".join(sorted(f"{group}/{name}".strip("/") for group, name in odd))
            raise ValueError(f"a frame's values and the layout differ in {names}")
        return {a.key: a.cast(values[a.key]) for a in self.arrays}

    def chunks(self, array: ArrayLayout, shard: int, frames: Mapping[int, Values]) -> list[np.ndarray]:
        """The chunks (frame, ...) of a shard of an array: the frames given, as `check` returns them, the fill value
        elsewhere."""
        fill = np.broadcast_to(np.asarray(array.variable.fill, array.dtype), array.inner)
        rows = [frames[frame][array.key] if frame in frames else fill for frame in self.region(shard)]
        if array.chunk == 1 and not array.variable.listed:
            return [row[None] for row in rows]
        blocks = (rows[first : first + array.chunk] for first in range(0, len(rows), array.chunk))
        return [array.variable.stacked(block, array.inner) for block in blocks]


@lru_cache(maxsize=8)
def layout_of(plan: Plan) -> Layout:
    """The layout of a plan's store."""
    static = coordinates(plan)
    frames, shard = plan.sizes["frame"], plan.shard_frames
    arrays = []
    for variable in variables(plan):
        if variable.dims[:1] != ("frame",):
            raise ValueError(f"{variable.group}/{variable.name} must have frame as its first axis")
        inner = tuple(_size(plan, static, variable.group, dim) for dim in variable.dims[1:])
        arrays.append(ArrayLayout(variable, (frames, *inner), shard, _chunk_frames(variable, inner, shard)))
    return Layout(tuple(arrays), frames, shard, len(static))


def _chunk_frames(variable: Variable, inner: tuple[int, ...], shard: int) -> int:
    """Frames in a chunk of a variable whose frames have the shape `inner`: a number that divides those of a shard."""
    size = np.dtype(variable.dtype).itemsize * int(np.prod(inner))
    if size < SMALL_BYTES:
        return shard
    most = min(POINTS_BYTES // size, shard) if "point" in variable.dims else 1
    return max((count for count in range(1, most + 1) if shard % count == 0), default=1)


def _size(plan: Plan, static: Mapping[tuple[str, str], Any], group: str, dim: str) -> int:
    for (owner, _), (dims, values, _) in static.items():
        if owner == group and dim in dims:
            return int(values.shape[dims.index(dim)])
    size = plan.sizes.get(dim, _FIXED.get(dim))
    if size is None:
        raise ValueError(f"the plan has no size for the axis '{dim}' of {group}")
    return size
