"""Rows of tables in columns: what is picked is what NumPy picks of each column, however it is asked for."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from sonarsynth.columns import Columns, picked
from sonarsynth.conventions import Floats


@dataclass(frozen=True, eq=False)
class Inner(Columns):
    """A table in another."""

    place: Floats  # (row, xyz)


@dataclass(frozen=True, eq=False)
class Outer(Columns):
    """A table with a column that differs, one of one value for all, a table, and what is of all rows."""

    value: Floats  # (row,)
    same: Floats  # (row, xyz)
    inner: Inner
    name: str


MASK = np.arange(9) % 4 == 1


@pytest.mark.parametrize(
    "keep", [MASK, np.flatnonzero(MASK), [1, 5, 5], np.arange(24) % 9, slice(2, 7), slice(None), np.zeros(9, bool)]
)
def test_rows_are_those_that_numpy_picks(keep: Any) -> None:
    value, place = np.arange(9.0), np.arange(27.0).reshape(9, 3)
    same = np.broadcast_to([1.0, 2.0, 3.0], (9, 3))
    rows = Outer(value, same, Inner(place), "all").select(keep)
    for found, column in ((rows.value, value), (rows.same, same.copy()), (rows.inner.place, place)):
        np.testing.assert_array_equal(found, column[keep])
    assert rows.name == "all"


def test_one_value_for_all_is_not_copied_and_neither_are_all_rows() -> None:
    table = Outer(np.arange(9.0), np.broadcast_to(2.0, (9, 3)), Inner(np.zeros((9, 3))), "all")
    assert table.select(MASK).same.strides == (0, 0)
    assert table.select(picked(np.ones(9, bool))) is table
