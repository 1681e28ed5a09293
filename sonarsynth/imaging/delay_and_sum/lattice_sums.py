"""Delay and sum on a lattice: what images and single beams have in common, compiled.

The array is cut into subarrays. In each the delay of focusing is one of the sensor, plus a slope along z in each column
and one along y for each beam; the whole subarray is turned by the delay in its middle. With X focused, at a frequency,
sensors at y = +-(n + o) d, z = +-(m + o) d from that middle (o = 1/2 for an even number of them, 0 for an odd), S and D
sums and differences of sensors at +-z, s and d those of columns at +-y,

    L(y) = sum_m [cos((m + o) t_y) S - i sin((m + o) t_y) D]_m,    one for all beams of an elevation,
    B(el, az) = sum_subarrays e^(i p) sum_n [cos((n + o) t) s - i sin((n + o) t) d]_n,

t_y and t the phases of what a wave is sooner at the next row of column y, and at the next column to port. Every sum
runs over two sets of sensors at once, for two directions: the beam at (-el, az) hears the array as that at (+el, az)
hears its mirror image.

Cosines and sines come from Chebyshev's c_(j+1) = 2 cos(2t) c_j - c_(j-1). A group of frequencies, one a lane, is
summed at once, energies in chunks of some groups, whatever asks for them: always the same bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.lanes import LANES, WIDE, least, load, splat, store, with_sign
from sonarsynth.equations.kernels.phasors import C0, GROUPS, TWO, ZERO, group_steps, phasors, turned, weighted

TERM = 8 * LANES
"""float32 numbers of one term of a sum: sums and differences of two sets, complex numbers of a group of frequencies."""

FOUR = np.float32(4.0)


@compiled(forceinline=True)
def _seeds(c: Any, s: Any, odd: bool) -> Any:
    """The recurrence from the phasor (c, s) of half a step t: cosines and sines at o and o - 1 steps, and 2 cos(2t)."""
    cc, ss = c * c, s * s
    # 2 cc - 2 ss, from the smaller square: an error here is an error of frequency, largest where 2t is near 0 or pi.
    twice = with_sign(splat(TWO) - splat(FOUR) * least(cc, ss), cc - ss)
    zero, one = splat(ZERO), splat(C0)
    if odd:
        return one, cc - ss, zero, zero - splat(TWO) * s * c, twice
    return c, c, s, zero - s, twice


@compiled(forceinline=True)
def sums_of_two(terms: Any, start: int, stop: int, odd: bool, c: Any, s: Any, d: Any, t: Any) -> Any:
    """As `term_sums`: twenty multiply-adds a term and nothing else, in 26 registers."""
    c, c_, s, s_, p = _seeds(c, s, odd)
    d, d_, t, t_, q = _seeds(d, t, odd)
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
def sums_of_one(terms: Any, start: int, stop: int, odd: bool, c: Any, s: Any) -> Any:
    """The sums of one direction, in 14 registers: where there are sixteen, half of 26 would be kept in memory."""
    c, c_, s, s_, p = _seeds(c, s, odd)
    a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = splat(ZERO)
    for i in range(start, stop, TERM):
        a0 = a0 + c * load(terms, i)
        a1 = a1 + c * load(terms, i + LANES)
        a2 = a2 + c * load(terms, i + 2 * LANES)
        a3 = a3 + c * load(terms, i + 3 * LANES)
        a4 = a4 + s * load(terms, i + 4 * LANES)
        a5 = a5 + s * load(terms, i + 5 * LANES)
        a6 = a6 + s * load(terms, i + 6 * LANES)
        a7 = a7 + s * load(terms, i + 7 * LANES)
        c, c_, s, s_ = p * c - c_, c, p * s - s_, s
    return a0, a1, a2, a3, a4, a5, a6, a7


@compiled(forceinline=True)
def term_sums(terms: Any, start: int, stop: int, odd: bool, c: Any, s: Any, d: Any, t: Any) -> Any:
    """Sums of cosine times four numbers, of sine times four more, for two directions with half steps (c, s), (d, t).

    The terms lie at terms[start : stop : TERM].
    """
    if WIDE:
        return sums_of_two(terms, start, stop, odd, c, s, d, t)
    return sums_of_one(terms, start, stop, odd, c, s), sums_of_one(terms, start, stop, odd, d, t)


@compiled(forceinline=True)
def upper(sums: Any) -> Any:
    """Cosine sums less i times sine sums of both sets: four real numbers."""
    a, a_, b, b_, c, c_, d, d_ = sums
    return a + c_, a_ - c, b + d_, b_ - d


@compiled(forceinline=True)
def lower(sums: Any) -> Any:
    """The same of the opposite direction: plus i times the sine sums."""
    a, a_, b, b_, c, c_, d, d_ = sums
    return a - c_, a_ + c, b - d_, b_ + d


@compiled(forceinline=True)
def _fold(terms: Any, at: int, plus: Any, minus: Any) -> None:
    """Store a term: sums and differences of what is at + and at -, of both sets."""
    for_sums, for_differences = at, at + 4 * LANES
    store(terms, for_sums, plus[0] + minus[0])
    store(terms, for_sums + LANES, plus[1] + minus[1])
    store(terms, for_sums + 2 * LANES, plus[2] + minus[2])
    store(terms, for_sums + 3 * LANES, plus[3] + minus[3])
    store(terms, for_differences, plus[0] - minus[0])
    store(terms, for_differences + LANES, plus[1] - minus[1])
    store(terms, for_differences + 2 * LANES, plus[2] - minus[2])
    store(terms, for_differences + 3 * LANES, plus[3] - minus[3])


@compiled(forceinline=True)
def _turned(pairs: Any, at: int, weight: float, c: Any, s: Any) -> Any:
    x, y = weighted(pairs, 2 * at, weight)
    return turned(x, y, c, s)


@compiled(forceinline=True)
def focus(
    pairs: Any, bins: int, low: int, places: Any, weight: Any, delay: Any, frequency: float, spacing: float, folded: Any
) -> None:  # fmt: skip
    """Fill `folded` [side of y][column][row][S D] for the group of frequencies from bin `low` on; places (set, column,
    row, 4), delay (set, column, row, side of y)."""
    _, columns, rows, _ = places.shape
    for n in range(columns):
        for m in range(rows):
            for side in range(2):
                a, b = places[0, n, m, side], places[1, n, m, side]
                c, d = places[0, n, m, side + 2], places[1, n, m, side + 2]
                e, u = phasors(delay[0, n, m, side], frequency, spacing)
                f, v = phasors(delay[1, n, m, side], frequency, spacing)
                above = (
                    *_turned(pairs, a * bins + low, weight[a], e, u),
                    *_turned(pairs, b * bins + low, weight[b], f, v),
                )
                below = (
                    *_turned(pairs, c * bins + low, weight[c], e, u),
                    *_turned(pairs, d * bins + low, weight[d], f, v),
                )
                _fold(folded, ((side * columns + n) * rows + m) * TERM, above, below)


@compiled(forceinline=True)
def group_turns(delays: Any, spacing: float) -> Any:
    """Cosines and sines (float32, flat) of 2 pi delay LANES spacing: one group of frequencies on."""
    count = delays.size
    padded = count + -count % LANES
    half = np.zeros(padded)
    half[:count] = 0.5 * delays.ravel()
    cosines, sines = np.empty(padded, np.float32), np.empty(padded, np.float32)
    group_steps(half, spacing, cosines, sines)
    for i in range(0, padded, LANES):
        c, s = load(cosines, i), load(sines, i)
        c, s = turned(c, s, c, s)
        store(cosines, i, c)
        store(sines, i, s)
    return cosines, sines


@compiled(forceinline=True)
def groups_on(c: Any, s: Any, turns: Any, i: int) -> Any:
    """Phasor (c, s), a group of frequencies on."""
    return turned(c, s, splat(turns[0][i]), splat(turns[1][i]))


@compiled(forceinline=True)
def _put_line(lines: Any, at: int, line: Any, side: int) -> None:
    """The term of a column at +y and at -y, which come one after the other."""
    x, y, p, q = line
    if side == 0:
        store(lines, at, x)
        store(lines, at + LANES, y)
        store(lines, at + 2 * LANES, p)
        store(lines, at + 3 * LANES, q)
    else:
        port = load(lines, at), load(lines, at + LANES), load(lines, at + 2 * LANES), load(lines, at + 3 * LANES)
        _fold(lines, at, port, (x, y, p, q))


@compiled(forceinline=True)
def sums_over_rows(
    folded: Any, rows: int, heights: Any, odd: bool, rise: Any, turns: Any, inner: int, outer: int,
    frequency: float, spacing: float, groups: int, lines: Any, both: bool,
) -> None:  # fmt: skip
    """Sums over rows at two elevations, whose half steps `rise` (s) [side][column], and turns, are from `inner` and
    `outer` on: lines [two][up or down][group][column][s d], those down, at the opposite elevations, where `both`."""
    columns = len(heights)
    size = GROUPS * columns * TERM
    for n in range(columns):
        for side in range(2):
            i, j = inner + side * columns + n, outer + side * columns + n
            c, s = phasors(rise[i], frequency, spacing)
            d, t = phasors(rise[j], frequency, spacing)
            for group in range(groups):
                start = ((group * 2 + side) * columns + n) * rows * TERM
                near, far = term_sums(folded, start, start + heights[n] * TERM, odd, c, s, d, t)
                c, s = groups_on(c, s, turns, i)
                d, t = groups_on(d, t, turns, j)
                at = (group * columns + n) * TERM
                _put_line(lines, at, upper(near), side)
                _put_line(lines, at + 2 * size, upper(far), side)
                if both:
                    _put_line(lines, at + size, lower(near), side)
                    _put_line(lines, at + 3 * size, lower(far), side)
