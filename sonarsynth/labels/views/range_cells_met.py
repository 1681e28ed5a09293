"""Which target beams meet at each range, on the grid of a range image."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import NO_TARGET, Floats

STEEPEST = 4.0
"""Two beams of a column that meet a target meet what lies between too, where its ranges differ by no more than so many
times what the beams are apart there: its surface is not seen under less than 14 degrees."""


def met_at_ranges(
    target: npt.NDArray[np.int16], distance: npt.NDArray[np.float32], elevation: Floats, ranges: Floats
) -> npt.NDArray[np.int16]:
    """Target (range, azimuth) that a beam of an azimuth meets within half a step of a range, of several that of the
    highest beam; -1: none.

    target, distance (elevation, azimuth): what each beam meets, -1 for none, and how far away (m); elevation
    (elevation,) rad; ranges (range,) m, evenly spaced.
    """
    met = np.full((len(ranges), target.shape[1]), NO_TARGET, np.int16)
    step = ranges[1] - ranges[0] if len(ranges) > 1 else 1.0

    def mark(column: int, number: int, near: float, far: float) -> None:
        first, last = (round((r - ranges[0]) / step) for r in (near, far))
        met[max(first, 0) : max(last + 1, 0), column] = number

    apart = STEEPEST * float(np.diff(elevation).max(initial=0.0))
    for row, column in zip(*np.nonzero(target >= 0), strict=True):
        number, here = int(target[row, column]), float(distance[row, column])
        mark(column, number, here, here)
        below = float(distance[row - 1, column]) if row and target[row - 1, column] == number else np.inf
        if abs(here - below) < apart * here:
            mark(column, number, min(here, below), max(here, below))
    return met


def box_of(cells: npt.NDArray[np.bool_]) -> tuple[float, float, float, float] | None:
    """x0, y0, x1, y1 about some cells (range, azimuth), in cells, as `pixel_box` is in beams: x along azimuth, y along
    range; None without any."""
    rows, columns = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return None
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)
