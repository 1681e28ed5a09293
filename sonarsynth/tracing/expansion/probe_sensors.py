"""Probe sensors of an array, and the matrices from values there to the terms of `ArrayExpansion`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.kernels import probe_fits
from sonarsynth.equations.kernels.row_products import row_products
from sonarsynth.products import Paths
from sonarsynth.products.array_expansion import aperture_terms
from sonarsynth.receiver import Elements

HELD_OUT = 3
"""Probes that only measure the error of a fit; those that it is fitted to are as many and as three in ten more."""
BRANCH = 0.05
"""Largest misfit of a probe to the sphere, in travel times over the aperture: a path farther off is another branch."""


@dataclass(frozen=True, eq=False)
class Probes:
    """Sensors spread over the aperture, edge first, at which rays are traced exactly."""

    sensor: Ints  # (probe,) the fitted ones first
    position: Floats  # (probe, xyz) m, sonar frame
    fitted: int
    solve: Floats  # (term, fitted): values at the fitted probes to coefficients; the row of the constant term is 0
    basis: Floats  # (probe, term)
    aperture: float  # m
    monomials: tuple[int, ...]  # (term,) which of `aperture_terms` it is: those that do not vanish at all probes

    def expand(self, values: Floats) -> tuple[Floats, Floats]:
        """Terms (path, term) of `ArrayExpansion`, 0 at the centre, by least squares through values (path, probe), and
        the largest of what they miss these by (path,).

        Values that are NaN (no ray there) are left out, and inf is missed. A measurement at some places, those held out
        as well, not a bound: kinks of a profile within the aperture were seen to err twice as much between the probes.
        """
        terms, missed = probe_fits.fits(values, np.ascontiguousarray(self.solve.T), np.ascontiguousarray(self.basis.T))
        for i in np.flatnonzero(np.isinf(missed)):
            finite = np.flatnonzero(np.isfinite(values[i, : self.fitted]))
            terms[i, 1:] = np.linalg.lstsq(self.basis[finite, 1:], values[i, finite], rcond=1e-10)[0]
        return terms, missed


@lru_cache(maxsize=1024)
def probes(elements: Elements) -> Probes:
    """Probe sensors of an array for cubics: each the one farthest from those before it, from the
    element farthest out."""
    position = elements.position
    scale = elements.aperture or 1.0  # one element at the centre has no aperture, and no terms but 0
    rank = int(np.linalg.matrix_rank(aperture_terms(position, scale)[:, 1:]))
    wanted = int(np.ceil(1.3 * rank)) + HELD_OUT
    chosen = [int(np.argmax(np.linalg.norm(position, axis=1)))]
    nearest = np.full(len(position), np.inf)
    for _ in range(min(wanted, elements.count) - 1):
        nearest = np.minimum(nearest, np.linalg.norm(position - position[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(nearest)))
    sensor = np.array(chosen)
    fitted = max(len(sensor) - HELD_OUT, min(rank, len(sensor)), 1)
    basis = aperture_terms(position[sensor], scale)
    monomials = np.flatnonzero(basis.any(axis=0))
    basis = basis[:, monomials]
    solve = np.vstack([np.zeros(fitted), np.linalg.pinv(basis[:fitted, 1:], rcond=1e-10)])
    return Probes(sensor, position[sensor], fitted, solve, basis, scale, tuple(monomials.tolist()))


def sphere(direction: Floats, radius: Floats, position: Floats) -> Floats:
    """Distance (path, probe) from the centre of the reference sphere R d to a position q, less R, without cancellation.

    |R d - q| - R = (q.q - 2 R d.q)/(|R d - q| + R).
    """
    source = radius[:, None] * direction
    square = (position * position).sum(axis=1) - row_products(2.0 * source, position.T)
    return np.asarray(square / (np.sqrt(radius[:, None] ** 2 + square) + radius[:, None]))


def pick_branch(paths: Paths, predicted: Floats, tolerance: float, allowed: Bools) -> Ints:
    """Index (row, probe) of the path nearest in time to predicted (row, probe); -1 where none is within tolerance (s).

    Pair n of paths is row n // probes, probe n % probes; allowed: (path,) which count.
    """
    best = np.full(predicted.size, -1)
    wanted = np.abs(paths.travel_time - predicted.ravel()[paths.pair])
    order = np.flatnonzero((wanted <= tolerance) & allowed)
    if (np.diff(paths.pair) == 0).any():
        order = order[np.argsort(-wanted[order], kind="stable")]  # the nearest is written last, and stays
    best[paths.pair[order]] = order
    return best.reshape(predicted.shape)
