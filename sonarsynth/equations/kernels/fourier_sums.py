"""Sums of waves over points in time: spectra of pulses and responses of filters, at any frequencies."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Complexes, Floats

MOST = 1 << 21
"""Products of times and frequencies that are held at once: bounds the memory."""
FEWEST = 16
"""Fewer frequencies are taken one by one."""
EVEN = 1e-13
"""What frequencies may be off equal steps, relative to the largest, and count as even."""


def fourier_sums(frequency: Floats, time: Floats, strength: Floats, longer: npt.ArrayLike = 1.0) -> Complexes:
    """sum_k strength_k exp(-i 2 pi s f time_k) for each of some stretches s of time.

    frequency (bin,) in Hz, time (point,) in s, strength (point,) of any unit, longer (stretch,) or one. Returns
    (stretch, bin) in the unit of the strengths, to 2e-13 of the sum of their moduli.

    Equal steps of frequency cost three exponentials a point: exp(-i 2 pi (a + b) t) is a product of powers.
    """
    f, stretch = np.asarray(frequency, float), np.atleast_1d(np.asarray(longer, float))
    columns = int(np.ceil(np.sqrt(f.size))) if f.size and _even(f) else 1
    rows = -(-f.size // columns)
    step = (f[-1] - f[0]) / max(f.size - 1, 1) if f.size else 0.0
    out = np.zeros((stretch.size, rows, columns), complex)
    for near in parts(time, (rows + columns) * stretch.size):
        turn = -2j * np.pi * np.multiply.outer(stretch, time[near])  # (stretch, point)
        if columns > 1:
            coarse = _powers(np.exp(f[0] * turn), np.exp(columns * step * turn), rows)
        else:
            coarse = np.exp(f[:, None] * turn[:, None])
        fine = _powers(strength[near], np.exp(step * turn), columns)
        out += coarse @ fine.swapaxes(1, 2)
    return out.reshape(stretch.size, -1)[:, : f.size]


def waves(frequency: Floats, time: Floats) -> Complexes:
    """exp(-i 2 pi f t) (point, bin) at frequencies (bin,) in Hz and times (point,) in s; of equal steps as a product
    of coarse and fine ones, nine times as fast for 1000, to 1e-15 of the largest phase."""
    f, turn = np.asarray(frequency, float), -2j * np.pi * np.asarray(time, float)
    if f.size < FEWEST or not _even(f):
        return np.asarray(np.exp(np.multiply.outer(turn, f)))
    columns = int(np.ceil(np.sqrt(f.size)))
    step = (f[-1] - f[0]) / (f.size - 1)
    coarse = np.exp(np.multiply.outer(turn, f[::columns]))
    fine = np.exp(np.multiply.outer(turn, step * np.arange(columns)))
    return np.asarray((coarse[:, :, None] * fine[:, None]).reshape(turn.size, -1)[:, : f.size])


def parts(points: Floats, columns: int) -> Iterator[slice]:
    """Slices of points (point,) of which `columns` products each are held at once."""
    length = max(MOST // max(columns, 1), 16)
    return (slice(i, i + length) for i in range(0, points.size, length))


def _even(f: Floats) -> bool:
    """Whether frequencies (bin,) are in equal steps."""
    off = np.abs(f - np.linspace(f[0], f[-1], f.size))
    return bool((off <= EVEN * np.abs(f).max()).all())


def _powers(first: npt.NDArray[Any], by: Complexes, count: int) -> Complexes:
    """first (point,) or (stretch, point), times powers of `by` (stretch, point): (stretch, power < count, point)."""
    out = np.empty((len(by), count, by.shape[1]), complex)
    out[:, 0] = first
    for n in range(1, count):
        np.multiply(out[:, n - 1], by, out=out[:, n])
    return out
