"""Echoes as they are picked: when, from where, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import Columns
from sonarsynth.conventions import Floats
from sonarsynth.products import EnergyImage


@dataclass(frozen=True, eq=False)
class PickedEchoes(Columns):
    """Echoes in the order of their beams. Errors are predicted standard errors."""

    azimuth: Floats  # (echo,) rad
    elevation: Floats  # (echo,) rad
    azimuth_error: Floats  # (echo,) rad
    elevation_error: Floats  # (echo,) rad
    delay: Floats  # (echo,) s after the direct arrival
    delay_error: Floats  # (echo,) s
    energy: npt.NDArray[np.float32]  # (echo,) Pa2 s: of the echo, or of its beam
    snr: Floats  # (echo,) dB: power of the peak over the mean power of noise in its beam
    overflow: int = 0  # beams that were not looked at, the faintest
    error_product: Floats | float = 0.0  # (echo,) rad2: covariance of the errors of azimuth and elevation


def no_echoes(image: EnergyImage, overflow: int) -> PickedEchoes:
    """None."""
    none = np.zeros(0)
    return PickedEchoes(none, none, none, none, none, none, image.energy.ravel()[:0], none, overflow)
