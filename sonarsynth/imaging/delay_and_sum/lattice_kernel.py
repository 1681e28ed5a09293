"""Images and single beams of a lattice: the compiled kernels, of the sums in `lattice_sums`."""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.equations.kernels.lanes import LANES, load, splat, store, store_complex, total
from sonarsynth.equations.kernels.phasors import CHUNK, GROUPS, ZERO, phasors, turned
from sonarsynth.imaging.delay_and_sum.lattice_sums import (
    TERM,
    focus,
    group_turns,
    groups_on,
    sums_over_rows,
    term_sums,
    upper,
)

BEAM = 4 * GROUPS * LANES
"""float32 numbers of a beam of both sets: two complex numbers for each frequency of a chunk."""


@compiled(forceinline=True)
def _add_turned(beams: Any, at: int, sums: Any, c: Any, s: Any, sign: Any) -> None:
    x, y, p, q = upper(sums)
    x, y = turned(x, y, c, s)
    p, q = turned(p, q, c, splat(sign) * s)
    store(beams, at, load(beams, at) + x)
    store(beams, at + LANES, load(beams, at + LANES) + y)
    store(beams, at + 2 * LANES, load(beams, at + 2 * LANES) + p)
    store(beams, at + 3 * LANES, load(beams, at + 3 * LANES) + q)


@compiled(forceinline=True)
def _add_beams(
    lines: Any, start: int, columns: int, odd: bool, across: Any, turns: Any, middle: Any, steps: Any, at: int,
    stop: int, sign: Any, frequency: float, spacing: float, groups: int, beams: Any, first_beam: int,
) -> None:  # fmt: skip
    """Add a subarray to the beams of one elevation: half steps `across` and delays `middle` (s) are at[at:stop]; those
    of the second set are `sign` times so late."""
    for i in range(at, stop, 2):
        j = min(i + 1, stop - 1)
        c, s = phasors(across[i], frequency, spacing)
        d, t = phasors(across[j], frequency, spacing)
        e, u = phasors(middle[i], frequency, spacing)
        f, v = phasors(middle[j], frequency, spacing)
        for group in range(groups):
            first = start + group * columns * TERM
            near, far = term_sums(lines, first, first + columns * TERM, odd, c, s, d, t)
            beam = (first_beam + i - at) * BEAM + group * 4 * LANES
            _add_turned(beams, beam, near, e, u, sign)
            if j > i:
                _add_turned(beams, beam + BEAM, far, f, v, sign)
            c, s = groups_on(c, s, turns, i)
            d, t = groups_on(d, t, turns, j)
            e, u = groups_on(e, u, steps, i)
            f, v = groups_on(f, v, steps, j)


@compiled(forceinline=True)
def _with_powers(powers: Any, x: Any, y: Any, p: Any, q: Any) -> Any:
    """|B|^2 added, of both sets."""
    return powers[0] + x * x + y * y, powers[1] + p * p + q * q


@compiled(forceinline=True)
def _put_powers(energy: Any, mirror: int, other: int, row: int, column: int, powers: Any) -> None:
    energy[mirror, row, column] += total(powers[0])
    energy[other, row, column] += total(powers[1])


@compiled(forceinline=True)
def _add_powers(
    lines: Any, start: int, columns: int, odd: bool, across: Any, turns: Any, at: int, frequency: float, spacing: float,
    groups: int, energy: Any, row: int,
) -> None:  # fmt: skip
    """Add |B|^2 of the beams of one elevation and of their mirror images, of an array that is its only subarray: half
    steps from `at` on."""
    azimuths, size, none = energy.shape[2], columns * TERM, (splat(ZERO), splat(ZERO))
    for i in range(0, azimuths, 2):
        j = min(i + 1, azimuths - 1)
        c, s = phasors(across[at + i], frequency, spacing)
        d, t = phasors(across[at + j], frequency, spacing)
        near, far, near_down, far_down = none, none, none, none
        for group in range(groups):
            first = start + group * size
            inner, outer = term_sums(lines, first, first + size, odd, c, s, d, t)
            near, far = _with_powers(near, *upper(inner)), _with_powers(far, *upper(outer))
            first += GROUPS * size
            inner, outer = term_sums(lines, first, first + size, odd, c, s, d, t)
            near_down, far_down = _with_powers(near_down, *upper(inner)), _with_powers(far_down, *upper(outer))
            c, s = groups_on(c, s, turns, at + i)
            d, t = groups_on(d, t, turns, at + j)
        _put_powers(energy, 0, 1, row, i, near)
        _put_powers(energy, 2, 3, row, i, near_down)
        if j > i:
            _put_powers(energy, 0, 1, row, j, far)
            _put_powers(energy, 2, 3, row, j, far_down)


@compiled(forceinline=True)
def _add_powers_of_beams(beams: Any, groups: int, energy: Any, mirror: int) -> None:
    """Add |B|^2 (elevation, azimuth) of a chunk, and of the mirror images along z."""
    _, elevations, azimuths = energy.shape
    for i in range(elevations):
        for j in range(azimuths):
            powers = splat(ZERO), splat(ZERO)
            for group in range(groups):
                at = (i * azimuths + j) * BEAM + group * 4 * LANES
                x, y = load(beams, at), load(beams, at + LANES)
                powers = _with_powers(powers, x, y, load(beams, at + 2 * LANES), load(beams, at + 3 * LANES))
            _put_powers(energy, mirror, mirror + 2, i, j, powers)


@compiled
def lattice_energies(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, heights: Any, odd_rows: bool, odd_columns: bool,
    rise: Any, across: Any, middle: Any, frequency: float, spacing: float,
) -> Any:  # fmt: skip
    """Sum over bins of |B|^2 in a quadrant, or a part of it, and its mirror images: (mirror, elevation, azimuth).

    mirror: 0 the quadrant above and to port, 1 at -az, 2 at -el, 3 both. pairs: spectra (sensor + 1, bins) as float32
    pairs, bins a multiple of LANES, the last sensor silent; places (mirror, subarray, column, row, 4), from the middle
    of a subarray outwards: sensors at (+z, +y), (+z, -y), (-z, +y), (-z, -y), the silent one for none;
    weight (sensor + 1,) float32; delay (subarray, column, row, side of y) s, of focusing; heights (subarray, column)
    rows in use; rise (elevation, subarray, side of y, column) and across (subarray, elevation, azimuth): half of what a
    wave is sooner (s) at the next row up and at the next column to port; middle (subarray, elevation, azimuth): what it
    is later (s) in the middle of the subarray; frequency, spacing: of bin 0 and between bins (Hz).
    """
    _, count, columns, rows, _ = places.shape
    _, elevations, azimuths = across.shape
    size = 2 * columns * rows * TERM
    folded, lines = np.empty(GROUPS * size, np.float32), np.empty(4 * GROUPS * columns * TERM, np.float32)
    beams = np.empty(elevations * azimuths * BEAM if count > 1 else 0, np.float32)
    up, port, later = group_turns(rise, spacing), group_turns(across, spacing), group_turns(middle, spacing)
    rise, across, middle = rise.ravel(), across.ravel(), middle.ravel()
    delays, energy = np.stack((delay, delay)), np.zeros((4, elevations, azimuths))
    for mirror in range(min(count, 2)):  # sets are mirror images along z; along y of one array, which is folded along z
        sets = np.stack((places[mirror], places[mirror + 2 if count > 1 else 1]))
        for low in range(0, bins, CHUNK):
            groups, first = min(GROUPS, (bins - low) // LANES), frequency + low * spacing
            beams[:] = ZERO
            for part in range(count):
                for group in range(groups):
                    at = low + group * LANES
                    focus(
                        pairs, bins, at, sets[:, part], weight, delays[:, part],
                        frequency + at * spacing, spacing, folded[group * size :],
                    )  # fmt: skip
                for row in range(0, elevations, 2):
                    inner = (row * count + part) * 2 * columns
                    outer = (min(row + 1, elevations - 1) * count + part) * 2 * columns
                    sums_over_rows(
                        folded, rows, heights[part], odd_rows, rise, up, inner, outer, first, spacing, groups, lines,
                        count == 1,
                    )  # fmt: skip
                    for which in range(min(2, elevations - row)):
                        start, at = 2 * which * GROUPS * columns * TERM, (part * elevations + row + which) * azimuths
                        if count > 1:
                            _add_beams(
                                lines, start, columns, odd_columns, across, port, middle, later, at, at + azimuths,
                                np.float32(1.0), first, spacing, groups, beams, (row + which) * azimuths,
                            )  # fmt: skip
                        else:
                            _add_powers(
                                lines, start, columns, odd_columns, across, port, at, first, spacing, groups, energy,
                                row + which,
                            )  # fmt: skip
            if count > 1:
                _add_powers_of_beams(beams, groups, energy, mirror)
    return energy


@compiled
def focused_halves(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, frequency: float, spacing: float
) -> Any:
    """What `lattice_beams` steers, float32: an array, focused and folded for each group of frequencies, whose halves,
    to port and to starboard, are the two sets. As for `lattice_energies`; places (half, column, row, 4)."""
    _, columns, rows, _ = places.shape
    size = 2 * columns * rows * TERM
    folded = np.empty(bins // LANES * size, np.float32)
    for low in range(0, bins, LANES):
        into = folded[low // LANES * size :]
        focus(pairs, bins, low, places, weight, delay, frequency + low * spacing, spacing, into)
    return folded


@compiled
def lattice_beams(
    folded: Any, bins: int, rows: int, heights: Any, odd_rows: bool, odd_columns: bool, rise: Any, bounds: Any,
    across: Any, middle: Any, frequency: float, spacing: float, row: Any, spectra: Any,
) -> None:  # fmt: skip
    """Spectra of beams of an array in two halves, `focused_halves`: (row, bin) float32 pairs, of no more bins.

    As `lattice_energies`, with heights (column,) of the rows of a half; rise (level, side of y, column) of beams
    across[bounds[2 * level] : bounds[2 * level + 1]], and of those as far down, which end at bounds[2 * level + 2];
    middle (beam,): what a wave is later in the middle of the half to port, and sooner in the other; row (beam,): where
    the spectrum of a beam is put.
    """
    columns, levels = len(heights), len(rise)
    size, lines = 2 * columns * rows * TERM, np.empty(4 * GROUPS * columns * TERM, np.float32)
    beams, last = np.empty(np.max(np.diff(bounds)) * BEAM, np.float32), np.empty(2 * LANES, np.float32)
    up, port, later = group_turns(rise, spacing), group_turns(across, spacing), group_turns(middle, spacing)
    rise, count = rise.ravel(), spectra.size // (2 * len(row))
    for low in range(0, bins, CHUNK):
        groups, first = min(GROUPS, (bins - low) // LANES), frequency + low * spacing
        chunk = folded[low // LANES * size :]
        for level in range(0, levels, 2):
            inner, outer = level * 2 * columns, min(level + 1, levels - 1) * 2 * columns
            sums_over_rows(chunk, rows, heights, odd_rows, rise, up, inner, outer, first, spacing, groups, lines, True)
            for side in range(2 * min(2, levels - level)):
                start, at, stop = side * GROUPS * columns * TERM, bounds[2 * level + side], bounds[2 * level + side + 1]
                beams[: (stop - at) * BEAM] = ZERO
                _add_beams(
                    lines, start, columns, odd_columns, across, port, middle, later, at, stop, np.float32(-1.0), first,
                    spacing, groups, beams, 0,
                )  # fmt: skip
                for beam in range(at, stop):
                    for group in range(groups):
                        i = (beam - at) * BEAM + group * 4 * LANES
                        x, y = (
                            load(beams, i) + load(beams, i + 2 * LANES),
                            load(beams, i + LANES) + load(beams, i + 3 * LANES),
                        )
                        into, left = 2 * (row[beam] * count + low + group * LANES), count - low - group * LANES
                        if left >= LANES:
                            store_complex(spectra, into, x, y)
                        else:
                            store_complex(last, 0, x, y)
                            spectra[into : into + 2 * left] = last[: 2 * left]
