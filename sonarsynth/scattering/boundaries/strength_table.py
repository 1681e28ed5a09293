"""Backscattering strength as measured."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import ValidationInfo, field_validator, model_validator

from sonarsynth.conventions import Decibels, Floats, Radians
from sonarsynth.description import description
from sonarsynth.equations.reverberation.bottom_strength import Angles
from sonarsynth.scattering.boundaries.boundary_law import BoundaryLaw, BoundarySite

NORMAL = 1.5708
LOWEST = np.deg2rad(1.0)
"""rad: below it every strength falls, for a boundary that did not would give back more than arrives."""


@description
class StrengthTable(BoundaryLaw):
    """Backscattering strength (dB) at grazing angles, linear in between; below the first, and below 1 deg, it falls as
    sin^2. A table by which more would be scattered than arrives is refused.

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

    @model_validator(mode="after")
    def _gives_back_no_more_than_arrives(self) -> StrengthTable:
        angle = np.unique([*np.linspace(LOWEST, 0.5 * np.pi, 500), *self.grazing, *np.linspace(0.0, LOWEST, 50)])
        factor = np.sqrt(self._backwards(np.sin(angle)))
        outwards = 2.0 * np.pi * np.trapezoid(factor * np.cos(angle), angle)
        shares = factor[1:] * outwards / np.sin(angle[1:])
        i = int(np.argmax(shares))
        if shares[i] > 1.0:
            raise ValueError(
                f"strength_db gives back {shares[i]:.3g} times what arrives at a grazing angle of "
                f"{np.rad2deg(angle[1 + i]):.3g} deg"
            )
        return self

    def _backwards(self, sine: Floats) -> Floats:
        """Backscattering cross-section (...) in 1/sr at sines (...) of the grazing angle."""
        level = np.interp(np.arcsin(np.clip(sine, 0.0, 1.0)), self.grazing, self.strength_db)
        first = np.sin(max(self.grazing[0], LOWEST))
        return np.asarray(10.0 ** (level / 10.0) * np.minimum(sine / first, 1.0) ** 2)

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """As `BoundaryLaw.strength`."""
        return np.sqrt(self._backwards(angles.sine_in) * self._backwards(angles.sine_out))

    def row(self) -> str:
        """As `Method.row`."""
        return f"table of {len(self.grazing)} angles"
