"""Spectra of a few beams of a lattice, focused on its axis: compiled, and separable as the whole image is.

Folded along both axes, with sensors at y = +-(n + o) d, z = +-(m + o) d (o = 1/2 for an even number, 0 for an odd) and
a = 2 pi f d u_z/c, b = 2 pi f d u_y/c,

    B = sum_n [cos((n + o) b) (L+ + L-) - i sin((n + o) b) (L+ - L-)]_n    of columns at +-y, and each of them
    L = sum_m [cos((m + o) a) (X+ + X-) - i sin((m + o) a) (X+ - X-)]_m    of sensors at +-z.

The second sum is the same for all beams of one elevation, and is taken once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.kernels.lanes import LANES, load, splat, store, store_complex
from sonarsynth.equations.kernels.phasors import ZERO, Spectra, padded_bins, phasors, turned, weighted

TERM = 4 * LANES
"""float32 numbers of one term of a sum: two complex numbers (sum and difference of a pair) of sixteen frequencies."""


@compiled(forceinline=True)
def _store_pair(terms: Any, start: int, x: Any, y: Any, p: Any, q: Any) -> None:
    store(terms, start, x + p)
    store(terms, start + LANES, y + q)
    store(terms, start + 2 * LANES, x - p)
    store(terms, start + 3 * LANES, y - q)


@compiled(forceinline=True)
def _sum(terms: Any, start: int, stop: int, c: Any, s: Any, by_c: Any, by_s: Any) -> Any:
    """Sum of cosine times sums plus i sine times differences, the phasor (c, s) turned on by another every term."""
    x = y = splat(ZERO)
    for at in range(start, stop, TERM):
        x = x + c * load(terms, at) - s * load(terms, at + 3 * LANES)
        y = y + c * load(terms, at + LANES) + s * load(terms, at + 2 * LANES)
        c, s = turned(c, s, by_c, by_s)
    return x, y


@compiled
def _focus_and_fold(
    pairs: Any, bins: int, low: int, places: Any, weight: Any, delay: Any, frequency: float, spacing: float, terms: Any
) -> None:
    """Fill terms [side of y][column][row][sum, difference] for the sixteen frequencies from bin `low` on."""
    columns, rows, _ = places.shape
    for n in range(columns):
        for m in range(rows):
            c, s = phasors(delay[n, m], frequency + low * spacing, spacing)
            for half in range(2):
                up, down = places[n, m, half], places[n, m, 2 + half]
                x, y = weighted(pairs, 2 * (up * bins + low), weight[up])
                p, q = weighted(pairs, 2 * (down * bins + low), weight[down])
                x, y = turned(x, y, c, s)
                p, q = turned(p, q, c, s)
                _store_pair(terms, ((half * columns + n) * rows + m) * TERM, x, y, p, q)


@compiled
def _lattice_sums(
    pairs: Any, bins: int, places: Any, weight: Any, delay: Any, rise: Any, across: Any, bounds: Any, odd_rows: bool,
    odd_columns: bool, frequency: float, spacing: float, beams: Any,
) -> None:  # fmt: skip
    columns, rows, _ = places.shape
    terms = np.empty(2 * columns * rows * TERM, np.float32)
    line = np.empty(columns * TERM, np.float32)
    first_row, first_column = (0.0 if odd_rows else 0.5), (0.0 if odd_columns else 0.5)
    for low in range(0, bins, LANES):
        first_frequency = frequency + low * spacing
        _focus_and_fold(pairs, bins, low, places, weight, delay, frequency, spacing, terms)
        for i in range(len(rise)):
            c, s = phasors(first_row * rise[i], first_frequency, spacing)
            by_c, by_s = phasors(rise[i], first_frequency, spacing)
            for n in range(columns):
                start, mirrored = n * rows * TERM, (columns + n) * rows * TERM
                x, y = _sum(terms, start, start + rows * TERM, c, s, by_c, by_s)
                p, q = _sum(terms, mirrored, mirrored + rows * TERM, c, s, by_c, by_s)
                _store_pair(line, n * TERM, x, y, p, q)
            for beam in range(bounds[i], bounds[i + 1]):
                c, s = phasors(first_column * across[beam], first_frequency, spacing)
                by_c, by_s = phasors(across[beam], first_frequency, spacing)
                x, y = _sum(line, 0, columns * TERM, c, s, by_c, by_s)
                store_complex(beams, 2 * (beam * bins + low), x, y)


def lattice_sums(
    spectra: Spectra,
    places: Ints,
    weight: Floats,
    delay: Floats,
    rise: Floats,
    across: Floats,
    *,
    odd: tuple[bool, bool],
    frequency: float,
    spacing: float,
) -> Spectra:
    """Sum over sensors of weight * spectra * exp(+i 2 pi f (delay + that of the plane wave)): (beam, bin) complex64.

    spectra (sensor, bin) at f = frequency + spacing * bin (Hz); places as by `lattices.mirrored_sensors`, with as many
    as there are sensors for nobody; weight (sensor,); delay (half column, half row) s. rise, across (beam,): what a
    plane wave is later (s) at the next row up and at the next column to port. odd: whether rows, and columns, are an
    odd number.
    """
    sensors, bins = spectra.shape
    padded = padded_bins(spectra, sensors + 1, LANES)
    order = np.argsort(rise, kind="stable")
    levels, first = np.unique(rise[order], return_index=True)
    beams = np.empty((len(rise), padded.shape[1]), np.complex64)
    _lattice_sums(
        padded.view(np.float32).ravel(),
        padded.shape[1],
        places,
        np.append(weight, 0.0).astype(np.float32),
        delay,
        levels,
        across[order],
        np.append(first, len(rise)),
        *odd,
        frequency,
        spacing,
        beams.view(np.float32).ravel(),
    )
    sums = np.empty((len(rise), bins), np.complex64)
    sums[order] = beams[:, :bins]
    return sums
