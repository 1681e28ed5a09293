"""Backscattering strength as measured."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import ValidationInfo, field_validator

from sonarsynth.conventions import Decibels, Floats, Radians
from sonarsynth.description import description
from sonarsynth.equations.reverberation.bottom_strength import Angles
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite

NORMAL = 1.5708


@description
class StrengthTable(BoundaryLaw):
    """Backscattering strength (dB) at grazing angles, linear in between; below the first it falls as sin^2.

    In other directions it is the geometric mean of the strengths of the two grazing angles, whatever the azimuth.
    """

    kind: Literal["table"] = "table"
    grazing: Annotated[tuple[Annotated[Radians, Ge(0), Le(NORMAL)], ...], MinLen(1)]
    """Grazing angles, rising ("5 deg")."""
    strength_db: Annotated[tuple[Annotated[Decibels, Ge(-150), Le(10)], ...], MinLen(1)]
    """At each of them, 10 log10 of the cross-section per m2 and sr."""

    @field_validator("grazing")
    @classmethod
    def _rising(cls, angles: tuple[float, ...]) -> tuple[float, ...]:
        if any(b <= a for a, b in pairwise(angles)):
            raise ValueError("must rise")
        return angles

    @field_validator("strength_db")
    @classmethod
    def _as_many(cls, values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        grazing = info.data.get("grazing")
        if grazing is not None and len(values) != len(grazing):
            raise ValueError(f"has {len(values)} entries, but grazing has {len(grazing)}")
        return values

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """As `BoundaryLaw.strength`."""
        first = max(np.sin(self.grazing[0]), 1e-9)

        def at(sine: Floats) -> Floats:
            level = np.interp(np.arcsin(np.clip(sine, 0.0, 1.0)), self.grazing, self.strength_db)
            return np.asarray(10.0 ** (level / 10.0) * np.minimum(sine / first, 1.0) ** 2)

        return np.sqrt(at(angles.sine_in) * at(angles.sine_out))

    def row(self) -> str:
        """As `Method.row`."""
        return f"table of {len(self.grazing)} angles"
