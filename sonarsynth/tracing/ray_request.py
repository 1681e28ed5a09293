"""Which rays to follow from the array, for pictures and for looking at a scene."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from annotated_types import Ge, Le, MinLen

from sonarsynth.conventions import Floats, PositiveSeconds, Radians, direction
from sonarsynth.description import description


@description
class RayRequest:
    """A fan of rays from the array centre: a list of directions, or a grid over the field of view."""

    directions: Annotated[tuple[tuple[Radians, Radians], ...], MinLen(1)] | None = None
    """(azimuth, elevation) of each ray in the sonar frame; left out: the grid."""
    azimuth_span: Annotated[Radians, Ge(0), Le(2 * np.pi)] = np.deg2rad(50.0)
    azimuths: Annotated[int, Ge(1), Le(1000)] = 11
    """Rays in a row of the grid."""
    elevation_span: Annotated[Radians, Ge(0), Le(np.pi)] = np.deg2rad(50.0)
    elevations: Annotated[int, Ge(1), Le(1000)] = 11
    """Rows of the grid."""
    duration: PositiveSeconds = 0.05
    """How long a ray is followed."""
    bounces: Annotated[int, Ge(0), Le(100_000)] = 20
    """A ray ends at the reflection after this many."""
    towards_shrimp: bool = False
    """Send a ray on to the first shrimp from the first facet it meets, with the coefficient of the scattering law."""

    def rays(self) -> Floats:
        """Unit vectors (ray, xyz) in the sonar frame."""
        if self.directions is not None:
            azimuth, elevation = np.array(self.directions, float).T
            return direction(azimuth, elevation)
        azimuth = _spread(self.azimuth_span, self.azimuths)
        elevation = _spread(self.elevation_span, self.elevations)
        return direction(azimuth[None, :], elevation[:, None]).reshape(-1, 3)


def _spread(span: float, count: int) -> Floats:
    return np.linspace(-0.5 * span, 0.5 * span, count) if count > 1 else np.zeros(1)
