"""Numbers as whole multiples of a step, compiled: one pass where array by array it is five."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled


def multiples(values: npt.NDArray[Any], step: float) -> npt.NDArray[np.int16]:
    """The nearest whole numbers of steps (row, column) of values (row, column)."""
    out = np.empty(values.shape, np.int16)
    _multiples(values, values.dtype.type(step), out)
    return out


@compiled
def _multiples(values: npt.NDArray[Any], step: Any, out: npt.NDArray[np.int16]) -> None:
    for i in range(values.shape[0]):
        row, counts = values[i], out[i]
        for j in range(len(row)):
            counts[j] = np.int16(np.rint(row[j] / step))


@compiled
def round_off(values: npt.NDArray[Any], step: Any, limit: Any, out: npt.NDArray[Any], first: int) -> tuple[int, int]:
    """Write values (row, column) rounded to whole steps, at most `limit` steps either way, into out, from its column
    `first` on. Returns how many were beyond that, and how many are not a number."""
    clipped = unknown = 0
    for i in range(values.shape[0]):
        row, rounded = values[i], out[i, first : first + values.shape[1]]
        beyond: Any = np.int32(0)  # one count of the size of the numbers: what is beyond is seldom
        for j in range(len(row)):
            count = np.rint(row[j] / step)
            beyond += np.int32(not abs(count) <= limit)
            rounded[j] = min(max(count, -limit), limit) * step
        if beyond > 0:
            nothing = int(np.isnan(row).sum())
            clipped, unknown = clipped + beyond - nothing, unknown + nothing
    return clipped, unknown
