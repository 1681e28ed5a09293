"""Sediments by their grain size."""

from __future__ import annotations

from typing import Literal

from pydantic import field_validator

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.equations.reverberation.bottom_strength import GRAIN_SIZE, Angles, sediment
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite


@description
class RoughSediment(BoundaryLaw):
    """Roughness and volume of a sediment, for any two directions. Source: APL-UW TR 9407 (1994), section IV."""

    kind: Literal["sediment"] = "sediment"
    name: str | None = None
    """Name of the sediment; left out, that of the environment's bottom."""

    @field_validator("name")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        if name is not None and name not in GRAIN_SIZE:
            raise ValueError(f"'{name}' has no law; known: {', '.join(GRAIN_SIZE)}. For others, use kind: lambert")
        return name

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """As `BoundaryLaw.strength`."""
        name = self.name or site.sediment
        if name is None:
            raise ValueError("needs the name of a sediment, or kind: lambert")
        if name not in GRAIN_SIZE:
            raise ValueError(f"'{name}' has no law of a sediment: use kind: lambert, of about -5 dB")
        return sediment(angles, site.wavenumber, name)

    def row(self) -> str:
        """As `Method.row`."""
        return "sediment" if self.name is None else f"sediment {self.name}"
