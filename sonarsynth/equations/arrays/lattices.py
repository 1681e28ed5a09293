"""Planar lattices folded along both axes: which sensors mirror each other.

The middle column and row of an odd number stand on the positive side alone. Places count from the middle outwards.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints


def mirrored_sensors(column: Ints, row: Ints, columns: int, rows: int, live: Ints, nobody: int) -> Ints:
    """(half column, half row, 4) sensors at (+z, +y), (+z, -y), (-z, +y), (-z, -y), from the middle outwards.

    column, row (sensor,) on the lattice, column 0 at +y and row 0 at +z; live: the sensors to be placed; `nobody` where
    there is none.
    """
    places = np.full(((columns + 1) // 2, (rows + 1) // 2, 4), nobody)
    # Twice the lattice coordinate, a whole number: 1, 3, 5... for an even number of sensors, 0, 2, 4... for an odd.
    along_y, along_z = columns - 1 - 2 * column[live], rows - 1 - 2 * row[live]
    places[np.abs(along_y) // 2, np.abs(along_z) // 2, 2 * (along_z < 0) + (along_y < 0)] = live
    return places


def rows_in_use(used: Bools) -> Ints:
    """Half rows (..., half column) up to the last that is used (..., half column, half row)."""
    return np.where(np.any(used, axis=-1), used.shape[-1] - np.argmax(used[..., ::-1], axis=-1), 0)


def half_coordinates(count: int, pitch: float) -> Floats:
    """Coordinates >= 0 (half count,) in m of `count` sensors `pitch` apart, from the middle outwards."""
    return 0.5 * pitch * np.arange((count + 1) % 2, count, 2, dtype=float)
