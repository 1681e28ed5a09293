"""Energies of focused beams of a lattice on a grid of azimuth and elevation: the compiled kernel.

For one frequency, with sensors at y = +-(n + o) d, z = +-(m + o) d (o = 1/2 for an even number of them, 0 for an odd),

    B(el, az) = sum_nm X[m, n] exp(-i k (z_m sin el + y_n cos el sin az)),

sin el fixes the phase along z: one pass sums over rows for each elevation, a second over columns for each azimuth. Each
works on sums and differences of mirrored sensors (S, D along z; s, d along y), so that its phases are real numbers,

    B(+el, +az) = a - i b - i c - d,    a = sum cos cos Ss, b = sum cos sin Sd, c = sum sin cos Ds, d = sum sin sin Dd,

and each sum serves four mirrored beams: b and d change sign with the azimuth, c and d with the elevation. Cosines and
sines come from Chebyshev's c_(j+1) = 2 cos(2t) c_j - c_(j-1). Sixteen frequencies are summed at once, energies in
chunks of 64, whatever asks for them: always the same bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.lanes import LANES, least, load, splat, store, total, with_sign
from sonarsynth.equations.kernels.phasors import (
    C0,
    CHUNK,
    GROUPS,
    TWO,
    ZERO,
    group_steps,
    half_phasors,
    phasors,
    turned,
    weighted,
)

TERM = 8 * LANES
"""float32 numbers of one term of a sum: four complex numbers (Ss Sd Ds Dd, or Ss Ds Sd Dd) of sixteen frequencies."""

FOUR = np.float32(4.0)


@compiled(forceinline=True)
def seeds(c: Any, s: Any, odd: bool) -> Any:
    """The recurrence from the phasor (c, s) of half a step t: cosines and sines at o and o - 1 steps, and 2 cos(2t)."""
    cc, ss = c * c, s * s
    # 2 cc - 2 ss, from the smaller square: an error here is an error of frequency, largest where 2t is near 0 or pi.
    twice = with_sign(splat(TWO) - splat(FOUR) * least(cc, ss), cc - ss)
    zero, one = splat(ZERO), splat(C0)
    if odd:
        return one, cc - ss, zero, zero - splat(TWO) * s * c, twice
    return c, c, s, zero - s, twice


@compiled(forceinline=True)
def _sums(terms: Any, start: int, stop: int, odd: bool, c: Any, s: Any, d: Any, t: Any) -> Any:
    """Sums of cosine times four numbers, of sine times four more, for two directions with half steps (c, s), (d, t).

    The terms lie at terms[start : stop : TERM]. Twenty multiply-adds a term and nothing else, in 26 registers.
    """
    c, c_, s, s_, p = seeds(c, s, odd)
    d, d_, t, t_, q = seeds(d, t, odd)
    a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = splat(ZERO)
    b0 = b1 = b2 = b3 = b4 = b5 = b6 = b7 = splat(ZERO)
    for i in range(start, stop, TERM):
        x = load(terms, i)
        a0, b0 = a0 + c * x, b0 + d * x
        x = load(terms, i + LANES)
        a1, b1 = a1 + c * x, b1 + d * x
        x = load(terms, i + 2 * LANES)
        a2, b2 = a2 + c * x, b2 + d * x
        x = load(terms, i + 3 * LANES)
        a3, b3 = a3 + c * x, b3 + d * x
        x = load(terms, i + 4 * LANES)
        a4, b4 = a4 + s * x, b4 + t * x
        x = load(terms, i + 5 * LANES)
        a5, b5 = a5 + s * x, b5 + t * x
        x = load(terms, i + 6 * LANES)
        a6, b6 = a6 + s * x, b6 + t * x
        x = load(terms, i + 7 * LANES)
        a7, b7 = a7 + s * x, b7 + t * x
        c, c_, s, s_ = p * c - c_, c, p * s - s_, s
        d, d_, t, t_ = q * d - d_, d, q * t - t_, t
    return (a0, a1, a2, a3, a4, a5, a6, a7), (b0, b1, b2, b3, b4, b5, b6, b7)


@compiled(forceinline=True)
def _add_energies(sums: Any, energies: Any) -> Any:
    """Add |B|^2 of the beams (+el, +az), (+el, -az), (-el, +az), (-el, -az), from real and imaginary a, c, b, d."""
    a, a_, c, c_, b, b_, d, d_ = sums
    upper_port, upper_starboard, lower_port, lower_starboard = energies
    p, p_, q, q_ = a - d, a_ - d_, b + c, b_ + c_
    u, u_, v, v_ = a + d, a_ + d_, b - c, b_ - c_
    x, y = p + q_, p_ - q
    upper_port = upper_port + x * x + y * y
    x, y = u - v_, u_ + v
    upper_starboard = upper_starboard + x * x + y * y
    x, y = u + v_, u_ - v
    lower_port = lower_port + x * x + y * y
    x, y = p - q_, p_ + q
    lower_starboard = lower_starboard + x * x + y * y
    return upper_port, upper_starboard, lower_port, lower_starboard


@compiled
def _focus_and_fold(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, frequency: float, spacing: float, low: int, folded: Any
) -> None:
    """Fill `folded` [column][row][Ss Sd Ds Dd] for the sixteen frequencies from bin `low` on, focused by `delay`."""
    columns, rows, _ = places.shape
    for n in range(columns):
        for m in range(rows):
            j, k, g, h = places[n, m, 0], places[n, m, 1], places[n, m, 2], places[n, m, 3]
            x0, y0 = weighted(pairs, 2 * (j * bins + low), weight[j])
            x1, y1 = weighted(pairs, 2 * (k * bins + low), weight[k])
            x2, y2 = weighted(pairs, 2 * (g * bins + low), weight[g])
            x3, y3 = weighted(pairs, 2 * (h * bins + low), weight[h])
            c, s = phasors(delay[n, m], frequency + low * spacing, spacing)
            at = (n * rows + m) * TERM
            _store_turned(folded, at, (x0 + x1) + (x2 + x3), (y0 + y1) + (y2 + y3), c, s)
            _store_turned(folded, at + 2 * LANES, (x0 - x1) + (x2 - x3), (y0 - y1) + (y2 - y3), c, s)
            _store_turned(folded, at + 4 * LANES, (x0 + x1) - (x2 + x3), (y0 + y1) - (y2 + y3), c, s)
            _store_turned(folded, at + 6 * LANES, (x0 - x1) - (x2 - x3), (y0 - y1) - (y2 - y3), c, s)


@compiled(forceinline=True)
def _store_turned(folded: Any, at: int, real: Any, imaginary: Any, c: Any, s: Any) -> None:
    x, y = turned(real, imaginary, c, s)
    store(folded, at, x)
    store(folded, at + LANES, y)


@compiled(forceinline=True)
def _store_line(line: Any, at: int, sums: Any) -> None:
    """Store the sums over rows in the order of the second pass: Ss Ds take its cosines, Sd Dd its sines."""
    a, a_, b, b_, c, c_, d, d_ = sums
    store(line, at, a)
    store(line, at + LANES, a_)
    store(line, at + 2 * LANES, c)
    store(line, at + 3 * LANES, c_)
    store(line, at + 4 * LANES, b)
    store(line, at + 5 * LANES, b_)
    store(line, at + 6 * LANES, d)
    store(line, at + 7 * LANES, d_)


@compiled
def _first_pass(
    folded: Any, size: int, rows: int, heights: Any, odd: bool, inner: float, outer: float, frequency: float,
    spacing: float, groups: int, lines: Any,
) -> None:  # fmt: skip
    """Sums over rows for two elevations (half steps `inner`, `outer`, s): lines [two][group][column][Ss Ds Sd Dd]."""
    columns = len(heights)
    for group in range(groups):
        at = frequency + group * LANES * spacing
        c, s = half_phasors(inner, at, spacing)
        d, t = half_phasors(outer, at, spacing)
        for n in range(columns):
            start = group * size + n * rows * TERM
            upper, lower = _sums(folded, start, start + heights[n] * TERM, odd, c, s, d, t)
            _store_line(lines, (group * columns + n) * TERM, upper)
            _store_line(lines, ((GROUPS + group) * columns + n) * TERM, lower)


@compiled
def _second_pass(
    lines: Any, start: int, columns: int, odd: bool, steps: Any, turns_c: Any, turns_s: Any, frequency: float,
    spacing: float, groups: int, sums: Any,
) -> None:  # fmt: skip
    """Energies over `groups` of the four mirrored beams for each azimuth (half steps `steps`, s): sums (azimuth, 4)."""
    for i in range(0, len(sums), 2):
        c, s = half_phasors(steps[i], frequency, spacing)
        d, t = half_phasors(steps[i + 1], frequency, spacing)
        zero = splat(ZERO)
        near, far = (zero, zero, zero, zero), (zero, zero, zero, zero)
        for group in range(groups):
            first = start + group * columns * TERM
            inner, outer = _sums(lines, first, first + columns * TERM, odd, c, s, d, t)
            near, far = _add_energies(inner, near), _add_energies(outer, far)
            c, s = turned(c, s, splat(turns_c[i]), splat(turns_s[i]))
            d, t = turned(d, t, splat(turns_c[i + 1]), splat(turns_s[i + 1]))
        sums[i, 0], sums[i, 1], sums[i, 2], sums[i, 3] = total(near[0]), total(near[1]), total(near[2]), total(near[3])
        sums[i + 1, 0], sums[i + 1, 1], sums[i + 1, 2], sums[i + 1, 3] = (
            total(far[0]),
            total(far[1]),
            total(far[2]),
            total(far[3]),
        )


@compiled
def _add_mirrored(energy: Any, elevation: int, sums: Any) -> None:
    """Add the sums (azimuth, 4) of one elevation >= 0 to the four quadrants of the image; beams on an axis once."""
    elevations, azimuths = energy.shape
    below = elevations - 1 - elevation
    for i in range((azimuths + 1) // 2):
        port = azimuths // 2 + i
        starboard = azimuths - 1 - port
        energy[elevation, port] += sums[i, 0]
        if starboard != port:
            energy[elevation, starboard] += sums[i, 1]
        if below != elevation:
            energy[below, port] += sums[i, 2]
        if below != elevation and starboard != port:
            energy[below, starboard] += sums[i, 3]


@compiled
def lattice_energies(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, heights: Any, odd_rows: bool, odd_columns: bool,
    half_pitch: float, frequency: float, spacing: float, azimuth: Any, elevation: Any,
) -> Any:  # fmt: skip
    """Sum over bins of |B|^2: (elevation, azimuth) float64.

    pairs: spectra (sensor + 1, bins) as float32 pairs, bins a multiple of 16, the last sensor silent; places (column,
    row, 4) from the middle outwards: sensors at (+z, +y), (+z, -y), (-z, +y), (-z, -y), the silent one where there is
    none; weight (sensor + 1,) float32; delay (column, row) s, of focusing; heights (column,): rows in use; half_pitch:
    d/(2 c) in s; frequency, spacing: of bin 0 and between bins (Hz); azimuth, elevation: ascending, exactly
    antisymmetric (rad).
    """
    columns, rows, _ = places.shape
    size = columns * rows * TERM
    folded = np.empty(GROUPS * size, np.float32)
    lines = np.empty(2 * GROUPS * columns * TERM, np.float32)
    upper, port = elevation[len(elevation) // 2 :], azimuth[len(azimuth) // 2 :]
    along = half_pitch * np.sin(port)
    wide = len(port) + -len(port) % LANES
    steps, turns_c, turns_s = np.zeros(wide), np.empty(wide, np.float32), np.empty(wide, np.float32)
    sums = np.empty((len(port) + len(port) % 2, 4), np.float32)
    energy = np.zeros((len(elevation), len(azimuth)))
    for low in range(0, bins, CHUNK):
        groups = min(GROUPS, (bins - low) // LANES)
        first = frequency + low * spacing
        for group in range(groups):
            at = folded[group * size : (group + 1) * size]
            _focus_and_fold(pairs, bins, places, weight, delay, frequency, spacing, low + group * LANES, at)
        for pair in range(0, len(upper), 2):
            both = upper[pair], upper[min(pair + 1, len(upper) - 1)]
            inner, outer = half_pitch * np.sin(both[0]), half_pitch * np.sin(both[1])
            _first_pass(folded, size, rows, heights, odd_rows, inner, outer, first, spacing, groups, lines)
            for which in range(min(2, len(upper) - pair)):
                steps[: len(port)] = np.cos(both[which]) * along
                group_steps(steps, spacing, turns_c, turns_s)
                start = which * GROUPS * columns * TERM
                _second_pass(lines, start, columns, odd_columns, steps, turns_c, turns_s, first, spacing, groups, sums)
                _add_mirrored(energy, len(elevation) // 2 + pair + which, sums)
    return energy
