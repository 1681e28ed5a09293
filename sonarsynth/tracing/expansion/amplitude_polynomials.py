"""How the amplitudes of paths vary over the aperture: polynomials, and what they err by."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sonarsynth.conventions import Bools, Floats
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
    terms, worst, loudest = [], 0.0, 0.0
    for block in blocks:
        law, gain = block.over(few)
        strength = np.where((law == 0.0).any(axis=1), 0.0, block.strength)  # on the limb of some probe: not counted
        fitted = _fit(block.array, _gain(law, block.amplitude, block.tapered, gain), strength, few)
        terms.append(fitted[0])
        worst, loudest = max(worst, fitted[1]), max(loudest, fitted[2])
    return terms, worst / max(loudest, SILENT)


def _gain(over_aperture: Floats, amplitude: Floats, tapered: Bools, probe_gain: Floats) -> Floats:
    """Amplitude (path, probe) over that of the centre and the sphere; 1 for a facet that ends at the limb of some
    probe; one that is tapered (path,) to nothing there is followed. All sensors share what the centre sees.
    """
    gain = over_aperture / amplitude[:, None] * probe_gain
    gain[(over_aperture == 0).any(axis=1) & ~tapered] = 1.0
    return np.asarray(gain)


def fitted(array: FacetPaths, gain: Floats, strength: Floats) -> tuple[Floats, float]:
    """Polynomials (path, term) of gain (path, probe) - 1 over the aperture; no columns where it is 1 everywhere.

    And their largest error at the probes, for paths of that strength (path,), relative to the strongest.
    """
    terms, worst, loudest = _fit(array, gain, strength, None)
    return terms, worst / max(loudest, SILENT)


def _fit(array: FacetPaths, gain: Floats, strength: Floats, few: int | None) -> tuple[Floats, float, float]:
    """Polynomials, the largest error at the probes, and the largest amplitude there."""
    loudest = float(np.nanmax(np.abs(strength)[:, None] * np.abs(gain), initial=0.0))
    if (gain == 1.0).all():
        return np.empty((len(gain), 0)), 0.0, loudest
    terms, error = probes(array.context.receiver.elements).expand(gain - 1.0)
    return terms, float((np.abs(strength) * error).max(initial=0.0)), loudest
