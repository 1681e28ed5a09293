"""Tables in columns, a row for each path, facet or echo, and rows of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np

from sonarsynth.conventions import Bools, Ints


class Columns:
    """A table: a dataclass whose arrays have a row for each of something, as have the tables in it; the rest is of all.

    A column of one value for all rows (`numpy.broadcast_to`) stays that.
    """

    def select(self, keep: Bools | Ints | Sequence[int] | slice) -> Self:
        """The rows picked by a mask, by indices, or by a slice, which copies nothing."""
        if isinstance(keep, slice) and keep == slice(None):
            return self
        rows: Any = keep if isinstance(keep, slice) else np.asarray(keep)
        rows = rows if isinstance(keep, slice) or rows.dtype != bool else np.flatnonzero(rows)
        columns, values, copied = dict[str, Any](), vars(self), not isinstance(rows, slice)
        for name in self.__dataclass_fields__:  # type: ignore[attr-defined]  # of the dataclass that it is a base of
            value = values[name]
            if isinstance(value, np.ndarray):
                value = value.take(rows, axis=0) if copied and value.strides[0] else rows_of(value, rows)
            elif isinstance(value, Columns):
                value = value.select(rows)
            columns[name] = value
        return type(self)(**columns)


def picked(mask: Bools) -> Ints | slice:
    """The rows that a mask (row,) picks; where it picks all, a slice, which copies nothing."""
    rows = np.flatnonzero(mask)
    return slice(None) if len(rows) == len(mask) else rows


def rows_of(column: np.ndarray, keep: Bools | Ints | Sequence[int] | slice) -> np.ndarray:
    """The rows of a column (row, ...) that a mask, indices or a slice pick; wide ones are copied whole, to be fast. Of
    one value for all nothing is copied."""
    if isinstance(keep, slice):
        return column[keep]
    rows = np.asarray(keep)
    rows = np.flatnonzero(rows) if rows.dtype == bool else rows
    if column.strides[0] == 0 and len(rows) <= len(column):
        return column[: len(rows)]
    return column.take(rows, axis=0)
