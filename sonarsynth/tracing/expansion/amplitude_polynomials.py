"""How the amplitudes of paths vary over the aperture: polynomials, and what they err by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.state import Receiver
from sonarsynth.tracing.expansion.probe_sensors import QUADRATIC_PROBES, probes

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths


SILENT = 1e-20
"""Amplitude under which an echo is none: of the loudest snap, 100 dB under 1 uPa. Errors are not relative to less."""


class FacetBlock(Protocol):
    """Echoes of a block of facets."""

    @property
    def array(self) -> FacetPaths:
        """The legs of these facets."""
        ...

    @property
    def strength(self) -> Floats:
        """(echo,) with the ways."""
        ...

    def select(self, loud: Bools) -> Self:
        """The echoes picked by a mask."""
        ...

    def gains(self, few: int | None) -> tuple[Floats, Floats, float]:
        """What `probe_fits.gains` makes of the law and of the legs at all probes or the first few."""
        ...


def variations(blocks: Sequence[FacetBlock]) -> tuple[list[Floats], float]:
    """Polynomials (echo, term) of the amplitude over the aperture for echoes of each block, and the error of all.

    The second degree serves for echoes of which it errs by no more than `Tolerances.quadratic`.
    """
    of_blocks = [_fitted(block, QUADRATIC_PROBES) for block in blocks]
    loudest, worst, every = max([SILENT, *(most for *_, most in of_blocks)]), 0.0, list[Floats]()
    rests = [
        np.abs(block.strength) * missed > block.array.context.tolerances.quadratic * loudest
        for block, (_, missed, *_) in zip(blocks, of_blocks, strict=True)
    ]
    if 2 * sum(map(np.count_nonzero, rests)) > sum(map(len, rests)):  # most of all: to take them all costs less
        rests = [np.ones_like(rest) for rest in rests]
    for block, rest, (second, missed, counted, _) in zip(blocks, rests, of_blocks, strict=True):
        terms = second
        if rest.any():
            more, missed[rest], counted[rest], _ = _fitted(block if rest.all() else block.select(rest), None)
            terms = np.zeros((len(rest), more.shape[1]))
            terms[:, : second.shape[1]], terms[rest] = second, more
        every.append(terms)
        worst = max(worst, float((counted * missed).max(initial=0.0)))
    return every, worst / loudest


def _fitted(block: FacetBlock, few: int | None) -> tuple[Floats, Floats, Floats, float]:
    """Polynomials from all probes, or the first few, the largest of what they miss there (echo,), strengths of echoes
    (echo,) and the largest with the gain. Echoes that end at the limb of some probe are the same everywhere, those that
    are tapered to nothing there are followed; both have no strength. All sensors share what the centre sees."""
    gain, counted, most = block.gains(few)
    return *_terms(block.array.context.receiver, gain), counted, most


def fitted(receiver: Receiver, gain: Floats, strength: Floats) -> tuple[Floats, float]:
    """Polynomials (path, term) of gain (path, probe) - 1 over the aperture; no columns where it is 1 everywhere.

    And their largest error at the probes, for paths of that strength (path,), relative to the strongest.
    """
    terms, missed = _terms(receiver, gain)
    loudest = float(np.nanmax(np.abs(strength)[:, None] * np.abs(gain), initial=0.0))
    return terms, float((np.abs(strength) * missed).max(initial=0.0)) / max(loudest, SILENT)


def _terms(receiver: Receiver, gain: Floats) -> tuple[Floats, Floats]:
    """Polynomials as above, and the largest error (path,) at the probes."""
    if (gain == 1.0).all():
        return np.empty((len(gain), 0)), np.zeros(len(gain))
    return probes(receiver.elements).expand(gain - 1.0)
