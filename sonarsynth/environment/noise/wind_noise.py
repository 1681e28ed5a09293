"""Noise of the wind on the surface alone."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Le

from sonarsynth.conventions import Floats, PositiveSpeed
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density, wenz_components
from sonarsynth.equations.water import formula_ranges


@description
class WindNoise(NoiseField):
    """Gaussian noise of breaking waves: the part of Wenz's curves that is wind's. Source: Coates (1989), Underwater
    Acoustic Systems."""

    kind: Literal["wind"] = "wind"
    wind_speed: Annotated[PositiveSpeed, Le(60)] = 5.0
    """Wind speed over the sea."""
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`; wind's are those of the surface."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(wenz_components(frequency, 0.0, self.wind_speed)["wind"])

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        with formula_ranges.noted() as notes:
            formula_ranges.WENZ.check(frequency=[low, high], wind_speed=self.wind_speed)
        return tuple(notes)
