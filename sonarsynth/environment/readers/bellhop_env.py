"""Environmental files of Bellhop (`.env`): the profile of the water, and what its bottom is made of, as a note.

Porter (2011), "The BELLHOP manual and user's guide", and the Acoustics Toolbox' page on environmental files. They are
read by Fortran's rules: words apart by white space or commas, `/` leaves the rest of a record as it was before.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sonarsynth.description import named_files
from sonarsynth.description.file_formats.fortran_rows import fortran_rows
from sonarsynth.environment.readers.cast_table import MAX_ROWS, CastError, CastTable, Column, is_number

WORD: Final = re.compile(r"('(?:[^']|'')*'|\"[^\"]*\"|/|[^\s,/'\"]+)")
INTERPOLATION: Final = {"N": "of 1/c2", "S": "by a spline", "P": "by a monotone cubic"}
"""How Bellhop goes from node to node, where that is not in straight lines."""
REFUSED: Final = {
    "H": "a sound speed that varies in three dimensions (option 'H' and its .ssp)",
    "A": "an analytic sound speed (option 'A')",
}
NEPER: Final = 20.0 / np.log(10.0)  # dB
WATER: Final = (1500.0, 0.0, 1.0, 0.0, 0.0)
"""What a record leaves out before any other has said it: speeds (m/s), density (g/cm3), attenuations."""
MAX_SPEEDS: Final = 1 << 26
"""Bytes of a .ssp."""
SAME: Final = 1.2e-5
"""m: a node this near to the bottom is the last (Bellhop's own tolerance)."""


def is_bellhop(text: str) -> bool:
    """Whether a text is an environmental file: a title, two numbers, options in quotes."""
    lines = [line.strip() for line in text[:4096].split("\n")[:4]]
    quoted = len(lines) == 4 and lines[0][:1] in ("'", '"') and lines[3][:1] in ("'", '"')
    return quoted and all(re.match(r"[-+.\d]", line) is not None for line in lines[1:3])


def is_range_dependent(text: str) -> bool:
    """Whether a text is a `.ssp`: how many profiles, the range of each, and then rows of as many speeds."""
    lines = text[:16_384].split("\n")[:3]
    if len(lines) < 3 or not re.fullmatch(r"\s*\d{1,6}\s*", lines[0]):
        return False
    rows = [line.split() for line in lines[1:]]
    return int(lines[0]) > 1 and all(len(row) == int(lines[0]) and all(map(is_number, row)) for row in rows)


@dataclass
class _Records:
    """The records of a file, read in order."""

    path: Path
    lines: list[str]
    line: int = 0  # of the next record, from 0

    def read(self, defaults: tuple[str | float, ...], needed: int = 1) -> list[str | float]:
        """A value for each default, which stays where a `/` comes first; numbers where the defaults are numbers.
        The first `needed` must be there. Raises CastError."""
        values = list(defaults)
        count, ended = 0, False
        while count < len(defaults) and not ended:
            if self.line >= len(self.lines):
                raise CastError(f"{self.path}: ends where more of a Bellhop environment must follow")
            self.line += 1
            for match in WORD.finditer(self.lines[self.line - 1]):
                ended = match[1] == "/"
                if ended or count == len(defaults) or match[1][0] == "!":
                    break
                values[count] = self._value(match[1], defaults[count])
                count += 1
        if count < needed:
            raise self.error(f"has {count} values where a Bellhop environment has {needed} or more")
        return values

    def numbers(self, defaults: tuple[float, ...], needed: int = 1) -> list[float]:
        """As `read`, of numbers alone."""
        return [float(value) for value in self.read(defaults, needed)]

    def text(self) -> str:
        """A record that is one text. Raises CastError."""
        return str(self.read(("",))[0])

    def _value(self, word: str, default: str | float) -> str | float:
        if isinstance(default, str):
            return word[1:-1] if word[0] in "'\"" else word
        try:
            number = float(re.sub("[dD]", "e", word))
        except ValueError:
            raise self.error(f"{word[:40]!r} is not a number") from None
        if not np.isfinite(number):
            raise self.error(f"{word[:40]!r} is not a finite number")
        return number

    def error(self, message: str) -> CastError:
        """An error in the record that was read last."""
        return CastError(f"{self.path}, line {self.line}: {message}")


def read_bellhop(path: Path, text: str, profile: int | None) -> CastTable:
    """The profile of an environmental file; where the sound speed varies with range, that of the `profile`-th range of
    the .ssp beside it (left out: the first). Raises CastError, which names what is not supported.
    """
    records = _Records(path, text.split("\n"))
    records.text()
    frequency = records.numbers((0.0,))[0]
    media = records.numbers((0.0,))[0]
    if media != 1:
        raise records.error(f"{media:g} media: layers under the water are not supported")
    options = records.text().ljust(6)
    if options[0] in REFUSED:
        raise records.error(f"{REFUSED[options[0]]} is not supported: one profile for all ranges is")
    if options[0] not in ("C", "Q", *INTERPOLATION):
        raise records.error(f"option {options[0]!r} is no way of Bellhop's to interpolate the sound speed")
    _skip_attenuation(records, options)
    if options[4] in "~*":
        raise records.error("an altimetry file (option '~') is not supported: the surface is flat")
    depth = records.numbers((0.0, 0.0, 0.0), 3)[2]
    nodes, lines = _nodes(records, depth)
    notes = []
    if options[0] == "Q":
        nodes[:, 1], note = _at_range(ranges_beside(path), len(nodes), profile or 0)
        notes.append(note)
    if options[0] in INTERPOLATION:
        law = INTERPOLATION[options[0]]
        notes.append(f"Bellhop interpolates this profile {law} (option '{options[0]}'), here it is straight lines")
    notes.append(_bottom(records, options[2], frequency, depth, nodes[-1, 1]))
    columns = {"depth": Column("z", nodes[:, 0]), "sound speed": Column("c", nodes[:, 1])}
    return CastTable(path, "Bellhop", columns, lines, ("z", "c"), notes=tuple(notes), several=options[0] == "Q")


def ranges_beside(path: Path) -> Path:
    """The .ssp that belongs to an environment."""
    return path.with_suffix(".ssp")


def _at_range(path: Path, nodes: int, profile: int) -> tuple[np.ndarray, str]:
    """Speeds (node,) at one of the ranges of a .ssp, and a note of how unlike the others are. Raises CastError."""
    try:
        rows = fortran_rows(named_files.read(path, MAX_SPEEDS).decode("ascii", "replace").split("\n"))
        if len(rows) < 2 + nodes:
            raise ValueError(f"has {max(len(rows) - 2, 0)} rows of sound speeds, its environment has {nodes} depths")
        (count,) = rows[0].axis(1)
        ranges = rows[1].axis(count)
        if not profile < count:
            raise ValueError(f"has no profile {profile}, only {count:g} (from 0)")
        speeds = np.array([row.axis(count) for row in rows[2 : 2 + nodes]])
    except ValueError as error:
        line = str(error)
        raise CastError(f"{path}{', ' if line.startswith('line ') else ': '}{line}") from None
    unlike = float(np.abs(speeds - speeds[:, profile, None]).max())
    where = f"profile {profile} of {count:g}, at {ranges[profile]:g} km, stands for all ranges"
    return speeds[:, profile], f"{where}: at others the sound speed is up to {unlike:.3g} m/s off it"


def _skip_attenuation(records: _Records, options: str) -> None:
    """The records that the options of the top ask for: attenuation in the water, what is above it."""
    if options[3] == "F":
        records.numbers((0.0,) * 4, 4)
    elif options[3] == "B":
        for _ in range(int(min(records.numbers((0.0,))[0], 200))):
            records.numbers((0.0,) * 5, 5)
    if options[1] == "A":
        records.numbers((0.0, *WATER))
    elif options[1] == "G":
        records.numbers((0.0, 0.0), 2)


def _nodes(records: _Records, bottom: float) -> tuple[np.ndarray, np.ndarray]:
    """Depths and speeds (node, 2) down to the bottom, and the line of each."""
    nodes: list[tuple[float, float]] = []
    lines: list[int] = []
    previous: tuple[float, ...] = WATER
    while not nodes or abs(nodes[-1][0] - bottom) > SAME:
        depth, *properties = records.numbers((nodes[-1][0] if nodes else 0.0, *previous))
        previous = tuple(properties)
        if depth > bottom + SAME or (nodes and depth <= nodes[-1][0]):
            fault = "not below the one before" if nodes and depth <= nodes[-1][0] else f"below the bottom, {bottom:g} m"
            raise records.error(f"the node at {depth:g} m is {fault}")
        nodes.append((depth, previous[0]))
        lines.append(records.line)
        if len(nodes) > MAX_ROWS:
            raise records.error(f"has more than {MAX_ROWS} nodes")
    return np.array(nodes), np.array(lines, np.int64)


def _bottom(records: _Records, unit: str, frequency: float, depth: float, speed: float) -> str:
    """A note of what the file says of the bottom, in words that a recipe takes."""
    options, _ = (str(value) for value in records.read(("", 0.0)))
    shape = (
        ""
        if options[1:2] not in ("~", "*")
        else f"; its bathymetry, {records.path.stem}.bty, can be given as the `relief`"
    )
    kind, depth_note = options[:1], f"the environment's depth is {depth:g} m in the file"
    reflection = {"V": "{kind: pressure_release}", "R": "{kind: rigid}"}.get(kind)
    if kind == "A":
        _, cp, cs, density, attenuation, _ = records.numbers((0.0, *WATER))
        if cp > 0.0 and density > 0.0 and speed > 0.0:
            loss = _loss_tangent(attenuation, unit, frequency, cp)
            reflection = f"{{kind: fluid, density_ratio: {density:.6g}, speed_ratio: {cp / speed:.6g}"
            reflection += "}" if loss is None else f", loss_tangent: {loss:.4g}}}"
            reflection += f", its loss (unit '{unit}') is not read" if loss is None else ""
            reflection += f", without its shear waves of {cs:g} m/s" if cs else ""
    if reflection is None:
        return f"{depth_note}; its bottom (option '{kind}') is not read{shape}"
    return f"{depth_note}, the reflection of its bottom {reflection}{shape}"


def _loss_tangent(attenuation: float, unit: str, frequency: float, speed: float) -> float | None:
    """Imaginary over real part of the wavenumber, from an attenuation in one of Bellhop's units; None for others."""
    omega = 2.0 * np.pi * frequency
    with np.errstate(divide="ignore", invalid="ignore"):
        nepers = {  # a metre, times speed over omega
            "N": attenuation * speed / omega,
            "M": attenuation / NEPER * speed / omega,
            "F": 1e-3 * attenuation * frequency / NEPER * speed / omega,
            "W": attenuation / (2.0 * np.pi * NEPER),
            "Q": 0.5 / attenuation if attenuation else 0.0,
            "L": attenuation,
        }
    return float(np.nan_to_num(nepers[unit])) if unit in nepers else None
