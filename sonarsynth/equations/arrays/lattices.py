"""Planar lattices folded along both axes: which sensors mirror each other, and the delays that all of them share.

The middle column and row of an odd number stand on the positive side alone. Places count from the middle outwards.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.arrays.apertures import focus_delay


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


def half_coordinates(count: int, pitch: float) -> Floats:
    """Coordinates >= 0 (half count,) in m of `count` sensors `pitch` apart, from the middle outwards."""
    return 0.5 * pitch * np.arange((count + 1) % 2, count, 2, dtype=float)


def axial_focus_delay(columns: int, rows: int, pitch: float, focus: float | None, sound_speed: float) -> Floats:
    """Delay (half column, half row) in s after the array centre of a source at `focus` (m) on the axis x.

    (sqrt(R^2 + q^2) - R)/c, the same for the four sensors of a place; pitch in m; focus None: 0, a plane wave.
    """
    y, z = half_coordinates(columns, pitch), half_coordinates(rows, pitch)
    sensors = np.stack(np.broadcast_arrays(0.0, y[:, None], z), axis=-1)
    delay = focus_delay(sensors.reshape(-1, 3), np.array([1.0, 0.0, 0.0]), focus, sound_speed)
    return delay.reshape(len(y), len(z))
