"""Which rays to look at: a fan from the array, and the eigenrays of a frame."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen

from sonarsynth.conventions import Floats, PositiveSeconds, Radians, direction
from sonarsynth.description import description


@description
class EigenrayRequest:
    """All rays from each snap to the array centre, and from each snap by each target to the array centre."""

    vertices: Annotated[int, Ge(0), Le(12)] = 2
    """Most reflections from surface and bottom and turning points of a whole path together."""
    targets: Literal["centre", "nearest", "none"] = "centre"
    """By way of the middle of each target, of its facet nearest to the array, or of no target."""


@description
class RayRequest:
    """Rays to look at: eigenrays; a fan from the array centre, in given directions or on a grid over the field of view.

    A recipe that asks for none is looked at by the eigenrays of its frame.
    """

    fan: bool = True
    """Follow the fan that the fields below describe."""
    eigenrays: EigenrayRequest | None = None
    """The eigenrays to draw; none if left out."""
    directions: Annotated[tuple[tuple[Radians, Radians], ...], MinLen(1)] | None = None
    """Direction (azimuth, elevation) of each ray in the sonar frame; left out: the grid."""
    azimuth_span: Annotated[Radians, Ge(0), Le(2 * np.pi)] = np.deg2rad(50.0)
    """Azimuths that the grid spans, about the axis of the sonar."""
    azimuths: Annotated[int, Ge(1), Le(100)] = 11
    """Rays in a row of the grid."""
    elevation_span: Annotated[Radians, Ge(0), Le(np.pi)] = np.deg2rad(50.0)
    """Elevations that the grid spans, about the axis of the sonar."""
    elevations: Annotated[int, Ge(1), Le(100)] = 11
    """Rows of rays in the grid."""
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
