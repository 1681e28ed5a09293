"""Compiled loop of sums of pulses. One thread, fixed order: the same bits on any number of workers."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.vectors import WIDTH, add_two


@compiled(fastmath=True, forceinline=True)
def _mix(modes: Any, weight: Any, size: int, table: Any) -> None:
    """The sum (size,) of modes (mode * size,) times weight (mode,): an even number of them."""
    table[:] = 0.0
    for k in range(0, weight.size, 2):
        for i in range(0, size, WIDTH):
            add_two(table, i, modes, k * size + i, weight[k], (k + 1) * size + i, weight[k + 1])  # type: ignore[call-arg]


@compiled(fastmath=True)
def add_pulses(
    modes: Any, taps: int, fractions: int, weight: Any, first: Any, last: Any, source: Any, length: Any, start: Any,
    position: Any, rate: float, slowness: float, cavity: float, samples: int, pitch: int, out: Any,
) -> None:  # fmt: skip
    """Add the pulse of every row at the sensors first to last (row,) to out (sensor * pitch,), so many samples each.

    The pulse is the sum of modes (mode * fraction * tap,) times weight (row, mode): at the fractions of a sample before
    each tap, linear in between, one fraction more than `fractions`. source (row, xyz) m is where its wave seems to
    come from, length (row,) m how far that is from the middle of the array, where the first tap is at start (row,) in
    samples. position (xyz, sensor) m; rate in samples/s, slowness in s/m; nearer than `cavity` (m) it is no louder.
    """
    sensors, size, number = position.shape[1], (fractions + 1) * taps, modes.dtype.type
    table = np.zeros(size, modes.dtype)
    begin, fraction = np.empty(sensors, np.int32), np.empty(sensors, np.int32)
    v, w = np.empty(sensors, modes.dtype), np.empty(sensors, modes.dtype)
    scale = rate * slowness
    for row in range(start.size):
        _mix(modes, weight[row], size, table)
        px, py, pz, r = source[row, 0], source[row, 1], source[row, 2], length[row]
        own = slice(first[row], last[row])  # many at once: slices
        ahead, across, up = position[0][own], position[1][own], position[2][own]
        for s in range(len(ahead)):
            qx, qy, qz = ahead[s], across[s], up[s]
            x, y, z = px - qx, py - qy, pz - qz
            away = np.sqrt(x * x + y * y + z * z)
            longer = (qx * (qx - 2.0 * px) + qy * (qy - 2.0 * py) + qz * (qz - 2.0 * pz)) / (away + r)
            at, gain = start[row] + scale * longer, max(r, cavity) / max(away, cavity)
            after = np.floor(at) + 1.0
            x = (after - at) * fractions
            n = min(np.floor(x), fractions - 1.0)
            begin[s], fraction[s] = np.int32(after), np.int32(n)
            w[s] = number((x - n) * gain)
            v[s] = number(gain) - w[s]
        for s in range(len(ahead)):
            if begin[s] >= 0 and begin[s] + taps <= samples:
                line, value = (first[row] + s) * pitch + begin[s], fraction[s] * taps
                for j in range(0, taps, WIDTH):
                    add_two(out, line + j, table, value + j, v[s], value + taps + j, w[s])  # type: ignore[call-arg]
