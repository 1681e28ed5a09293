"""The array expansion: what paths have at every sensor of an array, beside what they have at its middle."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import Columns
from sonarsynth.conventions import Bools, Floats, Ints

QUANTITIES = ("delay", "amplitude", "phase", "delay_variance")
"""What varies over the aperture."""
FIRST_OF_DEGREE = (0, 1, 4, 10, 20, 35)
"""Of `aperture_terms`, the first of each degree."""
EVERY = tuple(range(56))
"""Of `aperture_terms`, those up to the fifth degree."""


def aperture_terms(position: npt.ArrayLike, aperture: float, terms: int = 20) -> Floats:
    """Polynomials over the aperture (..., term) at positions (..., xyz) in the sonar frame.

    Coordinates are divided by `aperture` (m). The basis is the monomials of x, y, z, degree by degree: 1; x, y, z; xx,
    xy, xz, yy, yz, zz; xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz; and so on. So many of them: 20 are those up to
    the third degree, 56 up to the fifth. On a planar array those with x vanish.
    """
    axes = np.moveaxis(np.asarray(position, float) / aperture, -1, 0)
    monomials = [np.ones_like(axes[0])]
    degree = list(enumerate(axes))  # the last axis of each monomial, and its value
    while len(monomials) < terms:
        monomials += [value for _, value in degree]
        degree = [(axis, value * axes[axis]) for last, value in degree for axis in range(last, 3)]
    return np.stack(monomials[:terms], axis=-1)


def monomials_at(position: Floats, aperture: float, monomials: tuple[int, ...]) -> Floats:
    """Some of `aperture_terms`, in order, at positions (point, xyz) that are asked for in every frame: hydrophones,
    nodes between them."""
    return _kept_terms(position.tobytes(), aperture, monomials)


@lru_cache(maxsize=256)
def _kept_terms(position: bytes, aperture: float, monomials: tuple[int, ...]) -> Floats:
    places = np.frombuffer(position).reshape(-1, 3)
    polynomials = aperture_terms(places, aperture, monomials[-1] + 1)[:, list(monomials)]
    polynomials.setflags(write=False)
    return polynomials


@lru_cache(maxsize=256)
def _kept_gradient(position: bytes, aperture: float, monomials: tuple[int, ...]) -> Floats:
    places, step = np.frombuffer(position).reshape(-1, 3), 1e-4 * aperture
    sides = places + step * np.array([1.0, -1.0])[:, None, None, None] * np.eye(3)[:, None]  # (side, axis, point, xyz)
    ahead, behind = aperture_terms(sides, aperture, max(monomials, default=0) + 1)[..., list(monomials)]
    gradient = np.asarray((ahead - behind) / (2.0 * step))
    gradient.setflags(write=False)
    return gradient


@dataclass(frozen=True, eq=False)
class ArrayExpansion(Columns):
    """Paths over an aperture: polynomials through values at probe sensors, and one matrix from there to all sensors.

    Terms belong to the polynomials b(q) of a place q in the sonar frame (`aperture_terms`) that do not vanish at every
    sensor, the first to 1; a quantity of which all sensors have what the middle has, has none, and one of a low degree
    only the first. About a path with a delay tau and an amplitude A at the middle, from the direction d and R away:

    delay           (path, term)  s    beside the sphere's: tau(q) = tau + (|R d - q| - R)/c + delay b(q)
    amplitude       (path, term)  1    beside the sphere's: A(q) = A R/|R d - q| (1 + amplitude b(q))
    phase           (path, term)  rad  phi(q) = phi + phase b(q)
    delay_variance  (path, term)  s2   sigma(q)^2 = sigma^2 + delay_variance b(q)
    """

    delay: Floats
    amplitude: Floats
    phase: Floats
    delay_variance: Floats
    error: Floats  # (path,) s: all that it misses at the probes, those held out among them, as a delay
    aperture: float  # m: scale of q
    monomials: tuple[int, ...] = EVERY  # (term,) which of `aperture_terms` it belongs to

    @staticmethod
    def none(count: int, aperture: float = 0.0, monomials: tuple[int, ...] = EVERY) -> ArrayExpansion:
        """Of spheres, all alike."""
        nothing = np.empty((count, 0))
        return ArrayExpansion(nothing, nothing, nothing, nothing, np.zeros(count), aperture, monomials)

    def __getitem__(self, rows: Bools | Ints | slice) -> ArrayExpansion:
        """The paths picked by a mask, by indices or by a slice."""
        return self.select(rows)

    def without(self, *names: str) -> ArrayExpansion:
        """The same, but of some quantities all sensors have what the middle has."""
        return self.but(**{name: getattr(self, name)[:, :0] for name in names})

    def over(self, name: str, points: Floats) -> Floats:
        """A quantity at places (point, xyz) m: (path, point)."""
        terms = getattr(self, name)
        if not terms.shape[1]:
            return np.zeros((len(terms), len(points)))
        return np.asarray((self._terms_at(points, terms.shape[1]) @ terms.T).T)  # points are read one by one

    def largest(self, name: str) -> Floats:
        """Bound (path,) on the modulus of a quantity over the aperture."""
        return np.asarray(np.abs(getattr(self, name)).sum(axis=1))

    def mean_square(self, points: Floats) -> Floats:
        """Mean square (path,) over places (point, xyz) m of 1 + amplitude b(q): what is faint in the middle may be loud
        at the rim."""
        terms = self.amplitude.shape[1]
        if not terms:
            return np.ones(len(self.amplitude))
        gain = self.amplitude + np.eye(1, terms)
        basis = self._terms_at(points, terms)
        return np.asarray(np.einsum("pt,pt->p", gain @ (basis.T @ basis / len(points)), gain))

    @property
    def amplitude_degrees(self) -> Floats:
        """How much of each degree (path, degree) there is in 1 + amplitude b(q): the moduli of its terms, summed."""
        terms = self.amplitude.shape[1]
        gain = np.abs(self.amplitude + np.eye(1, terms)) if terms else np.ones((len(self.amplitude), 1))
        degree = np.searchsorted(FIRST_OF_DEGREE, self.monomials[: gain.shape[1]], side="right") - 1
        return gain @ np.eye(1 + degree[-1])[degree]

    def first(self, degree: int) -> int:
        """The first term of a degree."""
        return bisect_left(self.monomials, FIRST_OF_DEGREE[degree])

    def gradient(self, points: Floats, *names: str) -> Floats:
        """Gradient (xyz, point, term) in 1/m of as many polynomials as some quantities have, at places (point, xyz)."""
        terms = max(getattr(self, name).shape[1] for name in names)
        return _kept_gradient(points.tobytes(), self.aperture, self.monomials[:terms])

    def _terms_at(self, points: Floats, terms: int) -> Floats:
        """The first polynomials at places (point, xyz): (point, term)."""
        return monomials_at(points, self.aperture, self.monomials[:terms])

    @property
    def varies(self) -> bool:
        """Whether anything varies beside the sphere."""
        return any(getattr(self, name).shape[1] for name in QUANTITIES)

    @staticmethod
    def join(parts: Sequence[ArrayExpansion]) -> ArrayExpansion:
        """The paths of all parts over one aperture; terms that some of them lack are 0. Raises ValueError for parts of
        different arrays."""
        columns = {name: stacked([getattr(part, name) for part in parts]) for name in (*QUANTITIES, "error")}
        widest = max(parts, key=lambda part: part.aperture)
        if any((part.aperture, part.monomials) != (widest.aperture, widest.monomials) for part in parts if part.varies):
            raise ValueError("paths over different arrays cannot be joined")
        return ArrayExpansion(**columns, aperture=widest.aperture, monomials=widest.monomials)


def stacked(blocks: Sequence[Any]) -> Any:
    """Rows of all blocks, one after the other; columns that some of them lack are 0."""
    if len({block.shape[1:] for block in blocks}) > 1:
        width = max(block.shape[1] for block in blocks)
        lacking = [np.zeros((len(block), width - block.shape[1]), block.dtype) for block in blocks]
        blocks = [np.hstack(pair) if pair[1].shape[1] else pair[0] for pair in zip(blocks, lacking, strict=True)]
    return np.concatenate(blocks)
