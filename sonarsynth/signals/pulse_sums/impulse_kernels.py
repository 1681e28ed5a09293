"""Compiled loop of sums of impulses. One thread, fixed order: the same bits on any number of workers."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.vectors import WIDTH, add_two


@compiled(fastmath=True)
def add_impulses(
    impulses: Any, angles: int, fractions: int, taps: int, source: Any, length: Any, gain: Any, start: Any,
    position: Any, scale: Any, cavity: Any, samples: int, pitch: int, out: Any,
) -> None:  # fmt: skip
    """Add an impulse of every row at every sensor to out (sensor * pitch,), so many samples each.

    impulses (pair * (fraction + 1) * tap,) are those of pairs i >= j of so many equal parts of |u_y| and |u_z|, number
    i (i + 1)/2 + j, linear between fractions of a sample. source (row, xyz) m is where the wave of a row seems to come
    from, length (row,) m how far that is from the middle of the array, where it is at start (row,) in samples; position
    (xyz, sensor) m, scale in samples/m; nearer than `cavity` (m) it is no louder. In single precision: delays err by
    1e-3 of a sample.
    """
    sensors, each, one = position.shape[1], (fractions + 1) * taps, np.float32(1.0)
    begin, table = np.empty(sensors, np.int32), np.empty(sensors, np.int32)
    v, w = np.empty(sensors, np.float32), np.empty(sensors, np.float32)
    for row in range(start.size):
        if gain[row] == 0.0:
            continue
        px, py, pz, r = source[row, 0], source[row, 1], source[row, 2], length[row]
        loud, whole = gain[row] * max(r, cavity), np.floor(start[row])
        part = np.float32(start[row] - whole)
        for s in range(sensors):
            qx, qy, qz = position[0, s], position[1, s], position[2, s]
            x, y, z = px - qx, py - qy, pz - qz
            away = np.sqrt(x * x + y * y + z * z)
            near = one / max(away, cavity)
            longer = (qx * (qx - px - px) + qy * (qy - py - py) + qz * (qz - pz - pz)) / (away + r)
            at = part + scale * longer
            after = np.floor(at)
            x = (after + one - at) * np.float32(fractions)
            n = min(np.int32(x), np.int32(fractions - 1))
            i = min(np.int32(abs(y) * near * np.float32(angles)), np.int32(angles - 1))
            j = min(np.int32(abs(z) * near * np.float32(angles)), np.int32(angles - 1))
            begin[s] = np.int32(whole) + np.int32(after) + np.int32(1 - taps // 2)
            pair = max(i, j) * (max(i, j) + 1) // 2 + min(i, j)
            table[s] = np.int32(pair * each + n * taps)
            w[s] = (x - np.float32(n)) * loud * near
            v[s] = loud * near - w[s]
        for s in range(sensors):
            if begin[s] >= 0 and begin[s] + taps <= samples:
                first, value = s * pitch + begin[s], table[s]
                for k in range(0, taps, WIDTH):
                    add_two(out, first + k, impulses, value + k, v[s], value + taps + k, w[s])  # type: ignore[call-arg]
