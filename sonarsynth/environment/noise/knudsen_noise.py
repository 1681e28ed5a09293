"""Noise of the sea by sea state."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, Number
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import knudsen_level, power_density
from sonarsynth.equations.water import formula_ranges


@description
class KnudsenNoise(NoiseField):
    """Gaussian noise by sea state: 56 + 19 lg SS - 17 lg f/kHz. Source: Knudsen, Alford and Emling (1948), Journal of
    Marine Research 7, 410."""

    kind: Literal["knudsen"] = "knudsen"
    sea_state: Annotated[Number, Ge(0.5), Le(9)] = 2.0
    """Sea state, SS in the formula."""
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`; those of the surface fit it."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(knudsen_level(frequency, self.sea_state))

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        with formula_ranges.noted() as notes:
            formula_ranges.KNUDSEN.check(frequency=[low, high], sea_state=self.sea_state)
        return tuple(notes)
