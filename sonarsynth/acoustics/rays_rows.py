"""What is kept of a ray that was found: one row of numbers."""

from __future__ import annotations

import math

from numba import njit

from sonarsynth.acoustics.rays_chain import whole
from sonarsynth.conventions import Floats

FIELDS = 11
TIME, LENGTH, SLOWNESS, START_SINE, END_SINE, START_SPEED, END_SPEED, AMPLITUDE, TURN, CAUSTICS, FLAG = range(FIELDS)
"""Columns of a found ray: s, m, s/m, sines (up positive), m/s, 1/m, depth (m; NaN without a turn), caustics, flag."""

COINCIDENT, CAUSTIC, PASSED = 1.0, 2.0, 3.0
FOCUSED = 10.0  # times spherical spreading (20 dB): from here on the amplitude of ray theory is not to be trusted


@njit(cache=True, error_model="numpy", nogil=True)
def emit(
    out: Floats,
    row: int,
    s_m: float,
    p: float,
    distance: float,
    c: Floats,
    d: Floats,
    k: Floats,
    dz: Floats,
    crossings: Floats,
    n: int,
    end: int,
    inverse_gradient: float,
    turn: float,
) -> None:
    """Write a found ray: its ends are the chain's nodes 0 and `end`, its sines without sign; turn: depth, or NaN.

    T = tau + p R with tau = T(p) - p X(p) is right to second order. The amplitude in water of one density is that of
    the ray tube, A^2 = c_s c_r / ((X/p) |dX/dp| s_s s_r): the pressure at the end over that at 1 m from the start; it
    is the same both ways, and 1/r in isovelocity water.
    """
    over_p, slope, time, length = whole(s_m, p, c, d, k, dz, crossings, n, inverse_gradient)
    first, last = math.sqrt(s_m * s_m + p * p * d[0]), math.sqrt(s_m * s_m + p * p * d[end])
    amplitude = math.sqrt(c[0] * c[end] / (over_p * abs(slope) * first * last))
    passed = 1.0 if slope > 0.0 and not math.isnan(turn) else 0.0
    out[row, TIME] = time + p * (distance - p * over_p)
    out[row, LENGTH] = length
    out[row, SLOWNESS] = p
    out[row, START_SINE], out[row, END_SINE] = first, last
    out[row, START_SPEED], out[row, END_SPEED] = c[0], c[end]
    out[row, AMPLITUDE] = amplitude
    out[row, TURN] = turn
    out[row, CAUSTICS] = passed
    out[row, FLAG] = CAUSTIC if amplitude * length > FOCUSED else PASSED * passed


@njit(cache=True, error_model="numpy", nogil=True)
def emit_level(out: Floats, row: int, distance: float, c: float) -> None:
    """A horizontal ray in a layer of one speed, or coincident ends."""
    out[row, TIME], out[row, LENGTH], out[row, SLOWNESS] = distance / c, distance, 1.0 / c
    out[row, START_SINE] = out[row, END_SINE] = 0.0 if distance > 0.0 else math.nan
    out[row, START_SPEED] = out[row, END_SPEED] = c
    out[row, AMPLITUDE] = 1.0 / distance
    out[row, TURN] = math.nan
    out[row, CAUSTICS] = 0.0
    out[row, FLAG] = 0.0 if distance > 0.0 else COINCIDENT


@njit(cache=True, error_model="numpy", nogil=True)
def face(out: Floats, row: int, down: float, up: float, swapped: bool) -> None:
    """Give the sines of a ray their signs, at the upper and the lower end; swapped: the ray starts at the lower one."""
    out[row, START_SINE] *= down
    out[row, END_SINE] *= up
    if swapped:
        first, last = out[row, START_SINE], out[row, END_SINE]
        out[row, START_SINE], out[row, END_SINE] = -last, -first
        first, last = out[row, START_SPEED], out[row, END_SPEED]
        out[row, START_SPEED], out[row, END_SPEED] = last, first


@njit(cache=True, error_model="numpy", nogil=True)
def sort_by_time(out: Floats, first: int, count: int) -> None:
    """Sort rows by travel time: by insertion, a handful of rays."""
    for i in range(first + 1, first + count):
        j = i
        while j > first and out[j, TIME] < out[j - 1, TIME]:
            for f in range(FIELDS):
                out[j, f], out[j - 1, f] = out[j - 1, f], out[j, f]
            j -= 1
