"""Energies of the beams of four mirrored zones of a picture, each focused on its own centre: the compiled kernel.

The delay of focusing differs from sensor to sensor, so that mirrored beams share no sums as they do in
`lattice_kernel`. Mirrored zones share the delays: the zone at (-el, az) hears the array as the zone at (+el, az) hears
its mirror image. With X focused, S and D the sums and differences of sensors at +-z, s and d those of columns at +-y,

    L(y) = sum_m [cos((m + o) t_y) S - i sin((m + o) t_y) D]_m,    t_y = k d (sin el + what focusing adds at column y),
    B(el, az) = sum_n [cos((n + o) t) s - i sin((n + o) t) d]_n,   t = k d (cos el sin az + what focusing adds).

Recurrences, lanes and chunks are those of `lattice_kernel`.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np

from sonarsynth.equations.kernels.lanes import LANES, load, splat, store, total
from sonarsynth.equations.kernels.phasors import (
    CHUNK,
    GROUPS,
    ZERO,
    group_steps,
    half_phasors,
    phasors,
    turned,
    weighted,
)
from sonarsynth.imaging.delay_and_sum.lattice_kernel import seeds

TERM = 4 * LANES
"""float32 numbers of one term of a sum: two complex numbers (sum and difference of a pair) of sixteen frequencies."""


@nb.njit(cache=True, nogil=True, forceinline=True)
def _sums(terms: Any, start: int, stop: int, odd: bool, c: Any, s: Any, d: Any, t: Any) -> Any:
    """Sum of cosine times sums minus i sine times differences, for two directions with half steps (c, s), (d, t)."""
    c, c_, s, s_, p = seeds(c, s, odd)
    d, d_, t, t_, q = seeds(d, t, odd)
    a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = splat(ZERO)
    for i in range(start, stop, TERM):
        x = load(terms, i)
        a0, b0 = a0 + c * x, b0 + d * x
        x = load(terms, i + LANES)
        a1, b1 = a1 + c * x, b1 + d * x
        x = load(terms, i + 2 * LANES)
        a2, b2 = a2 + s * x, b2 + t * x
        x = load(terms, i + 3 * LANES)
        a3, b3 = a3 + s * x, b3 + t * x
        c, c_, s, s_ = p * c - c_, c, p * s - s_, s
        d, d_, t, t_ = q * d - d_, d, q * t - t_, t
    return (a0 + a3, a1 - a2), (b0 + b3, b1 - b2)


@nb.njit(cache=True, nogil=True, forceinline=True)
def _store_pair(terms: Any, at: int, above: Any, below: Any) -> None:
    store(terms, at, above[0] + below[0])
    store(terms, at + LANES, above[1] + below[1])
    store(terms, at + 2 * LANES, above[0] - below[0])
    store(terms, at + 3 * LANES, above[1] - below[1])


@nb.njit(cache=True, nogil=True)
def _focusing(delay: Any, frequency: float, spacing: float, focusing: Any) -> None:
    """Fill `focusing` [column][row][4][cosine, sine] with the phasors of `delay` for sixteen frequencies."""
    columns, rows, _ = delay.shape
    for n in range(columns):
        for m in range(rows):
            for j in range(4):
                c, s = phasors(delay[n, m, j], frequency, spacing)
                at = ((n * rows + m) * 4 + j) * 2 * LANES
                store(focusing, at, c)
                store(focusing, at + LANES, s)


@nb.njit(cache=True, nogil=True, forceinline=True)
def _focused(pairs: Any, at: int, weight: float, focusing: Any, offset: int) -> Any:
    x, y = weighted(pairs, at, weight)
    return turned(x, y, load(focusing, offset), load(focusing, offset + LANES))


@nb.njit(cache=True, nogil=True)
def _focus_and_fold(
    pairs: Any, bins: int, places: Any, weight: Any, mirror: int, focusing: Any, low: int, folded: Any
) -> None:
    """Fill `folded` [side of y][column][row][S D] for the sixteen frequencies from bin `low` on, array mirrored."""
    columns, rows, _ = places.shape
    for n in range(columns):
        for m in range(rows):
            for side in range(2):
                up, down = places[n, m, side ^ mirror], places[n, m, (side + 2) ^ mirror]
                offset = ((n * rows + m) * 4 + side) * 2 * LANES
                above = _focused(pairs, 2 * (up * bins + low), weight[up], focusing, offset)
                below = _focused(pairs, 2 * (down * bins + low), weight[down], focusing, offset + 4 * LANES)
                _store_pair(folded, ((side * columns + n) * rows + m) * TERM, above, below)


@nb.njit(cache=True, nogil=True)
def _first_pass(
    folded: Any, size: int, rows: int, heights: Any, odd: bool, inner: Any, outer: Any, frequency: float,
    spacing: float, groups: int, lines: Any,
) -> None:  # fmt: skip
    """Sums over rows at two elevations (half steps inner, outer (side, column), s): lines [two][group][column][s d]."""
    columns = len(heights)
    for group in range(groups):
        at = frequency + group * LANES * spacing
        for n in range(columns):
            # Whole phasors, not half: columns are summed, and all need the same sign.
            start = group * size + n * rows * TERM
            c, s = phasors(inner[0, n], at, spacing)
            d, t = phasors(outer[0, n], at, spacing)
            upper, lower = _sums(folded, start, start + heights[n] * TERM, odd, c, s, d, t)
            start += columns * rows * TERM
            c, s = phasors(inner[1, n], at, spacing)
            d, t = phasors(outer[1, n], at, spacing)
            upper_, lower_ = _sums(folded, start, start + heights[n] * TERM, odd, c, s, d, t)
            _store_pair(lines, (group * columns + n) * TERM, upper, upper_)
            _store_pair(lines, ((GROUPS + group) * columns + n) * TERM, lower, lower_)


@nb.njit(cache=True, nogil=True)
def _second_pass(
    lines: Any, start: int, columns: int, odd: bool, steps: Any, turns_c: Any, turns_s: Any, frequency: float,
    spacing: float, groups: int, sums: Any,
) -> None:  # fmt: skip
    """Energies over `groups` of the beams of one elevation (half steps `steps`, s): sums (azimuth,)."""
    for i in range(0, len(sums), 2):
        c, s = half_phasors(steps[i], frequency, spacing)
        d, t = half_phasors(steps[i + 1], frequency, spacing)
        near = far = splat(ZERO)
        for group in range(groups):
            first = start + group * columns * TERM
            inner, outer = _sums(lines, first, first + columns * TERM, odd, c, s, d, t)
            near = near + inner[0] * inner[0] + inner[1] * inner[1]
            far = far + outer[0] * outer[0] + outer[1] * outer[1]
            c, s = turned(c, s, splat(turns_c[i]), splat(turns_s[i]))
            d, t = turned(d, t, splat(turns_c[i + 1]), splat(turns_s[i + 1]))
        sums[i], sums[i + 1] = total(near), total(far)


@nb.njit(cache=True, nogil=True)
def zone_energies(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, heights: Any, odd_rows: bool, odd_columns: bool,
    rise: Any, across: Any, frequency: float, spacing: float,
) -> Any:  # fmt: skip
    """Sum over bins of |B|^2 in a zone and its mirror images: (mirror, elevation, azimuth) float64.

    mirror: 0 the zone itself, 1 at -az, 2 at -el, 3 both. pairs, bins, places, weight, heights, frequency, spacing: as
    for `lattice_kernel.lattice_energies`; delay (column, row, 4) s, of focusing, for the sensors of a place; rise
    (elevation, side of y, column) and across (elevation, azimuth): half of what a wave is sooner (s) at the next row
    up and at the next column to port.
    """
    columns, rows, _ = places.shape
    size = 2 * columns * rows * TERM
    focusing = np.empty(GROUPS * columns * rows * 8 * LANES, np.float32)
    folded = np.empty(GROUPS * size, np.float32)
    lines = np.empty(2 * GROUPS * columns * TERM, np.float32)
    elevations, azimuths = across.shape
    wide = azimuths + -azimuths % LANES
    steps, turns_c, turns_s = np.zeros(wide), np.empty(wide, np.float32), np.empty(wide, np.float32)
    sums = np.empty(azimuths + azimuths % 2, np.float32)
    energy = np.zeros((4, elevations, azimuths))
    for low in range(0, bins, CHUNK):
        groups = min(GROUPS, (bins - low) // LANES)
        first = frequency + low * spacing
        length = columns * rows * 8 * LANES
        for group in range(groups):
            _focusing(delay, first + group * LANES * spacing, spacing, focusing[group * length : (group + 1) * length])
        for mirror in range(4):
            for group in range(groups):
                at = folded[group * size : (group + 1) * size]
                turn = focusing[group * length : (group + 1) * length]
                _focus_and_fold(pairs, bins, places, weight, mirror, turn, low + group * LANES, at)
            for pair in range(0, elevations, 2):
                inner, outer = rise[pair], rise[min(pair + 1, elevations - 1)]
                _first_pass(folded, size, rows, heights, odd_rows, inner, outer, first, spacing, groups, lines)
                for which in range(min(2, elevations - pair)):
                    steps[:azimuths] = across[pair + which]
                    group_steps(steps, spacing, turns_c, turns_s)
                    _second_pass(
                        lines, which * GROUPS * columns * TERM, columns, odd_columns, steps, turns_c, turns_s, first,
                        spacing, groups, sums,
                    )  # fmt: skip
                    for i in range(azimuths):
                        energy[mirror, pair + which, i] += sums[i]
    return energy
