"""Noise of rain on the surface."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Gt, Le

from sonarsynth.conventions import Floats, Number
from sonarsynth.description import description
from sonarsynth.environment.noise.directions import Directions
from sonarsynth.environment.noise.noise_field import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density, rain_level
from sonarsynth.equations.water import formula_ranges


@description
class RainNoise(NoiseField):
    """Gaussian noise of rain: 42.4 + 15.4 lg R at 5 kHz, 3 dB less each octave; good to 5 dB above 20 kHz, and without
    the peak of drizzle at 14 kHz. Source: Ma, Nystuen and Lien (2005), JASA 117, 3555, for 5 kHz."""

    kind: Literal["rain"] = "rain"
    rate: Annotated[Number, Gt(0), Le(500)] = 10.0
    """Rate of rain, R in the formula, in mm/h."""
    directions: Directions | None = None
    """Directions that it comes from, as of `flat`; rain's are those of the surface."""

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        return power_density(rain_level(frequency, self.rate))

    def validity(self, low: float, high: float) -> tuple[str, ...]:
        """As `NoiseField.validity`."""
        with formula_ranges.noted() as notes:
            formula_ranges.RAIN.check(frequency=[low, high], rate=self.rate)
        return tuple(notes)
