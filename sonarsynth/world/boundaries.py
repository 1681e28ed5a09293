"""The boundaries of the water: surface and bed, flat, and how they reflect."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Number
from sonarsynth.description import description


@description
class SeaSurface:
    """The surface: flat, and pressure release (reflection coefficient -1)."""

    kind: Literal["pressure_release"] = "pressure_release"


@description
class SeaBed:
    """The bed: flat, a fluid half-space (Rayleigh reflection coefficient). Default: medium sand (APL-UW TR 9407)."""

    kind: Literal["fluid"] = "fluid"
    density_ratio: Annotated[Number, Gt(0)] = 1.845
    """Density over that of the water."""
    speed_ratio: Annotated[Number, Gt(0)] = 1.1782
    """Sound speed over that of the water at the bed."""
    loss_tangent: Annotated[Number, Ge(0), Le(1)] = 0.01624
    """Imaginary over real part of the wavenumber in the bed."""
