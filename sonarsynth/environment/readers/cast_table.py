"""A cast as its file has it: columns of numbers in units of ours, before anything is left out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints

MAX_ROWS: Final = 500_000
"""Of a cast, or of one profile of a file."""
MISSING_MARKS: Final = ("", "nan", "na", "n/a", "null", "none", "-", "--")
FLAGS: Final = (-9.99e-29, -99.0, -99.99, -99.999, -999.0, -999.9, -999.99, -9990.0, -9999.0, -99999.0, 9999.0, 99999.0)
"""Numbers that stand for a missing value: of Sea-Bird, and those that people write."""


class CastError(ValueError):
    """A cast that cannot be used: one line that names the file, and the line and column where there is one."""


@dataclass(frozen=True, eq=False)
class Column:
    """A column whose quantity is known."""

    name: str  # as in the file
    values: Floats  # (row,) m, dbar, degC (scale of 1990), psu, m/s or mS/cm; NaN where it is missing
    unit_stated: bool = True  # rather than taken for ours


@dataclass(frozen=True, eq=False)
class CastTable:
    """A cast in rows: a column for each quantity, and where the rows stand in the file.

    Quantities are `depth` (m), `pressure` (dbar), `temperature` (degC, scale of 1990), `salinity` (psu),
    `conductivity` (mS/cm) and `sound speed` (m/s).
    """

    path: Path
    layout: str  # whose file it is, for notes
    columns: dict[str, Column]
    lines: Ints  # (row,) from 1; rows of a binary file count from 1 too
    names: tuple[str, ...]  # of all columns of the file, for messages
    header: int = 0  # line of the column names; 0: they have none
    latitude: float | None = None  # degrees, where the file gives it
    longitude: float | None = None  # likewise
    notes: tuple[str, ...] = field(default=())
    several: bool = False  # whether the file holds more casts than this one

    def __post_init__(self) -> None:
        if not len(self.lines):
            raise CastError(f"{self.path}: has no rows of numbers")

    def where(self, row: int | None = None) -> str:
        """File and line, for messages: of a row, or of the column names."""
        line = self.header if row is None else int(self.lines[row])
        return f"{self.path}, line {line}" if line else str(self.path)

    @property
    def shown_names(self) -> str:
        """The columns, for messages."""
        shown = ", ".join(f"'{c}'" for c in self.names[:12])
        return shown + (", ..." if len(self.names) > 12 else "")


def without_flags(values: Floats) -> Floats:
    """Values with NaN for the numbers that mark a missing one, and for what is no number of a measurement."""
    with np.errstate(invalid="ignore"):
        bad = np.isin(values, FLAGS) | (np.abs(values) > 1e30)
    return np.where(bad, np.nan, values)


def is_number(cell: str) -> bool:
    """Whether a text is a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def degrees(text: str) -> float | None:
    """Degrees of a latitude or a longitude as people and instruments write it; None where it is neither.

    '-36.2', '36.2 S', '02 26.71 S', '40 29 13.2N', '43:51:34.46', '21;28;17.9 N', \"36° 15' 29.155\" N\".
    """
    import re

    words = re.sub(r"[°'\":;]|deg(?:rees?)?", " ", text)
    letters = re.findall(r"([NSEWnsew])(?:orth|outh|ast|est)?\b", words)
    numbers = [float(n) for n in re.findall(r"[-+]?\d+(?:\.\d*)?", text.strip())]
    if not 1 <= len(numbers) <= 3 or any(n < 0 or n >= 60 for n in numbers[1:]):
        return None
    size = abs(numbers[0]) + sum(n / 60.0**i for i, n in enumerate(numbers[1:], start=1))
    negative = text.strip().startswith("-") or (bool(letters) and letters[-1] in "SWsw")
    return -size if negative else size


def placed(latitude: str | None, longitude: str | None) -> tuple[float | None, float | None]:
    """Degrees of a place given as texts, None for each that is no latitude or no longitude (999: none given)."""
    values = [None if text is None else degrees(text) for text in (latitude, longitude)]
    return tuple(
        None if value is None or abs(value) > limit else value
        for value, limit in zip(values, (90.0, 360.0), strict=True)
    )  # type: ignore[return-value]


def numbers_of(cells: Sequence[str], path: Path, lines: Sequence[int], name: str) -> Floats:
    """(row,) numbers of the cells of a column, NaN for missing ones; raises CastError at one that is not a number."""
    try:
        return without_flags(np.array([float(c) if c else np.nan for c in cells], float))
    except ValueError:
        pass
    values = np.empty(len(cells))
    for i, cell in enumerate(cells):
        try:
            values[i] = np.nan if cell.strip().lower() in MISSING_MARKS else float(cell)
        except ValueError:
            location = f"{path}, line {lines[i]}, column '{name}'"
            raise CastError(f"{location}: {cell.strip()[:40]!r} is not a number") from None
    return without_flags(values)
