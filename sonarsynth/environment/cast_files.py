"""Tables of a cast: comment lines, one line of column names with units, rows of numbers."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description import named_files

NAMES = {
    "depth": ("depth", "dep", "depsm", "depth below surface"),
    "pressure": ("pressure", "pres", "press", "p", "sea pressure"),
    "temperature": ("temperature", "temp", "t", "water temperature", "sea water temperature", "in situ temperature"),
    "salinity": ("salinity", "sal", "s", "psal", "practical salinity", "sea water practical salinity"),
    "sound speed": ("sound speed", "sound velocity", "speed of sound", "soundspeed", "ssp", "sv", "svel", "c"),
}
"""Names of columns, in lower case, with spaces for underscores."""

UNITS: dict[str, dict[tuple[str, ...], tuple[float, float]]] = {
    "depth": {("m", "meter", "meters", "metre", "metres"): (1.0, 0.0), ("ft", "feet", "foot"): (0.3048, 0.0)},
    "pressure": {
        ("dbar", "db", "decibar", "decibars"): (1.0, 0.0),
        ("bar",): (10.0, 0.0),
        ("kpa",): (0.1, 0.0),
        ("mpa",): (100.0, 0.0),
    },
    "temperature": {
        ("c", "degc", "deg c", "degrees c", "°c", "celsius", "degree celsius", "degrees celsius", "its-90"): (1.0, 0.0),
        ("k", "kelvin"): (1.0, -273.15),
        ("f", "degf", "deg f", "°f", "fahrenheit"): (5 / 9, -160 / 9),
    },
    "salinity": {("psu", "pss", "pss-78", "practical salinity scale", "practical salinity", "1", "ppt"): (1.0, 0.0)},
    "sound speed": {
        ("m/s", "m s-1", "meters per second", "metres per second", "meter per second"): (1.0, 0.0),
        ("ft/s", "feet per second"): (0.3048, 0.0),
        ("km/s",): (1000.0, 0.0),
    },
}
"""Units in lower case, with the factor and the offset that bring them to m, dbar, degC, psu and m/s."""

PLACE = r"[%#]\s*(?:start\s+)?{}\s*[,;:=]\s*([-+.\d]+)"
LATITUDE = re.compile(PLACE.format("latitude"), re.IGNORECASE)
LONGITUDE = re.compile(PLACE.format("longitude"), re.IGNORECASE)
MISSING = ("", "nan", "na", "null", "none")
MAX_ROWS = 200_000
MAX_BYTES = 1 << 25


class CastError(ValueError):
    """A cast that cannot be used: one line that names the file, and the line and column where there is one."""


@dataclass(frozen=True)
class Column:
    """A column whose quantity and unit are known."""

    name: str  # as in the file
    index: int
    quantity: str
    factor: float
    offset: float


@dataclass(frozen=True, eq=False)
class Table:
    """A cast as text: rows of cells, with the number of the line in the file of each."""

    path: Path
    header: int  # line of the column names
    columns: tuple[str, ...]
    rows: list[list[str]]
    lines: list[int]
    decimal_comma: bool
    latitude: float | None  # degrees, where a comment gives it
    longitude: float | None  # likewise

    @property
    def names(self) -> str:
        """The columns, for messages."""
        shown = ", ".join(f"'{c}'" for c in self.columns[:12])
        return shown + (", ..." if len(self.columns) > 12 else "")

    def find(self, quantity: str) -> Column | None:
        """The column of a quantity; raises CastError where there are two, or one in an unknown unit."""
        found = [i for i, c in enumerate(self.columns) if _name(c) in NAMES[quantity]]
        if not found:
            return None
        if len(found) > 1:
            both = " and ".join(f"'{self.columns[i]}'" for i in found)
            raise CastError(f"{self.path}, line {self.header}: more than one column of {quantity}: {both}")
        name = self.columns[found[0]]
        unit = _unit(name)
        for texts, (factor, offset) in UNITS[quantity].items():
            if unit is None or unit in texts:  # no unit: ours, which comes first
                return Column(name, found[0], quantity, factor, offset)
        known = ", ".join(texts[0] for texts in UNITS[quantity])
        raise CastError(f"{self.path}, line {self.header}, column '{name}': unit '{unit}' is not one of {known}")

    def values(self, column: Column) -> Floats:
        """(row,) numbers of a column in m, dbar, degC, psu or m/s; raises CastError where a cell is not a number."""
        numbers = [self._number(row, line, column) for row, line in zip(self.rows, self.lines, strict=True)]
        return np.array(numbers) * column.factor + column.offset

    def _number(self, row: list[str], line: int, column: Column) -> float:
        cell = row[column.index].strip() if column.index < len(row) else ""
        where = f"{self.path}, line {line}, column '{column.name}'"
        if cell.lower() in MISSING:
            raise CastError(f"{where}: the value is missing")
        try:
            number = float(cell.replace(",", ".") if self.decimal_comma else cell)
        except ValueError:
            raise CastError(f"{where}: {cell[:40]!r} is not a number") from None
        if not np.isfinite(number):
            raise CastError(f"{where}: {cell[:40]!r} is not a finite number")
        return number


def read_table(path: Path) -> Table:
    """Read a cast: comments ('%' or '#'), column names, rows; commas, tabs, or semicolons (then "12,5" is a number)."""
    try:
        data = named_files.read(path, MAX_BYTES)
    except named_files.FileError as error:
        raise CastError(f"{path}: {error}") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise CastError(f"{path}: is not a text file")
    numbered = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip(" \t,;")]
    written = [(i, line) for i, line in numbered if line.lstrip()[0] not in "%#"]
    if len(written) < 2:
        raise CastError(f"{path}: has no rows of numbers")
    if len(written) > MAX_ROWS:
        raise CastError(f"{path}: has more than {MAX_ROWS} rows")
    header, names = written[0]
    separator = max(",;\t", key=names.count)
    columns = tuple(c.strip() for c in _cells(path, header, names, separator))
    if all(_is_number(c) for c in columns):
        raise CastError(f"{path}, line {header}: a line of column names must come before the numbers")
    rows = [_cells(path, i, line, separator) for i, line in written[1:]]
    lines = [i for i, _ in written[1:]]
    return Table(path, header, columns, rows, lines, separator == ";", *_place(numbered))


def _cells(path: Path, line: int, text: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([text], delimiter=separator))
    except csv.Error as error:
        raise CastError(f"{path}, line {line}: {error}") from None


def _place(numbered: list[tuple[int, str]]) -> tuple[float | None, float | None]:
    """Latitude and longitude that comments give ('% Start latitude,-36.2'), each if it is one."""
    found: list[float | None] = []
    for pattern, most in ((LATITUDE, 90.0), (LONGITUDE, 360.0)):
        given = [m[1] for _, line in numbered if (m := pattern.match(line.strip())) and _is_number(m[1])]
        found.append(next((float(text) for text in given if abs(float(text)) <= most), None))
    return found[0], found[1]


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _name(column: str) -> str:
    """'Sound_velocity (Meters per Second)' and 'sound_velocity_m/s' without unit: 'sound velocity'."""
    return _split(column)[0]


def _unit(column: str) -> str | None:
    """The unit in a column's name: in brackets, or after the last underscore or space where it is one."""
    return _split(column)[1]


def _split(column: str) -> tuple[str, str | None]:
    text = re.sub(r"\s+", " ", column.strip().lower())
    text = re.sub(r"[ _]m[ _](?:per[ _])?s$", "_m/s", text)
    if bracketed := re.fullmatch(r"(.*?)\s*[(\[](.*)[)\]]", text):
        return bracketed[1].replace("_", " ").strip(), bracketed[2].replace("_", " ").strip()
    stem, _, last = text.replace(" ", "_").rpartition("_")
    if stem and any(last in texts for units in UNITS.values() for texts in units):
        return stem.replace("_", " "), last
    return text.replace("_", " "), None
