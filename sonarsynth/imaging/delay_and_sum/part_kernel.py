"""Energies of beams of a lattice that is cut into parts, each focused and steered for every beam: the compiled kernel.

Within a part the delay of focusing is nearly that at one direction, plus a slope along z in each column and one along y
for each beam; what is left of it falls as the square of the part. Beams are sums over parts, each turned by its delay.

The four mirrored quadrants share the delays, not the sums: the beam at (-el, az) hears the array as that at (+el, az)
hears its mirror image. With X focused, S and D the sums and differences of sensors at +-z from the middle of their
part, s and d those of columns at +-y,

    L(y) = sum_m [cos((m + o) t_y) S - i sin((m + o) t_y) D]_m,
    B(el, az) = sum_parts e^(i p) sum_n [cos((n + o) t) s - i sin((n + o) t) d]_n,

t_y and t the phases of what a wave is sooner at the next row of column y, and at the next column to port.
Recurrences, lanes and chunks are those of `lattice_kernel`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.lanes import LANES, load, splat, store, total
from sonarsynth.equations.kernels.phasors import CHUNK, GROUPS, ZERO, group_steps, phasors, turned, weighted
from sonarsynth.imaging.delay_and_sum.lattice_kernel import seeds

TERM = 4 * LANES
"""float32 numbers of one term of a sum: two complex numbers (sum and difference of a pair) of sixteen frequencies."""

BEAM = 2 * GROUPS * LANES
"""float32 numbers of a beam: a complex number for each frequency of a chunk."""


@compiled(forceinline=True)
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


@compiled(forceinline=True)
def _store_pair(terms: Any, at: int, above: Any, below: Any) -> None:
    store(terms, at, above[0] + below[0])
    store(terms, at + LANES, above[1] + below[1])
    store(terms, at + 2 * LANES, above[0] - below[0])
    store(terms, at + 3 * LANES, above[1] - below[1])


@compiled(forceinline=True)
def _focused(pairs: Any, at: int, weight: float, delay: float, frequency: float, spacing: float) -> Any:
    x, y = weighted(pairs, at, weight)
    c, s = phasors(delay, frequency, spacing)
    return turned(x, y, c, s)


@compiled
def _focus_and_fold(
    pairs: Any, bins: int, low: int, places: Any, weight: Any, delay: Any, frequency: float, spacing: float,
    groups: int, folded: Any,
) -> None:  # fmt: skip
    """Fill `folded` [group][side of y][column][row][S D] of a part for the chunk from bin `low` on."""
    columns, rows, _ = places.shape
    for group in range(groups):
        first, at = low + group * LANES, frequency + (low + group * LANES) * spacing
        for n in range(columns):
            for m in range(rows):
                for side in range(2):
                    up, down = places[n, m, side], places[n, m, side + 2]
                    above = _focused(pairs, 2 * (up * bins + first), weight[up], delay[n, m, side], at, spacing)
                    below = _focused(pairs, 2 * (down * bins + first), weight[down], delay[n, m, side + 2], at, spacing)
                    _store_pair(folded, (((group * 2 + side) * columns + n) * rows + m) * TERM, above, below)


@compiled
def _group_turns(delays: Any, spacing: float) -> Any:
    """Cosines and sines (float32, flat) of 2 pi delay * 16 spacing: one group of frequencies on."""
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


@compiled
def _first_pass(
    folded: Any, rows: int, heights: Any, odd: bool, rise: Any, turns: Any, inner: int, outer: int, frequency: float,
    spacing: float, groups: int, lines: Any,
) -> None:  # fmt: skip
    """Sums over rows at two elevations, whose half steps `rise` (s) [side][column], and turns, are from `inner` and
    `outer` on: lines [two][group][column][s d]."""
    columns = len(heights)
    for n in range(columns):
        for side in range(2):
            i, j = inner + side * columns + n, outer + side * columns + n
            c, s = phasors(rise[i], frequency, spacing)
            d, t = phasors(rise[j], frequency, spacing)
            for group in range(groups):
                start = ((group * 2 + side) * columns + n) * rows * TERM
                upper, lower = _sums(folded, start, start + heights[n] * TERM, odd, c, s, d, t)
                c, s = turned(c, s, splat(turns[0][i]), splat(turns[1][i]))
                d, t = turned(d, t, splat(turns[0][j]), splat(turns[1][j]))
                _put_side(lines, (group * columns + n) * TERM, side, upper)
                _put_side(lines, ((GROUPS + group) * columns + n) * TERM, side, lower)


@compiled(forceinline=True)
def _put_side(lines: Any, at: int, side: int, line: Any) -> None:
    """The line at +y, then its sum and difference with that at -y."""
    if side == 0:
        store(lines, at, line[0])
        store(lines, at + LANES, line[1])
    else:
        _store_pair(lines, at, (load(lines, at), load(lines, at + LANES)), line)


@compiled(forceinline=True)
def _add_turned(beams: Any, at: int, beam: Any, c: Any, s: Any) -> None:
    x, y = turned(beam[0], beam[1], c, s)
    store(beams, at, load(beams, at) + x)
    store(beams, at + LANES, load(beams, at + LANES) + y)


@compiled
def _second_pass(
    lines: Any, start: int, columns: int, odd: bool, across: Any, steps: Any, middle: Any, turns: Any, at: int,
    azimuths: int, frequency: float, spacing: float, groups: int, beams: Any, row: int,
) -> None:  # fmt: skip
    """Add a part to the beams of one elevation: half steps `across` and delays `middle` (s) are from `at` on."""
    for i in range(at, at + azimuths, 2):
        j = min(i + 1, at + azimuths - 1)
        c, s = phasors(across[i], frequency, spacing)
        d, t = phasors(across[j], frequency, spacing)
        e, u = phasors(middle[i], frequency, spacing)
        f, v = phasors(middle[j], frequency, spacing)
        for group in range(groups):
            first = start + group * columns * TERM
            near, far = _sums(lines, first, first + columns * TERM, odd, c, s, d, t)
            beam = (row + i - at) * BEAM + group * 2 * LANES
            _add_turned(beams, beam, near, e, u)
            if j > i:
                _add_turned(beams, beam + BEAM, far, f, v)
            c, s = turned(c, s, splat(steps[0][i]), splat(steps[1][i]))
            d, t = turned(d, t, splat(steps[0][j]), splat(steps[1][j]))
            e, u = turned(e, u, splat(turns[0][i]), splat(turns[1][i]))
            f, v = turned(f, v, splat(turns[0][j]), splat(turns[1][j]))


@compiled
def _add_energies(beams: Any, groups: int, energy: Any) -> None:
    """Add |B|^2 (elevation, azimuth) of a chunk."""
    elevations, azimuths = energy.shape
    for i in range(elevations):
        for j in range(azimuths):
            power = splat(ZERO)
            for group in range(groups):
                at = (i * azimuths + j) * BEAM + group * 2 * LANES
                x, y = load(beams, at), load(beams, at + LANES)
                power = power + x * x + y * y
            energy[i, j] += total(power)


@compiled
def part_energies(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, heights: Any, odd_rows: bool, odd_columns: bool,
    rise: Any, across: Any, middle: Any, frequency: float, spacing: float,
) -> Any:  # fmt: skip
    """Sum over bins of |B|^2 in a quadrant, or a part of it, and its mirror images: (mirror, elevation, azimuth).

    mirror: 0 the zone itself, 1 at -az, 2 at -el, 3 both. pairs, bins, weight, frequency, spacing: as for
    `lattice_kernel.lattice_energies`; places (mirror, part, column, row, 4): sensors of a part about its middle;
    delay (part, column, row, 4) s, of focusing; heights (part, column) rows in use; rise (elevation, part, side of y,
    column) and across (part, elevation, azimuth): half of what a wave is sooner (s) at the next row up and at the next
    column to port; middle (part, elevation, azimuth): what it is later (s) in the middle of the part.
    """
    _, parts, columns, rows, _ = places.shape
    folded = np.empty(GROUPS * 2 * columns * rows * TERM, np.float32)
    lines = np.empty(2 * GROUPS * columns * TERM, np.float32)
    _, elevations, azimuths = across.shape
    beams = np.empty(elevations * azimuths * BEAM, np.float32)
    up, port, later = _group_turns(rise, spacing), _group_turns(across, spacing), _group_turns(middle, spacing)
    rise, across, middle = rise.ravel(), across.ravel(), middle.ravel()
    energy = np.zeros((4, elevations, azimuths))
    for mirror in range(4):
        for low in range(0, bins, CHUNK):
            groups, first = min(GROUPS, (bins - low) // LANES), frequency + low * spacing
            beams[:] = ZERO
            for part in range(parts):
                _focus_and_fold(
                    pairs, bins, low, places[mirror, part], weight, delay[part], frequency, spacing, groups, folded
                )
                for row in range(0, elevations, 2):
                    inner = (row * parts + part) * 2 * columns
                    outer = (min(row + 1, elevations - 1) * parts + part) * 2 * columns
                    _first_pass(
                        folded, rows, heights[part], odd_rows, rise, up, inner, outer, first, spacing, groups, lines
                    )
                    for which in range(min(2, elevations - row)):
                        _second_pass(
                            lines, which * GROUPS * columns * TERM, columns, odd_columns, across, port, middle, later,
                            (part * elevations + row + which) * azimuths, azimuths, first, spacing, groups, beams,
                            (row + which) * azimuths,
                        )  # fmt: skip
            _add_energies(beams, groups, energy[mirror])
    return energy
