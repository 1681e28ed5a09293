"""Tracks of ships and vehicles in files: CSV with column names, and GPX."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final
from xml.etree.ElementTree import Element

import numpy as np

from sonarsynth.conventions import UNITS, Floats
from sonarsynth.description import named_files
from sonarsynth.description.file_formats.plain_xml import parsed_xml

MAX_BYTES: Final = 1 << 26
MOST_POINTS: Final = 200_000
NAMES: Final[dict[str, tuple[str, tuple[str, ...]]]] = {
    "time": ("s", ("time", "t", "timestamp", "datetime", "utc", "seconds", "time utc")),
    "x": ("m", ("x", "east", "easting")),
    "y": ("m", ("y", "north", "northing")),
    "z": ("m", ("z", "up", "height", "altitude", "elevation")),
    "depth": ("m", ("depth",)),
    "latitude": ("deg", ("latitude", "lat")),
    "longitude": ("deg", ("longitude", "lon", "long", "lng")),
    "heading": ("deg", ("heading", "hdg", "yaw")),
    "pitch": ("deg", ("pitch",)),
    "roll": ("deg", ("roll",)),
}
"""Each quantity: the unit that its numbers have where the column names none, and the names of its column."""


class TrackError(ValueError):
    """A track that cannot be used: one line that names the file, and the line and column where there is one."""


@dataclass(frozen=True, eq=False)
class TrackTable:
    """A track as its file has it: columns (point,) in s, m and rad; dates are s since 1970."""

    path: Path
    columns: dict[str, Floats]
    lines: list[int]  # (point,) from 1; of a GPX the number of the point


def read_track(path: Path) -> TrackTable:
    """The points of a track: a GPX is told by its first element, all else is CSV.

    Raises TrackError in one line that names the file.
    """
    with named_files.errors_as(TrackError, path):
        data = named_files.read(path, MAX_BYTES)
    start = data[:400].lstrip(b"\xef\xbb\xbf \t\r\n")
    table = _gpx(path, data) if start[:1] == b"<" or data[:2] in (b"\xff\xfe", b"\xfe\xff") else _csv(path, data)
    if len(table.lines) < 2:
        raise TrackError(f"{path}: a track needs two points, and there is {len(table.lines)}")
    if len(table.lines) > MOST_POINTS:
        raise TrackError(f"{path}: has more than {MOST_POINTS} points")
    time = table.columns["time"]
    if (late := np.flatnonzero(np.diff(time) <= 0)).size:
        i = int(late[0]) + 1
        raise TrackError(f"{path}, {_where(table, i)}: is not later than the point before it")
    return table


def _where(table: TrackTable, point: int) -> str:
    return f"{'point' if table.path.suffix.lower() == '.gpx' else 'line'} {table.lines[point]}"


def _csv(path: Path, data: bytes) -> TrackTable:
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise TrackError(f"{path}: is neither CSV nor GPX") from None
    lines = text.splitlines()
    written = [(i, line) for i, line in enumerate(lines, start=1) if line.strip() and line.lstrip()[0] not in "#%"]
    if len(written) > MOST_POINTS + 1:
        raise TrackError(f"{path}: has more than {MOST_POINTS} points")
    if not written:
        raise TrackError(f"{path}: is empty")
    separator = max(",;\t", key=written[0][1].count)
    rows = [(i, _cells(path, i, line, separator)) for i, line in written]
    first, names = rows.pop(0)
    wanted = _wanted(path, first, names)
    if not rows:
        raise TrackError(f"{path}: has no points after its column names")
    columns = {}
    for line, cells in rows:  # a decimal comma makes two of a number, and moves all after it
        if any(cell.strip() for cell in cells[len(names) :]):
            raise TrackError(f"{path}, line {line}: has {len(cells)} values in {len(names)} columns")
    for quantity, (column, unit) in wanted.items():
        values = np.empty(len(rows))
        for k, (line, cells) in enumerate(rows):
            cell = cells[column].strip() if column < len(cells) else ""
            values[k] = _value(quantity, cell, f"{path}, line {line}, column '{names[column].strip()[:40]}'")
        columns[quantity] = values * unit
    return TrackTable(path, columns, [line for line, _ in rows])


def _cells(path: Path, number: int, line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error as error:
        raise TrackError(f"{path}, line {number}: {error}") from None


def _wanted(path: Path, line: int, names: list[str]) -> dict[str, tuple[int, float]]:
    """Index and size of the unit of the column of each quantity that is there."""
    columns: dict[str, tuple[int, float]] = {}
    for index, name in enumerate(names):
        plain, unit = _split(name)
        for quantity, (usual, spellings) in NAMES.items():
            if plain not in spellings:
                continue
            if quantity in columns:
                both = " and ".join(f"'{names[i].strip()[:30]}'" for i in (columns[quantity][0], index))
                raise TrackError(f"{path}, line {line}: two columns of {quantity}, {both}: leave out one")
            symbol = {"deg": "rad"}.get(usual, usual)
            if unit is not None and unit not in UNITS[symbol]:
                raise TrackError(
                    f"{path}, line {line}, column '{name.strip()[:40]}': unit '{unit}' is not one of "
                    f"{', '.join(UNITS[symbol])}"
                )
            columns[quantity] = (index, UNITS[symbol][usual if unit is None else unit])
    shown = ", ".join(f"'{name.strip()[:30]}'" for name in names[:12])
    if "time" not in columns:
        raise TrackError(f"{path}, line {line}: no column of time among {shown}")
    placing = [pair for pair in (("x", "y"), ("latitude", "longitude")) if set(pair) <= set(columns)]
    if not placing:
        raise TrackError(f"{path}, line {line}: no columns of x and y, or of latitude and longitude, among {shown}")
    if len(placing) > 1:  # their origins are not in the file: which one is meant cannot be told
        x, y, latitude, longitude = (f"'{names[columns[name][0]].strip()[:30]}'" for pair in placing for name in pair)
        both = f"{x} and {y} and also {latitude} and {longitude}"
        raise TrackError(f"{path}, line {line}: is placed by {both}: leave out one pair")
    return columns


def _split(name: str) -> tuple[str, str | None]:
    """A column's name in lower case, and the unit in brackets after it."""
    match = re.fullmatch(r"\s*(.*?)\s*[(\[]\s*(.*?)\s*[)\]]\s*", name)
    plain, unit = (match[1], match[2]) if match else (name, None)
    unit = {"degrees": "deg", "metres": "m", "meters": "m", "seconds": "s", "utc": "s", "": None}.get(
        unit.lower(), unit
    ) if unit is not None else None  # fmt: skip
    return re.sub(r"[\s_]+", " ", plain.strip().lower()), unit


def _value(quantity: str, cell: str, where: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        seconds = _instant(cell) if quantity == "time" else None
        if seconds is None:
            needed = "a number or a date such as 2024-05-01T10:00:00Z" if quantity == "time" else "a number"
            raise TrackError(f"{where}: {cell[:40]!r} is not {needed}") from None
        return seconds
    if not np.isfinite(number) or abs(number) > 1e12:
        raise TrackError(f"{where}: {cell[:40]!r} is not finite, or too large")
    limit = {"latitude": 90.0, "longitude": 360.0}.get(quantity)
    if limit is not None and abs(number) > limit:
        raise TrackError(f"{where}: {number:g} is no {quantity} in degrees")
    return number


def _instant(text: str) -> float | None:
    """Seconds since 1970 of a date and time of ISO 8601, of UTC where it names no zone; None where it is none."""
    try:
        when = datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    try:
        return (when if when.tzinfo else when.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError, OSError):
        return None


def _gpx(path: Path, data: bytes) -> TrackTable:
    """The points of the first track that has any, segment after segment (Topografix, GPX 1.1)."""
    with named_files.errors_as(TrackError, path):
        root = parsed_xml(data)
    if _name(root) != "gpx":
        raise TrackError(f"{path}: is no GPX file")
    track = next((t for t in root if _name(t) == "trk" and any(_name(p) == "trkpt" for p in t.iter())), None)
    if track is None:
        raise TrackError(f"{path}: has no track; routes and way points have no times")
    points = [p for p in track.iter() if _name(p) == "trkpt"]
    if len(points) > MOST_POINTS:
        raise TrackError(f"{path}: has more than {MOST_POINTS} points")
    rows = [_point(point, f"{path}, point {i}") for i, point in enumerate(points, start=1)]
    columns = {name: np.array([row[name] for row in rows]) for name in ("time", "latitude", "longitude")}
    columns |= {name: np.deg2rad(columns[name]) for name in ("latitude", "longitude")}
    if all("z" in row for row in rows):
        columns["z"] = np.array([row["z"] for row in rows])
    return TrackTable(path, columns, list(range(1, len(rows) + 1)))


def _point(point: Element, where: str) -> dict[str, float]:
    """Time (s), latitude and longitude (deg), and height (m) where it has one."""
    texts = {_name(child): child.text or "" for child in point}
    if "time" not in texts:
        raise TrackError(f"{where}: has no time")
    values = {
        "time": _value("time", texts["time"], f"{where}, time"),
        "latitude": _value("latitude", point.get("lat", ""), f"{where}, lat"),
        "longitude": _value("longitude", point.get("lon", ""), f"{where}, lon"),
    }
    return values | ({"z": _value("z", texts["ele"], f"{where}, ele")} if "ele" in texts else {})


def _name(element: Element) -> str:
    """The name of an element without its namespace."""
    return str(element.tag).rpartition("}")[2]
