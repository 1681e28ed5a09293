"""What of a cast a profile is made of: the down-cast, in the water, of rows that have what is needed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.environment.hydrography import another_unit
from sonarsynth.environment.readers.cast_table import CastError, CastTable

PLAUSIBLE: Final = {
    "depth": (-20.0, 12e3, "m"),
    "pressure": (-20.0, 12e3, "dbar"),
    "temperature": (-5.0, 50.0, "degC"),
    "salinity": (0.0, 50.0, "psu"),
    "conductivity": (0.0, 120.0, "mS/cm"),
    "sound speed": (1300.0, 1900.0, "m/s"),
}
"""A value of water; others are marks for "missing", a sensor in the air, a wrong unit or a wrong sign."""

MOST_IMPLAUSIBLE: Final = 0.5
"""Part of the rows that may have a value outside: of more, it is not the rows that are wrong."""
IN_AIR: Final = 0.1
"""A conductivity or salinity under this part of its median, near the surface, is of a sensor in the air."""
SALT: Final = 2.0
"""Median (psu, mS/cm) from which the water is salt enough to tell air from it."""
FEW: Final = 3
"""Rows under which a longer file is no cast, but a series at one depth."""
SURFACE: Final = 2.0
"""Depth (m) above which a sensor may be in the air."""


@dataclass
class Selection:
    """Rows that are left, in the order of their depth, and what was left out."""

    rows: Ints
    left_out: dict[str, int] = field(default_factory=dict)
    upward: bool = False

    def keep(self, good: np.ndarray, reason: str) -> None:
        """Leave out the rows that are not good."""
        if not good.all():
            self.left_out[reason] = self.left_out.get(reason, 0) + int(np.count_nonzero(~good))
            self.rows = self.rows[good]


def select(table: CastTable, needed: dict[str, Floats], depth: Floats) -> Selection:
    """Rows that make a profile, from the surface down.

    needed: (row,) columns without which a row is of no use; depth: (row,) m. Left out are rows with a missing or an
    impossible value, those in the air, one of the two ways where a cast has both, and those less deep than one before
    (heave loops). Raises CastError where nothing is left, or where most of a column is impossible.
    """
    selection = Selection(np.arange(len(depth)))
    complete = np.all([np.isfinite(values) for values in needed.values()], axis=0)
    selection.keep(complete, "with a missing value")
    empty = [name for name, values in needed.items() if not np.isfinite(values).any()]
    hint = "; give the `salinity`" if empty == ["salinity"] else ""
    _nonempty(table, selection, f"; '{table.columns[empty[0]].name}' has no good value{hint}" if empty else "")
    _check(table, {name: values[selection.rows] for name, values in needed.items()}, selection.rows)
    for name, values in needed.items():
        low, high, _ = PLAUSIBLE[name]
        column = values[selection.rows]
        selection.keep((column >= low) & (column <= high), "with an impossible value")
    _nonempty(table, selection)
    selection.keep(~_in_air(needed, depth, selection.rows), "in the air")
    _nonempty(table, selection)
    _one_way(selection, depth)
    z = depth[selection.rows]
    deepest = np.maximum.accumulate(z)
    selection.keep(np.append(True, z[1:] >= deepest[:-1]), "of heave loops")
    if len(selection.rows) < FEW < len(table.lines):
        raise CastError(
            f"{table.path}: is no cast: {len(selection.rows)} of {len(table.lines)} rows go down, {left_out(selection)}"
        )
    return selection


def left_out(selection: Selection) -> str:
    """What was left out, for people."""
    return ", ".join(f"{count} {reason}" for reason, count in selection.left_out.items())


def averaged(depth: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Depths that differ, and the mean of the values of each."""
    z, back, count = np.unique(depth, return_inverse=True, return_counts=True)
    return (depth, values) if len(z) == len(depth) else (z, np.bincount(back, values) / count)


def _nonempty(table: CastTable, selection: Selection, why: str = "") -> None:
    if not len(selection.rows):
        raise CastError(f"{table.path}: no row can be used ({left_out(selection)}){why}")


def _check(table: CastTable, needed: dict[str, Floats], rows: Ints) -> None:
    """Refuses a column of which most is impossible, with the first such value."""
    for name, values in needed.items():
        low, high, unit = PLAUSIBLE[name]
        wrong = ~((values >= low) & (values <= high))
        heights = name == "depth" and values.max() <= 0.0 and values.min() < 0.0
        if np.mean(wrong) > MOST_IMPLAUSIBLE or heights:
            at = int(np.argmax(wrong)) if wrong.any() else int(np.argmax(values < 0))
            low = max(low, 0.0) if name in ("depth", "pressure") else low
            raise CastError(
                f"{table.where(int(rows[at]))}, column '{table.columns[name].name}': "
                f"{values[at]:g} {unit} is not a {name} between {low:g} and {high:g} {unit}"
                + (another_unit(float(values[at])) if name == "temperature" else "")
            )


def _in_air(needed: dict[str, Floats], depth: Floats, rows: Ints) -> np.ndarray:
    """Rows above the surface, or near it with next to no salt where the water has some."""
    z = depth[rows]
    air = z < 0.0
    for name in ("salinity", "conductivity"):
        if name in needed:
            column = needed[name][rows]
            median = float(np.median(column))
            air |= (median > SALT) & (column < IN_AIR * median) & (z < SURFACE)
    return np.asarray(air)


def _one_way(selection: Selection, depth: Floats) -> None:
    """The way down from the last time that it was highest before the deepest row; the way up where that is longer."""
    z = depth[selection.rows]
    deepest = int(np.argmax(z))
    down, up = z[: deepest + 1], z[deepest:]
    if np.ptp(up) > 2.0 * np.ptp(down):
        selection.upward = True
        end = deepest + int(np.argmin(up))
        rows = np.arange(end, deepest - 1, -1)
        name = "of the way down"
    else:
        start = len(down) - 1 - int(np.argmin(down[::-1]))
        rows = np.arange(start, deepest + 1)
        name = "of the way up"
    if len(rows) < len(z):
        selection.left_out[name] = len(z) - len(rows)
    selection.rows = selection.rows[rows]
