"""Noise of the heat of the water."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density, wenz_components


@description
class ThermalNoise(NoiseField):
    """Gaussian noise of thermal agitation: -15 + 20 lg f/kHz. Source: Mellen (1952), JASA 24, 478."""

    kind: Literal["thermal"] = "thermal"
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(wenz_components(frequency, 0.0, 0.0)["thermal"])
