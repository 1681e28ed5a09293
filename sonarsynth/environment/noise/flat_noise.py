"""Noise of one level at all frequencies."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Floats
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density


@description
class FlatNoise(NoiseField):
    """Gaussian noise, flat over the band."""

    kind: Literal["flat"] = "flat"
    level: Annotated[Decibels, Ge(-200), Le(300)]
    """Spectral level in dB re 1 uPa2/Hz."""

    directions: Directions | None = None
    """Where it comes from: hydrophones then hear it through their faces, and together; left out, the level is that at
    each hydrophone, independent of the others."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(np.full(frequency.shape, self.level))
