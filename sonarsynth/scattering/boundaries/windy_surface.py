"""The surface under wind."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, MetresPerSecond
from sonarsynth.description import description
from sonarsynth.equations.reverberation.bottom_strength import Angles
from sonarsynth.equations.reverberation.surface_strength import bubbles, facets, small_waves
from sonarsynth.equations.water import formula_ranges
from sonarsynth.equations.water.boundary_reflection import wind_wave_height
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite


@description
class WindySurface(BoundaryLaw):
    """Facets of waves, ripples on them and bubbles under them. Source: APL-UW TR 9407 (1994), section II.

    Facets give back what roughness takes from the coherent reflection, which is that of a sea of the same wind.
    """

    kind: Literal["wind"] = "wind"
    wind_speed: Annotated[MetresPerSecond, Ge(0), Le(60)] | None = None
    """Left out, that of the environment's surface."""

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """As `BoundaryLaw.strength`."""
        wind = site.wind_speed if self.wind_speed is None else self.wind_speed
        if wind is None:
            if site.rms_height > 0.0:
                raise ValueError("needs the wind_speed of a rough surface")
            return np.zeros(np.broadcast(*angles).shape)
        own = self.wind_speed is not None and self.wind_speed != site.wind_speed
        with formula_ranges.noted():  # said by `notes`
            height = float(wind_wave_height(wind)) if own else site.rms_height
        both = site.mirrored(_angle(angles.sine_in)) * site.mirrored(_angle(angles.sine_out))
        mirror = facets(angles, site.wavenumber, wind, height) * both
        return mirror + small_waves(angles, wind) + bubbles(angles, site.frequency, wind)

    def notes(self) -> tuple[str, ...]:
        """As `Method.notes`."""
        with formula_ranges.noted() as lines:
            wind_wave_height(self.wind_speed or 0.0)
        return tuple(lines)

    def row(self) -> str:
        """As `Method.row`."""
        return "wind" if self.wind_speed is None else f"wind {self.wind_speed:g} m/s"


def _angle(sine: Floats) -> Floats:
    return np.asarray(np.arcsin(np.clip(sine, 0.0, 1.0)))
