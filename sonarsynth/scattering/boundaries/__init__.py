"""How boundaries scatter sound where nothing else is said of them. `BoundaryScattering` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite
from sonarsynth.scattering.boundaries.lambert_boundary import Lambert
from sonarsynth.scattering.boundaries.rough_sediment import RoughSediment
from sonarsynth.scattering.boundaries.strength_table import StrengthTable
from sonarsynth.scattering.boundaries.windy_surface import WindySurface

BoundaryScattering = Annotated[Lambert | RoughSediment | StrengthTable | WindySurface, BY_KIND]
"""Laws of boundaries, by `kind`."""

__all__ = [
    "BoundaryLaw",
    "BoundaryScattering",
    "BoundarySite",
    "Lambert",
    "RoughSediment",
    "StrengthTable",
    "WindySurface",
]
