"""How the amplitudes of paths vary over the aperture: polynomials, and what they err by."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.state import Receiver
from sonarsynth.tracing.expansion.probe_sensors import probes

SILENT = 1e-20
"""Amplitude under which an echo is none: of the loudest snap, 100 dB under 1 uPa. Errors are not relative to less."""


def variations(receiver: Receiver, blocks: Iterable[tuple[Floats, Floats, float]]) -> tuple[list[Floats], float]:
    """Polynomials (echo, term) of the amplitude over the aperture for echoes of each block, and the error of all, over
    the loudest.

    blocks: what `probe_fits.gains` says of the echoes of each. Those that end at the limb of some probe are the same
    everywhere, those that are tapered to nothing there are followed; both have no strength. All sensors share what the
    centre sees.
    """
    every, worst, loudest = list[Floats](), 0.0, SILENT
    for gain, strength, most in blocks:
        terms, missed = _terms(receiver, gain)
        every.append(terms)
        worst = max(worst, float((strength * missed).max(initial=0.0)))
        loudest = max(loudest, most)
    return every, worst / loudest


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
