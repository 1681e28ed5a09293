"""Casts of Sea-Bird: CNV and ROS (text or binary) by their `# name` lines, bottle files by their fixed columns.

SBE Data Processing, user's manual, "Data file formats".
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.environment.readers.cast_columns import SEA_BIRD, Meaning, UnitError, meaning
from sonarsynth.environment.readers.cast_table import CastError, CastTable, Column, is_number, numbers_of, placed

WIDTH: Final = 11
"""Letters of a column."""
END: Final = re.compile(rb"^\*END\*[^\n]*\n", re.MULTILINE)
NAME: Final = re.compile(r"^#\s*name\s+(\d+)\s*=\s*([^:\n]+?)\s*(?::\s*(.*?))?\s*$", re.MULTILINE | re.IGNORECASE)
PLACE: Final = r"^[*#]+\s*(?:NMEA |start |)?{}(?:itude)?\s*[=:]\s*(.*?)\s*$"
LATITUDE: Final = re.compile(PLACE.format("lat"), re.MULTILINE | re.IGNORECASE)
LONGITUDE: Final = re.compile(PLACE.format("lon(?:g)?"), re.MULTILINE | re.IGNORECASE)


def is_sea_bird(data: bytes) -> bool:
    """Whether a file is one of Sea-Bird's."""
    return re.match(rb"\s*\* ?Sea-?Bird|\s*\*[^\n]*SBE", data[:400]) is not None or (
        data[:1] == b"*" and re.search(rb"^# name \d+ =", data[:100_000], re.MULTILINE | re.IGNORECASE) is not None
    )


def read_sea_bird(path: Path, data: bytes, text: str) -> CastTable:
    """A CNV, ROS or BTL, as its bytes and as text with one kind of line end. Raises CastError."""
    end = END.search(data)
    if end is None:
        return _bottles(path, text)
    head = data[: end.end()].decode("latin-1").replace("\r\n", "\n")
    names = {int(m[1]): (m[2], m[3] or "") for m in NAME.finditer(head)}
    if not names or sorted(names) != list(range(len(names))):
        raise CastError(f"{path}: its head does not name its columns ('# name 0 = ...')")
    meanings: dict[int, Meaning] = {}
    for i, (short, full) in sorted(names.items()):
        definition = _meaning(path, head, short, full)
        if definition is not None and definition.quantity not in [m.quantity for m in meanings.values()]:
            meanings[i] = definition  # of a pair of sensors the first
    shown = tuple(f"{short}: {full}" if full else short for short, full in (names[i] for i in range(len(names))))
    first = head.count("\n") + 1
    body, binary = data[end.end() :], re.search(r"file_type\s*=\s*binary", head) is not None
    if binary:
        table = _binary(path, body, len(names))
        lines = np.arange(1, len(table) + 1)
    else:
        table, lines = _text(path, body.decode("latin-1").replace("\r", ""), len(names), sorted(meanings), first)
    flag = re.search(r"bad_flag\s*=\s*(\S+)", head)
    bad = float(flag[1]) if flag and is_number(flag[1]) else -9.99e-29
    columns = {}
    for i, definition in meanings.items():
        values = np.where(np.isclose(table[:, i], bad, rtol=1e-5, atol=0.0), np.nan, table[:, i])
        columns[definition.quantity] = Column(shown[i], definition.ours(values))
    return CastTable(path, "Sea-Bird", columns, lines, shown, _line(head, "# name 0"), *_place(head))


def _meaning(path: Path, head: str, short: str, full: str) -> Meaning | None:
    """What a column holds: by its short name where that is one of ours, else by its full one."""
    recognised = any(re.fullmatch(pattern, short.lower()) for pattern, _, _ in SEA_BIRD)
    try:
        return meaning(short if recognised or not full else full)
    except UnitError as error:
        raise CastError(f"{path}, line {_line(head, f'= {short}')}, {error}") from None


def _line(head: str, text: str) -> int:
    return head[: max(head.find(text), 0)].count("\n") + 1


def _binary(path: Path, body: bytes, count: int) -> np.ndarray:
    """Rows of single-precision numbers."""
    values = np.frombuffer(body[: len(body) // (4 * count) * 4 * count], "<f4").astype(float)
    if not values.size:
        raise CastError(f"{path}: has no rows of numbers")
    return values.reshape(-1, count)


def _text(path: Path, body: str, count: int, wanted: list[int], first: int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (row, column) of the wanted columns, NaN elsewhere, and the lines of the rows."""
    cells, lines = [], []
    for number, line in enumerate(body.split("\n"), start=first):
        row = line.split()
        if len(row) != count:  # columns that touch: each is 11 letters wide
            row = [line[i : i + WIDTH].strip() for i in range(0, WIDTH * count, WIDTH)]
        if any(map(is_number, row)):
            cells.append(row)
            lines.append(number)
    table = np.full((len(cells), count), np.nan)
    for i in wanted:
        table[:, i] = numbers_of([row[i] for row in cells], path, lines, f"{i}")
    return table, np.array(lines, np.int64)


def _bottles(path: Path, text: str) -> CastTable:
    """A bottle file: names in columns of 11 letters after 'Bottle' and 'Date', a mean of each bottle ('(avg)')."""
    lines = text.split("\n")
    at = next((i for i, line in enumerate(lines) if re.match(r"\s*Bottle\s+(Bottle\s+)?Date\b", line)), None)
    if at is None:
        raise CastError(f"{path}: has no '*END*' after its head, and no line of bottles")
    start = lines[at].index("Date") + len("Date")
    row = lines[at][start:].rstrip()
    names = [row[i : i + WIDTH].strip() for i in range(0, len(row), WIDTH)]
    means = [(i, line) for i, line in enumerate(lines, start=1) if line.rstrip().endswith("(avg)")]
    cells = [line.rstrip().removesuffix("(avg)").split()[-len(names) :] for _, line in means]
    good = [i for i, row in enumerate(cells) if len(row) == len(names) and all(map(is_number, row))]
    numbers = [means[i][0] for i in good]
    columns: dict[str, Column] = {}
    for i, name in enumerate(names):
        definition = meaning(name)
        if definition is not None and definition.quantity not in columns:
            columns[definition.quantity] = Column(
                name, definition.ours(numbers_of([cells[g][i] for g in good], path, numbers, name))
            )
    return CastTable(
        path, "Sea-Bird bottles", columns, np.array(numbers, np.int64), tuple(names), at + 1, *_place(text)
    )


def _place(head: str) -> tuple[float | None, float | None]:
    texts = [m[1] if (m := pattern.search(head)) else None for pattern in (LATITUDE, LONGITUDE)]
    latitude, longitude = placed(*texts)
    if latitude is None and (m := re.search(r"\[salt water, m\], lat = ([-\d.]+)", head)):
        latitude = placed(m[1], None)[0]
    return latitude, longitude
