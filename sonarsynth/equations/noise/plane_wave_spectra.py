"""Spectra and cross spectra of noise that comes as independent plane waves, at square faces."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.apertures import element_directivity

TOGETHER = 1 << 20
"""Products of a wave and a pair that are made at once."""


def heard_share(toward: Floats, frequency: float, face: float, sound_speed: float, behind: float) -> Floats:
    """Share (wave,) of the power of plane waves that a square face of side `face` (m) hears at a frequency (Hz).

    toward (wave, xyz): unit vectors to where they come from, x the axis of the face; behind: what is left of the
    pressure of those from behind.
    """
    share = np.where(toward[:, 0] < 0.0, behind**2, 1.0)
    if face > 0.0:
        share = share * element_directivity(np.array([frequency]), toward[:, None, :], face, sound_speed)[:, 0] ** 2
    return np.asarray(share)


def cross_power(toward: Floats, power: Floats, offset: Floats, wavenumber: float) -> npt.NDArray[np.complex128]:
    """Sums (pair,) of power exp(i k d.u) over plane waves toward (wave, xyz), each of a power (wave,): the cross power
    of a hydrophone at offset d (pair, xyz) m from another with that one. At offset 0: their power."""
    total = np.zeros(len(offset), complex)
    many = max(TOGETHER // max(len(offset), 1), 1)
    for first in range(0, len(toward), many):
        block = slice(first, first + many)
        total += np.exp(1j * wavenumber * (toward[block] @ offset.T)).T @ power[block]
    return total
