"""Noise of turbulence, shipping, wind and heat."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, Number, PositiveSpeed
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density, wenz_level
from sonarsynth.equations.water import formula_ranges


@description
class WenzNoise(NoiseField):
    """Gaussian noise: turbulence, shipping, wind and thermal (Coates 1989)."""

    kind: Literal["wenz"] = "wenz"
    shipping: Annotated[Number, Ge(0), Le(1)] = 0.5
    """How busy the sea is, from 0 to 1."""
    wind_speed: Annotated[PositiveSpeed, Le(60)] = 5.0
    """Wind speed over the sea."""

    directions: Directions | None = None
    """Where it comes from: hydrophones then hear it through their faces, and together; left out, the level is that at
    each hydrophone, independent of the others."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(wenz_level(frequency, self.shipping, self.wind_speed))

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        with formula_ranges.noted() as notes:
            formula_ranges.WENZ.check(frequency=[low, high], wind_speed=self.wind_speed)
        return tuple(notes)
