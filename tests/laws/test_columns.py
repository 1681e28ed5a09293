"""Rows of tables in columns: what is picked is what NumPy picks of each column, however it is asked for."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from sonarsynth.columns import Columns, alike, picked, rows_of
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
    same = alike([1.0, 2.0, 3.0], 9)
    rows = Outer(value, same, Inner(place), "all").select(keep)
    for found, column in ((rows.value, value), (rows.same, same.copy()), (rows.inner.place, place)):
        np.testing.assert_array_equal(found, column[keep])
    assert rows.name == "all"
    np.testing.assert_array_equal(rows_of(place, keep), place[keep])


def test_rows_in_another_order_are_not_taken_for_all() -> None:
    place = np.arange(27.0).reshape(9, 3)
    assert rows_of(place, np.arange(9)) is place
    for rows in (np.arange(9)[::-1], np.append(np.arange(8), 3), np.repeat(0, 9)):
        np.testing.assert_array_equal(rows_of(place, rows), place[rows])


def test_one_value_for_all_is_not_copied_and_neither_are_all_rows() -> None:
    table = Outer(np.arange(9.0), np.broadcast_to(2.0, (9, 3)), Inner(np.zeros((9, 3))), "all")
    assert table.select(MASK).same.strides == (0, 0)
    assert table.select(picked(np.ones(9, bool))) is table


@pytest.mark.parametrize("value", [2.0, 3, True, np.int8(-1), [1.0, 2.0, 3.0], np.arange(6.0)[::2]])
@pytest.mark.parametrize("count", [0, 1, 9])
def test_a_column_of_one_value_is_that_which_numpy_broadcasts(value: Any, count: int) -> None:
    column, expected = alike(value, count), np.broadcast_to(value, (count, *np.shape(value)))
    np.testing.assert_array_equal(column, expected)
    assert column.dtype == expected.dtype and column.strides[0] == 0 and not column.flags.writeable


def test_a_table_with_other_columns_is_what_dataclasses_replace() -> None:
    table, place = Outer(np.arange(9.0), alike(2.0, 9), Inner(np.zeros((9, 3))), "all"), np.ones((9, 3))
    changed = {"value": np.ones(9), "inner": table.inner.but(place=place)}
    found, expected = table.but(**changed), replace(table, **changed)  # type: ignore[arg-type]
    assert type(found) is Outer and vars(found) == vars(expected) and found.inner.place is place
    with pytest.raises(TypeError, match="no column values"):
        table.but(values=np.ones(9))
