"""Casts as text without column names: what stands where is known by the first lines. One table of all layouts."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.environment.readers.cast_columns import meaning
from sonarsynth.environment.readers.cast_table import CastError, CastTable, Column, is_number, placed

NUMBER: Final = r"[-+]?\d+(?:\.\d*)?"
PLACE: Final = rf"(?P<lat>{NUMBER})\s+(?P<lon>{NUMBER})\b"
SPEEDS: Final = ("depth", "sound speed")
ALL: Final = (*SPEEDS, "temperature", "salinity")
HEAD_LETTERS: Final = 16_000


@dataclass(frozen=True)
class Layout:
    """A kind of file: how it begins, and what the columns after its head hold (in our units, or as named; '' is
    skipped). Patterns are of single lines, so that no file takes long to be told from another.
    """

    make: str
    first: str
    """How the file begins; its groups `lat` and `lon` are the place."""
    columns: tuple[str, ...]
    has: tuple[str, ...] = ()
    """Patterns of lines that the head has too, in any order; may bear the place."""
    last: str = ""
    """Of the last line of the head; empty: it is the first."""
    head: int = 1
    """Lines of a head that has no `last`; 0: rows begin in the first line, where the pattern ends."""
    row: str = ""
    """How a row begins, where other lines of numbers stand among them."""
    several: bool = False
    """The last line of the head comes again before each further cast."""


VALEPORT: Final = (r"Latitude:\s*(?P<lat>\S+)", r"Pressure units:\s*dBar")
AML: Final = (r"Latitude=(?P<lat>\S+)", r"Longitude=(?P<lon>\S+)", r"SensorName=P-[^\n]*P\.X ")
LAYOUTS: Final = (
    Layout("Kongsberg ASVP", rf"\s*\(\s*SoundVelocity\s+\S+\s+\S+\s+\d+\s+{PLACE}", SPEEDS),
    Layout("Kongsberg S", r"\$(?:MVS|AAS)[0-4]2(?:,[^,]*){6},", ALL, head=0),
    Layout(
        "Kongsberg S",
        r"\$(?:MVS|AAS)(?:05|5\d)(?:,[^,]*){6},",
        ("pressure (MPa)", "", "temperature", "salinity"),
        head=0,
    ),
    Layout("Kongsberg S", r"\$(?:MVS|AAS)[0-4][01](?:,[^,]*){6},", SPEEDS, head=0),
    Layout("Kongsberg S", r"\$(?:MVS|AAS)[0-4][01](?:,[^,]*){7}\s*$", SPEEDS),
    Layout("Hypack", rf"FTP\s+NEW\s+\d+\s+{PLACE}", SPEEDS),
    Layout(
        "Caris",
        r"\[SVP_VERSION|Section ",
        SPEEDS,
        last=r"Section\s+[-\d]+\s+[:\d]+\s+(?P<lat>-?\d+:\d+:[\d.]+)\s+(?P<lon>-?\d+:\d+:[\d.]+)",
        several=True,
    ),
    Layout("SVP of ISS", rf"\s*\d+\s+SV[PT]?[TS]?\s+{PLACE}", SPEEDS),
    Layout("SVP of ISS", r"#", SPEEDS, last=r"\s+\d+/\d+ [:.\d]+ (?P<lat>[\d. ]+[NS])\s+(?P<lon>[\d. ]+[EW])\s*$"),
    Layout(
        "SVP of ISS", r"Ship Speed", SPEEDS, (r"Latitude\s+(?P<lat>\S+)", r"Longitude\s+(?P<lon>\S+)"), last=r".*Probe"
    ),
    Layout(
        "Digibar S",
        r"(?=\d+-\d+-\d+, *\d+:\d+:\d+, *1\d{3}\.\d+,)",
        ("", "", "sound speed", "depth", "temperature"),
        head=0,
    ),
    Layout("Sonardyne", r"[^\n]*\n\d+/\d+/\d{4}\s*\n\d+:\d+:\d+\s*\n", (*SPEEDS, "salinity", "temperature"), head=5),
    Layout("UNB", r"\d.*JWC", ("", *ALL), (rf"{PLACE} # lat",), last=r"# .*10 of 10"),
    Layout("ROV CTD", r"## DATE:.*LATITUDE:(?P<lat>\S+)\s+LONGITUDE:(?P<lon>\S+)", ALL, (r"(?:\d\S*\s+){3}\d\S*\s*$",)),
    Layout("ROV CTD", r"## DATE:.*LATITUDE:(?P<lat>\S+)\s+LONGITUDE:(?P<lon>\S+)", SPEEDS),
    Layout("TSK", r".{0,200},\d{8},\d{6},", ("depth", "temperature")),
    Layout(
        "Valeport",
        "Now:",
        ("depth", "temperature", "sound speed"),
        ("MiniSVP", VALEPORT[0]),
        last=r"Pressure units:\s*m\s*$",
    ),
    Layout(
        "Valeport",
        "Now:",
        ("pressure", "temperature", "sound speed"),
        ("MiniSVP|RapidSVT", *VALEPORT),
        last=VALEPORT[1],
    ),
    Layout("Valeport", "Now:", ("pressure", "sound speed"), ("RapidSV", *VALEPORT), last=VALEPORT[1]),
    Layout(
        "Valeport",
        "Now:",
        ("pressure", "temperature", "conductivity (mS/cm)"),
        ("MiniCTD", *VALEPORT),
        last=VALEPORT[1],
    ),
    Layout(
        "AML",
        r"\[cast header\]",
        ("", "", "sound speed", "pressure"),
        (r"SensorName=SV-.*SV\.X", *AML),
        last=r"\s*$",
        row=r"\d{4}-\d\d-\d\d,",
    ),
    Layout(
        "AML",
        r"\[cast header\]",
        ("", "", "conductivity (mS/cm)", "temperature", "pressure", "", "salinity", "", "sound speed"),
        (r"SensorName=SV-.*CT\.X C", *AML),
        last=r"\s*$",
        row=r"\d{4}-\d\d-\d\d,",
    ),
)


def read_fixed_columns(path: Path, text: str, profile: int) -> CastTable | None:
    """A cast in one of the layouts, the `profile`-th of a file of several; None where it is in none of them.

    Raises CastError where there are no rows, or not so many casts.
    """
    lines = text.split("\n")
    for layout in LAYOUTS:
        if (heads := _heads(layout, lines, text[:HEAD_LETTERS])) is not None:
            break
    else:
        return None
    position, starts = heads
    if profile >= len(starts):
        raise CastError(f"{path}: has no profile {profile}, only {len(starts)} (from 0)")
    if layout.several:
        position = _groups(re.match(layout.last, lines[starts[profile] - 1], re.IGNORECASE))
    wanted = [(i, definition) for i, name in enumerate(layout.columns) if (definition := meaning(name))]
    stop = starts[profile + 1] - 1 if profile + 1 < len(starts) else len(lines)
    rows, numbers = [], []
    for number, line in enumerate(lines[starts[profile] : stop], start=starts[profile] + 1):
        begun = re.match(layout.first, line, re.IGNORECASE) if number == 1 else None
        body = line[begun.end() :] if begun else line
        cells = [c.strip() for c in body.split(",")] if "," in body else body.split()
        row = [_number(cells, i) for i, _ in wanted]
        if re.match(layout.row, line) and np.count_nonzero(np.isfinite(row)) >= min(2, len(row)):
            rows.append(row)
            numbers.append(number)
    values = np.array(rows, float).reshape(-1, len(wanted))
    columns = {
        definition.quantity: Column(definition.quantity, definition.ours(values[:, k]))
        for k, (_, definition) in enumerate(wanted)
    }
    several = len(starts) > 1
    notes = (f"profile {profile} of {len(starts)}",) if several else ()
    names = tuple(definition.quantity for _, definition in wanted)
    coordinates = placed(position.get("lat"), position.get("lon"))
    return CastTable(path, layout.make, columns, np.array(numbers, np.int64), names, 0, *coordinates, notes, several)


def _heads(layout: Layout, lines: list[str], head: str) -> tuple[dict[str, str], list[int]] | None:
    """The place, and the indices of the lines after each head; None of a file of another layout."""
    begun = re.match(layout.first, head, re.IGNORECASE)
    also = [re.search("^.{0,80}?" + pattern, head, re.IGNORECASE | re.MULTILINE) for pattern in layout.has]
    if begun is None or not all(also):
        return None
    position = {name: value for match in (begun, *also) for name, value in _groups(match).items()}
    if not layout.last:
        return position, [layout.head]
    searched = len(lines) if layout.several else 500
    ends = [
        (i, match) for i, line in enumerate(lines[:searched]) if (match := re.match(layout.last, line, re.IGNORECASE))
    ]
    if not ends:
        return None
    ends = ends if layout.several else ends[:1]
    return position | _groups(ends[0][1]), [i + 1 for i, _ in ends]


def _groups(match: re.Match[str] | None) -> dict[str, str]:
    return {} if match is None else {name: value for name, value in match.groupdict().items() if value}


def _number(cells: list[str], index: int) -> float:
    return float(cells[index]) if index < len(cells) and is_number(cells[index]) else np.nan
