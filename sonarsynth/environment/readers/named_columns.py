"""Casts as text with a line of column names: CSV of any make, CastAway, Valeport, AML, RBR, Sippican, SAIV, and others.

The line of names is found by its columns: a depth or a pressure, and a sound speed or a temperature, with rows of
numbers after it; a line of units may stand between. What comes before is looked at for the place alone.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.environment.readers.cast_columns import Meaning, UnitError, is_unit, knows_unit, meaning, split
from sonarsynth.environment.readers.cast_table import CastError, CastTable, Column, is_number, numbers_of, placed

HEAD_LINES: Final = 400
"""Lines among which the column names are looked for."""

PLACE: Final = r"^[%#*/\s]*(?:start[ _]+|cast start |nmea |seatex )?{}(?:\s*\([^)]*\))?\s*[,;:=|]\s*(.+?)\s*$"
LATITUDE: Final = re.compile(PLACE.format("lat(?:itude)?"), re.IGNORECASE)
LONGITUDE: Final = re.compile(PLACE.format("lon(?:g|gitude)?"), re.IGNORECASE)
NUMBERED_FIELD: Final = re.compile(r"Field(\d+)\s*:\s*(.*?)\s*$")
MVP_ROWS: Final = 4
"""Rows of statistics (least, most, mean, deviation) before those of the cast in an M1 of MVP."""
MARKS: Final = re.compile(r"^\s*(?:[%#*;/!]+|columns\s*=)\s*", re.IGNORECASE)
UNIT_MARKS: Final = re.compile(r"^\s*(?:[%#*;/!]+|units\s*=)", re.IGNORECASE)

WHOLE: Final = re.compile(r"\s*[-+]?\d+\s*$")

Splitter = Callable[[str], list[str]]


def _by(separator: str) -> Splitter:
    return lambda line: next(csv.reader([line], delimiter=separator), [])


SPLITTERS: Final[dict[str, Splitter]] = {
    ",": _by(","),
    ";": _by(";"),
    "\t": _by("\t"),
    "dashes": lambda line: re.split(r"\s+-\s+", line.strip()),
    "columns": lambda line: re.split(r"\s{2,}", line.strip()),
    "words": lambda line: re.findall(r"[^\s(\[]+(?:\s?[(\[][^)\]]{0,60}[)\]])?", line),
}
"""How a line is cut into cells; rows under names in columns or words are cut at any white space."""


@dataclass(frozen=True)
class _Header:
    """Column names: their line, how lines are cut, and the first line after them that may be a row."""

    index: int  # of the line, from 0
    names: list[str]
    units: list[str]
    separator: str
    first: int

    @property
    def shifted(self) -> bool:
        """Whether the units are one column off, as Valeport's old software wrote them ('PRESSURE;C')."""
        if self.units:
            return False
        return any(";" in name and _misplaced(name) for name in self.names)

    def meanings(self, path: Path) -> dict[str, tuple[int, Meaning]]:
        """Index and meaning of the first column of each quantity; raises CastError where a unit is not known."""
        columns: dict[str, tuple[int, Meaning]] = {}
        for i, name in enumerate(self.names):
            unit = self.units[i] if i < len(self.units) else None
            try:
                definition = meaning(split(name)[0] if self.shifted else name, unit)
            except UnitError as error:
                raise CastError(f"{path}, line {self.index + 1}, {error}") from None
            if definition is None:
                continue
            # the pressure of the sea, not that of the air with it
            of_sea = definition.quantity == "pressure" and split(name)[0].startswith("sea ")
            if definition.quantity not in columns or of_sea:
                columns[definition.quantity] = (i, definition)
        return columns


def read_named_columns(path: Path, text: str) -> CastTable:
    """A cast with a line of column names; decimal commas where columns are cut at semicolons or tabs.

    Raises CastError: no rows, no names, an unknown unit, a cell that is not a number.
    """
    lines = text.split("\n")
    header = _sippican(path, lines) or _header(path, lines)
    columns = header.meanings(path)
    needed = max((i for i, _ in columns.values()), default=0) + 1
    cut = SPLITTERS.get(header.separator, str.split) if header.separator in ",;\t" else str.split
    rows, numbers, widths = [], [], list[int]()
    for number, line in enumerate(lines[header.first :], start=header.first + 1):
        if not _is_row(line):
            continue
        cells = _cells(path, number, line, cut)
        wanted = [cells[i] for i, _ in columns.values() if i < len(cells)]
        complete = len(cells) >= needed or all(map(_numeric, wanted))  # a shorter line of words is no row
        if not columns or (complete and any(map(_numeric, wanted))) or not any(cells[1:]):
            rows.append([*cells, *[""] * (needed - len(cells))])
            numbers.append(number)
            widths.append(len(cells))
    _check_widths(path, header, rows, widths)
    comma = header.separator in ";\t" and any("," in row[i] for row in rows for i, _ in columns.values())
    make = _make(lines[: header.first])
    rows, numbers = (rows[MVP_ROWS:], numbers[MVP_ROWS:]) if make == "MVP" else (rows, numbers)
    own: dict[str, Column] = {}
    for quantity, (i, definition) in columns.items():
        cells = [row[i].strip().replace(",", ".") if comma else row[i].strip() for row in rows]
        name = header.names[i].strip()
        own[quantity] = Column(name, definition.ours(numbers_of(cells, path, numbers, name)), definition.stated)
    return CastTable(
        path,
        make,
        own,
        np.array(numbers, np.int64),
        tuple(name.strip() for name in header.names),
        header.index + 1,
        *_place(lines),
        notes=_repeated(header, columns),
    )


def _check_widths(path: Path, header: _Header, rows: list[list[str]], widths: list[int]) -> None:
    """Refuses rows of numbers that are not those of the names: fewer, where a name of two words ('Sound Speed') may be
    two, or twice as many whole ones between commas, where a comma in each is the decimal one."""
    names, line = len(header.names), f"{path}, line {header.index + 1}"
    few = [width for width in widths if width < names]
    if header.separator in ("words", "columns", "dashes") and 2 * len(few) > len(widths):
        raise CastError(f"{line}: {names} column names, but rows of {few[0]} numbers")
    halves = sum(width == 2 * names and all(map(WHOLE.match, row)) for row, width in zip(rows, widths, strict=True))
    if header.separator == "," and 2 * halves > len(widths):
        raise CastError(f"{line}: {names} column names, but rows of {2 * names} numbers: are these decimal commas?")


def _header(path: Path, lines: list[str]) -> _Header:
    """The line that names the columns. Raises CastError where there is none, or nothing after it."""
    for index, line in enumerate(lines[:HEAD_LINES]):
        if (header := _as_header(lines, index, line)) is not None:
            return header
    written = [(i, line) for i, line in enumerate(lines) if _is_row(line)]
    if len(written) < 2:
        raise CastError(f"{path}: has no rows of numbers")
    index, line = written[0]
    separator = max(",;\t", key=line.count)
    names = _cells(path, index + 1, line, SPLITTERS[separator])
    if all(is_number(c) for c in names):
        raise CastError(f"{path}, line {index + 1}: a line of column names must come before the numbers")
    return _Header(index, names, [], separator, index + 1)


def _as_header(lines: list[str], index: int, line: str) -> _Header | None:
    """A line as column names, if numbers follow, and as many quantities of a cast as a profile needs are among them."""
    lower = line.lower()
    if not any(word in lower for word in ("dep", "p", "t")) or len(line) > 10_000:
        return None
    body = MARKS.sub("", line)
    best: tuple[int, _Header] | None = None
    for separator, cut in SPLITTERS.items():
        if separator in ",;\t" and separator not in body:
            continue
        try:
            names = cut(body)
        except csv.Error:
            continue
        quantities = {_quantity(name) for name in names} - {None}
        if not quantities & {"depth", "pressure"} or not quantities & {"sound speed", "temperature"}:
            continue
        units, first = _units(lines, index, len(names), cut)
        if _rows_follow(lines[first : first + 3], separator) and (best is None or len(quantities) > best[0]):
            best = len(quantities), _Header(index, names, units, separator, first)
    return None if best is None else best[1]


def _quantity(name: str) -> str | None:
    try:
        definition = meaning(name)
    except UnitError:
        return _nominal(name)
    return None if definition is None else definition.quantity


def _nominal(name: str) -> str | None:
    """The quantity of a column whose unit is not known, or another's."""
    definition = meaning(split(name)[0])
    return None if definition is None else definition.quantity


def _units(lines: list[str], index: int, count: int, cut: Splitter) -> tuple[list[str], int]:
    """Units in the line after the names, if that is what it holds, and the index of the first line of rows."""
    after = index + 1
    if after >= len(lines) or not (text := UNIT_MARKS.sub("", lines[after])).strip():
        return [], after
    try:
        cells = [cell.strip() for cell in cut(text)]
    except csv.Error:
        return [], after
    if any("[" in cell for cell in cells):
        cells = re.findall(r"\[[^\]]*\]", text)
        cells = [""] * (count - len(cells)) + cells  # the last columns have one each
    if not any(is_unit(cell) for cell in cells if cell) or any(_numeric(cell) for cell in cells):
        return [], after
    first = after + 1
    while first < len(lines) and re.match(r"\s*([\[.]|$)", lines[first]):  # '[MeasurementData]', '.profile 0'
        first += 1
    return cells if len(cells) <= count else [], first


def _rows_follow(lines: list[str], separator: str) -> bool:
    """Whether one of a few lines has two numbers among its cells."""
    for line in lines:
        cells = line.split(separator) if separator in ",;\t" else line.split()
        if sum(is_number(cell.strip().replace(",", ".")) for cell in cells) >= 2:
            return True
    return not any(line.strip() for line in lines)


def _misplaced(name: str) -> bool:
    """Whether a column bears a unit of another quantity."""
    unit, quantity = split(name)[1], _nominal(name)
    return quantity is not None and unit is not None and is_unit(unit) and not knows_unit(quantity, unit)


def _sippican(path: Path, lines: list[str]) -> _Header | None:
    """Column names of an EDF of Sippican, one a line: 'Field3 : Depth (m)'."""
    fields = [(i, m[2]) for i, line in enumerate(lines[:HEAD_LINES]) if (m := NUMBERED_FIELD.match(line.strip()))]
    if not fields:
        return None
    last = fields[-1][0]
    rows = [len(line.split()) for line in lines[last + 2 : last + 5]]
    if rows and max(rows) < len(fields):
        raise CastError(f"{path}, line {last + 3}: a row of {max(rows)} columns, where the head names {len(fields)}")
    return _Header(fields[0][0], [name for _, name in fields], [], "\t", last + 2)


def _is_row(line: str) -> bool:
    """Whether a line may hold names or numbers: not empty, no comment, no title in brackets."""
    text = line.strip()
    return bool(text.strip(" \t,;")) and text[0] not in "%#*/["


def _numeric(cell: str) -> bool:
    return is_number(cell.strip().replace(",", "."))


def _cells(path: Path, number: int, line: str, cut: Splitter) -> list[str]:
    try:
        return cut(line)
    except csv.Error as error:
        raise CastError(f"{path}, line {number}: {error}") from None


def _place(lines: list[str]) -> tuple[float | None, float | None]:
    """Latitude and longitude that the head of the file gives ('% Start latitude,-36.2'), each if it is one."""
    coordinates: list[str | None] = []
    for pattern in (LATITUDE, LONGITUDE):
        candidates = [m[1].strip("\t ,;") for line in lines[:HEAD_LINES] if (m := pattern.match(line))]
        coordinates.append(next((text for text in candidates if re.search(r"\d", text)), None))
    return placed(*coordinates)


def _repeated(header: _Header, columns: dict[str, tuple[int, Meaning]]) -> tuple[str, ...]:
    """A note where a quantity has several columns: the first is taken."""
    notes = []
    if header.shifted:
        notes.append("the units stand one column off: read as m/s, dbar and degC")
    for quantity, (first, _) in columns.items():
        others = [n.strip() for i, n in enumerate(header.names) if i != first and _quantity(n) == quantity]
        if others:
            more = ", ".join(f"'{name}'" for name in others)
            notes.append(f"{quantity} is column '{header.names[first].strip()}', the first of several (not {more})")
    return tuple(notes)


MAKES: Final = {
    "castaway": "CastAway", "% device,cc": "CastAway", "mk21": "Sippican EDF", "turo": "Turo", "valeport": "Valeport",
    "ndecimate": "MVP", "midas": "Valeport", "swift": "Valeport", "seacast": "AML", "aml_": "AML",
    "sea & sun": "Sea and Sun", "idronaut": "Idronaut", "uctd": "Oceanscience", "ohsi": "Digibar",
}  # fmt: skip


def _make(head: list[str]) -> str:
    text = "\n".join(head).lower()
    return next((make for mark, make in MAKES.items() if mark in text), "table")
