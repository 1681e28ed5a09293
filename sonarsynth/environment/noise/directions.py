"""Where noise comes from: its power by direction, the same in all azimuths, or one plane wave."""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

import numpy as np
from annotated_types import Ge, Gt, Le, Lt
from pydantic import model_validator

from sonarsynth.conventions import Floats, Number, Radians, direction
from sonarsynth.description import BY_KIND, description

Elevation = Annotated[Radians, Ge(-0.5 * np.pi), Le(0.5 * np.pi)]


class NoiseDirections(Protocol):
    """Noise that is the same in all azimuths, a sum of plane waves from all directions, independent of each other; or
    one plane wave."""

    @property
    def toward(self) -> Floats | None:
        """Unit vector (xyz) to where one plane wave comes from, world; None: waves come from many directions."""
        ...

    @property
    def edges(self) -> tuple[float, ...]:
        """Sines of the elevations, rising, between which the intensity is smooth; outside of them it is zero."""
        ...

    def intensity(self, sine: Floats) -> Floats:
        """Power per solid angle that comes from elevations of this sine, up positive, in any unit."""
        ...

    def __hash__(self) -> int: ...


@description
class IsotropicDirections:
    """From all directions alike."""

    kind: Literal["isotropic"] = "isotropic"
    toward = None

    @property
    def edges(self) -> tuple[float, ...]:
        """As `NoiseDirections.edges`."""
        return (-1.0, 1.0)

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`."""
        return np.ones_like(sine)


@description
class SurfaceDirections:
    """From all of the surface: sources just under it, whose pressure falls as sin^m of the elevation. Source: Cron and
    Sherman (1962), JASA 34, 1732."""

    kind: Literal["surface"] = "surface"
    toward = None
    exponent: Annotated[Number, Ge(0.5), Le(4)] = 1.0
    """m: 1 for dipoles, as wind and rain are; up to 1.5 for heavy rain."""

    @property
    def edges(self) -> tuple[float, ...]:
        """As `NoiseDirections.edges`."""
        return (0.0, 1.0)

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`."""
        return np.asarray(sine ** (2.0 * self.exponent - 1.0))


@description
class BottomDirections:
    """From sources that are spread evenly over the bottom, each alike in all directions, and from their images in
    surface and bottom: 1/|sin| of the elevation, down to that of the farthest."""

    kind: Literal["bottom"] = "bottom"
    toward = None
    lowest: Annotated[Radians, Gt(0), Lt(0.5 * np.pi)] = np.deg2rad(1.0)
    """Size of the elevation of the farthest sources that are heard."""
    images: bool = True
    """Whether reflections by the surface bring as much from above; false: all comes from below."""

    @property
    def edges(self) -> tuple[float, ...]:
        """As `NoiseDirections.edges`."""
        least = float(np.sin(self.lowest))
        steps = np.geomspace(least, 1.0, 2 + int(np.ceil(-np.log2(least)))).tolist()  # 1/|sin| is smooth in each
        below = tuple(-step for step in reversed(steps))
        return (*below, *steps) if self.images else below

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`."""
        away = np.abs(sine)
        return np.where(away < np.sin(self.lowest), 0.0, 1.0 / np.maximum(away, 1e-300))


@description
class RingDirections:
    """From all azimuths and a range of elevations, such as distant ships over a sloping bottom."""

    kind: Literal["ring"] = "ring"
    toward = None
    low: Elevation = np.deg2rad(-10.0)
    """Lower end of the elevations, up positive."""
    high: Elevation = np.deg2rad(-1.0)
    """Upper end of the elevations."""

    @model_validator(mode="after")
    def _check(self) -> RingDirections:
        if not np.sin(self.low) < np.sin(self.high):
            raise ValueError("high must be above low")
        return self

    @property
    def edges(self) -> tuple[float, ...]:
        """As `NoiseDirections.edges`."""
        return (float(np.sin(self.low)), float(np.sin(self.high)))

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`."""
        return np.ones_like(sine)


@description
class OneDirection:
    """From one direction of the world: a plane wave, such as of a distant ship."""

    kind: Literal["direction"] = "direction"
    bearing: Radians
    """Bearing that it comes from, clockwise from north."""
    elevation: Elevation = 0.0
    """Elevation that it comes from; up is positive."""

    @property
    def toward(self) -> Floats:
        """As `NoiseDirections.toward`."""
        return direction(0.5 * np.pi - self.bearing, self.elevation)

    @property
    def edges(self) -> tuple[float, ...]:
        """As `NoiseDirections.edges`: none."""
        return ()

    def intensity(self, sine: Floats) -> Floats:
        """As `NoiseDirections.intensity`: no solid angle has any."""
        return np.zeros_like(sine)


Directions = Annotated[
    IsotropicDirections | SurfaceDirections | BottomDirections | RingDirections | OneDirection, BY_KIND
]
"""Where noise comes from, by `kind`."""
