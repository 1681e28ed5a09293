"""Echoes as they are picked: when, from where, and how well that is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sonarsynth.columns import Columns
from sonarsynth.conventions import Floats, direction
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

    @property
    def beam(self) -> Floats:
        """Unit vectors (echo, xyz) to where they come from."""
        return direction(self.azimuth, self.elevation)

    def further_off(self, up: Floats, to_port: Floats) -> PickedEchoes:
        """Echoes whose directions err by so much (echo,) rad more, upwards and to port, root mean square."""
        across = to_port / np.maximum(np.cos(self.elevation), 0.1)
        return self.but(
            azimuth_error=np.minimum(np.hypot(self.azimuth_error, across), np.pi),
            elevation_error=np.minimum(np.hypot(self.elevation_error, up), np.pi),
        )


def tangents(azimuth: Floats, elevation: Floats) -> Floats:
    """Unit vectors (2, ..., xyz) across directions (...) in rad: upwards and to port."""
    se, ce, sa, ca = np.sin(elevation), np.cos(elevation), np.sin(azimuth), np.cos(azimuth)
    return np.moveaxis(np.array([[-se * ca, -se * sa, ce], [-sa, ca, 0.0 * ca]]), 1, -1)


def no_echoes(image: EnergyImage, overflow: int) -> PickedEchoes:
    """None."""
    none = np.zeros(0)
    return PickedEchoes(none, none, none, none, none, none, image.energy.ravel()[:0], none, overflow)
