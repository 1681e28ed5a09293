"""What is kept of a ray that was found: one row of numbers."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.rays.ray_chain import sweep, time_and_length

FIELDS = 15
TIME, LENGTH, SLOWNESS, START_SINE, END_SINE, START_SPEED, END_SPEED, AMPLITUDE = range(8)
UPPER, LOWER, SURFACE, BOTTOM, TURNING, CAUSTICS, FLAG = range(8, FIELDS)
"""Columns of a found ray: s, m, s/m, sines (up positive), m/s, 1/m, depths of its vertices (m), counts, flag."""

COINCIDENT, CAUSTIC, PASSED = 1.0, 2.0, 3.0
BLOCK = 64  # rows that are near memory while they are read column by column
FOCUSED = 10.0  # times spherical spreading (20 dB): from here on the amplitude of ray theory is not to be trusted


@compiled(borrows=True)
def emit(
    out: Floats, row: int, s_m: float, p: float, distance: float,
    c: Floats, d: Floats, k: Floats, dz: Floats, crossings: Floats, first: int, last: int,
    turn_up: float, turn_down: float, start: int, end: int, turning: float,
) -> None:  # fmt: skip
    """Write a found ray that leaves node `start` of its chain for node `end`, its sines still without sign.

    T = tau + p R with tau = T(p) - p X(p) is right to second order. The amplitude in water of one density is that of
    the ray tube, A^2 = c_s c_r / ((X/p) |dX/dp| s_s s_r): the pressure at the end over that at 1 m from the start; it
    is the same both ways, and 1/r in isovelocity water. The ray tube has no width once between two turning points in
    turn, and once more after the last if dX/dp > 0 at the end: on the way from a turning point dX/dp rises from minus
    infinity, and a reflection leaves it as it is.
    """
    over_p, slope = sweep(s_m, p, d, k, first, last, turn_up, turn_down)
    time, length = time_and_length(s_m, p, c, d, dz, crossings, first, last, turn_up, turn_down)
    at_start, at_end = math.sqrt(s_m * s_m + p * p * d[start]), math.sqrt(s_m * s_m + p * p * d[end])
    amplitude = math.sqrt(c[start] * c[end] / (over_p * abs(slope) * at_start * at_end))
    caustics = 0.0
    if turning > 0.0:
        caustics = turning if slope > 0.0 else turning - 1.0
    out[row, TIME] = time + p * (distance - p * over_p)
    out[row, LENGTH] = length
    out[row, SLOWNESS] = p
    out[row, START_SINE], out[row, END_SINE] = at_start, at_end
    out[row, START_SPEED], out[row, END_SPEED] = c[start], c[end]
    out[row, AMPLITUDE] = amplitude
    out[row, UPPER] = out[row, LOWER] = math.nan
    out[row, SURFACE] = out[row, BOTTOM] = 0.0
    out[row, TURNING] = turning
    out[row, CAUSTICS] = caustics
    out[row, FLAG] = CAUSTIC if amplitude * length > FOCUSED else (PASSED if caustics > 0.0 else 0.0)


@compiled(borrows=True)
def emit_level(out: Floats, row: int, distance: float, c: float) -> None:
    """A horizontal ray in a layer of one speed, or coincident ends."""
    out[row, TIME], out[row, LENGTH], out[row, SLOWNESS] = distance / c, distance, 1.0 / c
    out[row, START_SINE] = out[row, END_SINE] = 0.0 if distance > 0.0 else math.nan
    out[row, START_SPEED] = out[row, END_SPEED] = c
    out[row, AMPLITUDE] = 1.0 / distance
    out[row, UPPER] = out[row, LOWER] = math.nan
    out[row, SURFACE] = out[row, BOTTOM] = out[row, TURNING] = out[row, CAUSTICS] = 0.0
    out[row, FLAG] = 0.0 if distance > 0.0 else COINCIDENT


@compiled(borrows=True)
def sort_by_time(out: Floats, first: int, count: int) -> None:
    """Sort rows by travel time, rays of one time by their launch: by insertion, a handful of rays."""
    for i in range(first + 1, first + count):
        j = i
        while j > first and (
            out[j, TIME] < out[j - 1, TIME]
            or (out[j, TIME] == out[j - 1, TIME] and out[j, START_SINE] < out[j - 1, START_SINE])
        ):
            for f in range(FIELDS):
                out[j, f], out[j - 1, f] = out[j - 1, f], out[j, f]
            j -= 1


@compiled
def in_columns(rows: Floats) -> tuple[Floats, Ints]:
    """The columns of rows (ray, FIELDS), one after the other: numbers (SURFACE, ray), and counts (rest, ray)."""
    values, counts = np.empty((SURFACE, len(rows))), np.empty((FIELDS - SURFACE, len(rows)), np.int64)
    for first in range(0, len(rows), BLOCK):
        last = min(first + BLOCK, len(rows))
        for column in range(SURFACE):
            for i in range(first, last):
                values[column, i] = rows[i, column]
        for column in range(SURFACE, FIELDS):
            for i in range(first, last):
                counts[column - SURFACE, i] = int(rows[i, column])
    return values, counts
