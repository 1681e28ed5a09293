"""Lambert's law."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Floats
from sonarsynth.description import description
from sonarsynth.equations.reverberation.bottom_strength import Angles, lambert
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite


@description
class Lambert(BoundaryLaw):
    """mu sin(grazing in) sin(grazing out), whatever the azimuth and the frequency.

    Fits to sediments at 50 kHz: sandy gravel -12.7 dB, coarse sand -16.0, medium sand -18.8, fine sand -20.5, coarse
    silt -20.4, medium silt -24.0; rough rock about -5. Source: Mackenzie (1961), J. Acoust. Soc. Am. 33, 1498: -27 dB
    of the deep sea at 1 kHz.
    """

    kind: Literal["lambert"] = "lambert"
    mu: Annotated[Decibels, Ge(-100), Le(-4.98)] = -27.0
    """10 log10 of mu; -5 dB gives back nearly all that arrives."""

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """As `BoundaryLaw.strength`."""
        return lambert(angles, 10.0 ** (self.mu / 10.0))

    def row(self) -> str:
        """As `Method.row`."""
        return f"lambert {self.mu:g} dB"
