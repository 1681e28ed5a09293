"""How the amplitudes of paths vary over the aperture: polynomials, and what they err by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sonarsynth.conventions import Bools, Floats
from sonarsynth.equations.kernels import probe_fits
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
    def amplitude(self) -> Floats:
        """(echo,) at the centre."""
        ...

    @property
    def strength(self) -> Floats:
        """(echo,) with the ways."""
        ...

    @property
    def tapered(self) -> Bools:
        """(echo,) whether it falls to 0 at the limb of the body."""
        ...

    def over(self, few: int | None) -> tuple[Floats, Floats]:
        """Amplitude of the law (echo, probe) at all probes or the first few, and the gain of the leg there."""
        ...


def variations(blocks: Sequence[FacetBlock]) -> tuple[list[Floats], float]:
    """Polynomials (echo, term) of the amplitude over the aperture for echoes of each block, and the error of all.

    The second degree serves where it errs by no more than `Tolerances.quadratic`.
    """
    terms, error = _fitted(blocks, QUADRATIC_PROBES)
    return (
        (terms, error) if not blocks or error <= blocks[0].array.context.tolerances.quadratic else _fitted(blocks, None)
    )


def _fitted(blocks: Sequence[FacetBlock], few: int | None) -> tuple[list[Floats], float]:
    """The same at all probes, or the first few. Echoes that end at the limb of some probe are the same everywhere;
    those that are tapered to nothing there are followed. All sensors share what the centre sees."""
    terms, worst, loudest = [], 0.0, 0.0
    for block in blocks:
        law, probe_gain = block.over(few)
        gain, strength, most = probe_fits.gains(law, block.amplitude, probe_gain, block.tapered, block.strength)
        block_terms, wrong = _terms(block.array, gain, strength)
        terms.append(block_terms)
        worst, loudest = max(worst, wrong), max(loudest, most)
    return terms, worst / max(loudest, SILENT)


def fitted(array: FacetPaths, gain: Floats, strength: Floats) -> tuple[Floats, float]:
    """Polynomials (path, term) of gain (path, probe) - 1 over the aperture; no columns where it is 1 everywhere.

    And their largest error at the probes, for paths of that strength (path,), relative to the strongest.
    """
    terms, worst = _terms(array, gain, strength)
    loudest = float(np.nanmax(np.abs(strength)[:, None] * np.abs(gain), initial=0.0))
    return terms, worst / max(loudest, SILENT)


def _terms(array: FacetPaths, gain: Floats, strength: Floats) -> tuple[Floats, float]:
    """Polynomials as above, and the largest error at the probes."""
    if (gain == 1.0).all():
        return np.empty((len(gain), 0)), 0.0
    terms, missed = probes(array.context.receiver.elements).expand(gain - 1.0)
    return terms, float((np.abs(strength) * missed).max(initial=0.0))
