"""Low rank: how many nodes over the aperture, and how many terms of directivity and absorption, a group of paths needs.

A tile is a group of paths from nearly the same direction. Steered to its middle, their field varies slowly over the
aperture, so it is synthesised at a few Chebyshev nodes and interpolated to the hydrophones; and the directivity of the
element face, a function of frequency and of the direction of each path, is a polynomial in the small deviation of that
direction from the tile's middle. Where pulses differ in shape there are terms for each mode of it (`shapes`).
"""

from __future__ import annotations

from functools import lru_cache, reduce
from math import factorial

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.signals.gridded.nodes import SpectralQuantiles, analysis, chebyshev, rounded_up


def spectral_quantiles(frequency: Floats, spectrum: np.ndarray, highest: float) -> SpectralQuantiles:
    """Quantiles of the modulus of a spectrum over frequency, over `highest` (Hz), rounded up to a twentieth: over 0,
    also of one of which blur leaves next to nothing but its 0 Hz."""
    mass = np.cumsum(np.abs(spectrum))
    quantiles = np.interp((np.arange(8) + 0.5) / 8.0, mass / mass[-1], frequency / highest)
    return tuple(max(float(np.ceil(20.0 * v - 1e-6)), 1.0) / 20.0 for v in quantiles)


DEGREES = np.arange(13)
FACTORIALS = np.array([float(factorial(n)) for n in DEGREES])


@lru_cache(maxsize=512)
def face_terms(deviation: float, weights: SpectralQuantiles) -> Floats:
    """Bounds (degree,) on the terms of sinc(a + x), |x| <= `deviation` at the highest frequency, by the spectrum.

    The Chebyshev coefficient of exp(2 pi i x s), |s| <= 1/2, is 2 J_n(2 pi x s) <= 2 (pi x s)^n/n!, and its mean over s
    is taken.
    """
    bound = 2.0 * (0.5 * np.pi * deviation) ** DEGREES / (FACTORIALS * (DEGREES + 1))
    bound[0] = 1.0
    return np.asarray(bound * (np.array(weights)[:, None] ** DEGREES).mean(axis=0))


Term = tuple[int, int, int, int]
"""Degrees in the y and z components of direction, and in absorption; and which mode of the pulses' shapes."""

PLAIN: tuple[float, ...] = (1.0,)
"""Sizes of the modes of pulses that are alike."""


def terms_for(
    face: tuple[float, float],
    loss: float,
    weights: SpectralQuantiles,
    tolerance: float,
    modes: tuple[float, ...],
) -> tuple[Term, ...]:
    """Terms to keep: deviations of face argument in y and z, of absorption (Np), and sizes of modes are given. Closed:
    the factors of each are there.

    Deviations are rounded up by at most a tenth, so that choices are kept from frame to frame.
    """
    y, z, decay = (rounded_up(v) for v in (*face, loss))
    return _terms(y, z, decay, modes, weights, tolerance)


@lru_cache(maxsize=1024)
def _terms(
    y: float, z: float, loss: float, modes: tuple[float, ...], weights: SpectralQuantiles, tolerance: float
) -> tuple[Term, ...]:
    sizes = [face_terms(y, weights), face_terms(z, weights), loss**DEGREES / FACTORIALS, np.array(modes)]
    if len(modes) > 1:  # the product of four is large: without what is nothing
        sizes = [s[: np.flatnonzero(s >= 1e-3 * tolerance)[-1] + 1] for s in sizes]
    size = reduce(np.multiply.outer, sizes)
    smallest = np.sort(size, axis=None)
    least = smallest[np.searchsorted(np.cumsum(smallest), tolerance, side="right")]  # what is left out adds up to less
    keep = (size >= least) & (np.indices(size.shape)[:3].sum(axis=0) < DEGREES.size)
    keep.flat[0] = True
    for axis in range(4):  # the factors of each term too
        keep = np.flip(np.logical_or.accumulate(np.flip(keep, axis), axis), axis)
    terms = [(int(a), int(b), int(c), int(d)) for a, b, c, d in np.argwhere(keep)]
    return tuple(sorted(terms, key=lambda t: (sum(t), t)))


@lru_cache(maxsize=256)
def face_pairs(terms: tuple[Term, ...]) -> tuple[np.ndarray, np.ndarray]:
    """The different pairs (pair, 2) of degrees in y and z, and which of them each term (term,) has."""
    pairs = list(dict.fromkeys(term[:2] for term in terms))
    return np.array(pairs), np.array([pairs.index(term[:2]) for term in terms])


@lru_cache(maxsize=256)
def term_products(terms: tuple[Term, ...]) -> np.ndarray:
    """How to make each term from earlier ones (term, 3); -1 is given, the amplitude.

    Columns: which term; times which factor (0 y, 1 z, 2 absorption, 3 and on the modes); and, where it is twice that
    less another (Chebyshev's recurrence, in y and z), which other, or else -1.
    """
    index: dict[tuple[int, ...], int] = {t: n for n, t in enumerate(terms)}
    out = np.full((len(terms), 3), -1, np.int64)
    for n, term in enumerate(terms):
        axis = next((a for a in range(3) if term[a]), 3)
        if axis == 3:
            out[n, 1] = 3 + term[3]
            continue
        previous, before = (tuple(d - less * (a == axis) for a, d in enumerate(term)) for less in (1, 2))
        out[n, :2] = index[previous], axis
        if axis < 2 and term[axis] > 1:
            out[n, 2] = index[before]
    return out


def sinc_polynomials(middle: Floats, deviation: float | Floats, degree: int) -> Floats:
    """Chebyshev coefficients (degree + 1, ...) in x, |x| <= 1, of sinc(middle + deviation x).

    middle (...) and deviation broadcast together. Interpolated at Chebyshev nodes: no derivatives of sinc, so nothing
    is lost near its centre.
    """
    value = np.sinc(middle + np.multiply.outer(chebyshev(degree + 1), deviation * np.ones_like(middle)))
    return np.asarray(analysis(degree + 1) @ value.reshape(degree + 1, -1)).reshape(value.shape)
