"""Rows tapered, and their power, compiled: one pass where array by array it is two."""

from __future__ import annotations

from typing import Any

from sonarsynth.compiling import compiled


@compiled
def taper_rows(values: Any, first: int, taper: Any, out: Any, power: Any) -> None:
    """Write values (row, sample), from sample `first` on, times taper (sample,) into out (row, sample), which may be
    longer; and add their squares, of all rows, to power (sample,)."""
    for i in range(values.shape[0]):
        row, tapered = values[i, first : first + len(taper)], out[i]
        for n in range(len(taper)):
            tapered[n] = row[n] * taper[n]
            power[n] += row[n] * row[n]
