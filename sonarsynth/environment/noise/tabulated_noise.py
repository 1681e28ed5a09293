"""Noise of a spectrum that was measured."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import model_validator

from sonarsynth.conventions import Decibels, Floats, PositiveHertz
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density

SpectralLevel = Annotated[Decibels, Ge(-200), Le(300)]


@description
class TabulatedNoise(NoiseField):
    """Gaussian noise of given levels, straight lines over the logarithm of the frequency between them; beyond the ends
    of the table the level is that of the end."""

    kind: Literal["table"] = "table"
    frequencies: Annotated[tuple[PositiveHertz, ...], MinLen(1)]
    """Frequencies of the levels, rising."""
    levels: tuple[SpectralLevel, ...]
    """Spectral levels there, in dB re 1 uPa2/Hz."""
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`."""

    @model_validator(mode="after")
    def _check(self) -> TabulatedNoise:
        if len(self.levels) != len(self.frequencies):
            raise ValueError(f"has {len(self.frequencies)} frequencies and {len(self.levels)} levels")
        if np.any(np.diff(self.frequencies) <= 0.0):
            raise ValueError("frequencies must rise")
        return self

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(np.interp(np.log(frequency), np.log(self.frequencies), self.levels))

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        first, last = self.frequencies[0], self.frequencies[-1]
        if first <= low and high <= last:
            return ()
        return (f"the table is of {first:.6g} to {last:.6g} Hz, the band of {low:.6g} to {high:.6g} Hz",)
