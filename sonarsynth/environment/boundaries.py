"""The boundaries of the water: surface and bottom, flat on average. What each is made of, and how rough it is. One that
is not flat, a slope or a reef, is a target with a mesh.

Roughness takes from the mirror echo what it scatters elsewhere (Eckart 1953), frequency by frequency. That energy is
not lost in the sea: it comes as many small echoes from around the mirror point. These are simulated for a recipe that
has a `reverberation` alone; without it a rough boundary has hardly any echo where a real one has an incoherent echo of
about the energy of the flat one's: at 10 degrees of grazing, wind of 2.6 m/s already takes 7.5 dB at 25 kHz, and 30 dB
at 50 kHz.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, get_args

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import ValidationInfo, field_validator

from sonarsynth.conventions import Complexes, Decibels, Floats, MetresPerSecond, NonNegativeMetres, Number, Radians
from sonarsynth.description import BY_KIND, description, unknown
from sonarsynth.equations.water.boundary_reflection import SEDIMENTS, pressure_release, rayleigh

SedimentName = Literal[
    "rock",
    "pebbles",
    "sandy gravel",
    "very coarse sand",
    "muddy sandy gravel",
    "coarse sand",
    "gravelly muddy sand",
    "medium sand",
    "muddy gravel",
    "fine sand",
    "muddy sand",
    "very fine sand",
    "clayey sand",
    "coarse silt",
    "sandy silt",
    "medium silt",
    "sandy mud",
    "fine silt",
    "sandy clay",
    "very fine silt",
    "silty clay",
    "clay",
]

NORMAL = 1.5707963267948966  # rad: grazing angle of normal incidence
_ROUNDING = 1e-5  # rad: an angle written with six digits is 0 or 90 degrees

Ratio = Annotated[Number, Ge(1e-9), Le(1e9)]
RmsHeight = Annotated[NonNegativeMetres, Le(100)]


Fluid = tuple[float, float, float]
"""Density and sound speed over those of the water, and loss tangent."""


class ReflectionModel:
    """What reflects plane waves at a smooth boundary: a `fluid`, or what has a `coefficient` of its own."""

    def coefficient(self, grazing: Floats) -> Complexes:
        """Reflection coefficient (path,) at grazing angles (path,) in rad, as of `boundary_numbers`; here that of the
        fluid, by Rayleigh."""
        if self.fluid is None:
            raise NotImplementedError(f"{type(self).__name__} has no coefficient")
        return rayleigh(grazing, *self.fluid)

    @property
    def fluid(self) -> Fluid | None:
        """The fluid without end that it is; none: it is something else."""
        return None

    @property
    def sediment(self) -> str | None:
        """Name of the sediment that it is, of those in the table of APL-UW TR 9407."""
        return None


@description
class PressureRelease(ReflectionModel):
    """Reflects everything with a change of sign: -1 at every angle, as air does to sound in water."""

    kind: Literal["pressure_release"] = "pressure_release"

    def coefficient(self, grazing: Floats) -> Complexes:
        """As `ReflectionModel.coefficient`."""
        return pressure_release(grazing)


@description
class Rigid(ReflectionModel):
    """Reflects everything without a change of sign: +1 at every angle."""

    kind: Literal["rigid"] = "rigid"

    def coefficient(self, grazing: Floats) -> Complexes:
        """As `ReflectionModel.coefficient`."""
        return np.ones(grazing.shape, complex)


@description
class FluidHalfSpace(ReflectionModel):
    """A fluid without end behind the boundary (Rayleigh's coefficient). Absorbs in proportion to frequency."""

    kind: Literal["fluid"] = "fluid"
    density_ratio: Ratio
    """Density over that of the water."""
    speed_ratio: Ratio
    """Sound speed over that of the water at the boundary."""
    loss_tangent: Annotated[Number, Ge(0), Le(1)] = 0.0
    """Imaginary over real part of the wavenumber; a loss in dB per wavelength is 54.58 times as much."""

    @property
    def fluid(self) -> Fluid:
        """As `ReflectionModel.fluid`."""
        return self.density_ratio, self.speed_ratio, self.loss_tangent


@description
class Sediment(ReflectionModel):
    """A fluid half-space with the numbers of a named sediment (APL-UW TR 9407, 1994, section IV, table 2)."""

    kind: Literal["sediment"] = "sediment"
    name: SedimentName
    """As the table calls it, such as `medium sand`."""

    @field_validator("name", mode="before")
    @classmethod
    def _known(cls, name: Any) -> Any:
        names = get_args(SedimentName)
        if isinstance(name, str) and name not in names:
            raise ValueError(unknown(name, names, "sediment"))
        return name

    @property
    def sediment(self) -> str:
        """As `ReflectionModel.sediment`."""
        return self.name

    @property
    def fluid(self) -> Fluid:
        """As `ReflectionModel.fluid`."""
        return SEDIMENTS[self.name]


@description
class ReflectionTable(ReflectionModel):
    """Reflection coefficient at grazing angles from 0 to 90 degrees: modulus, or loss in dB, and phase.

    Each is interpolated linearly in the angle, as it is written. Phases are those of exp(+i 2 pi f t), as in Bellhop's
    tables: 180 degrees for a pressure-release surface, and from 180 down to 0 as the angle grows from grazing to
    critical over a fast bottom. They are not wrapped: write neighbours close to each other.
    """

    kind: Literal["table"] = "table"
    grazing: Annotated[tuple[Annotated[Radians, Ge(0), Le(NORMAL + _ROUNDING)], ...], MinLen(2)]
    """Grazing angles, rising, from 0 to 90 degrees ("5 deg")."""
    modulus: tuple[Annotated[Number, Ge(0), Le(1)], ...] | None = None
    """Modulus at each angle; or give loss."""
    loss: tuple[Annotated[Decibels, Ge(0), Le(1e3)], ...] | None = None
    """Reflection loss in dB at each angle: -20 lg of the modulus."""
    phase: tuple[Annotated[Radians, Ge(-8 * NORMAL), Le(8 * NORMAL)], ...]
    """Phase at each angle ("180 deg")."""

    @field_validator("grazing")
    @classmethod
    def _rising_from_0_to_90(cls, angles: tuple[float, ...]) -> tuple[float, ...]:
        for i, (a, b) in enumerate(pairwise(angles), start=1):
            if b <= a:
                raise ValueError(f"must rise, but entry {i} ({b:g} rad) is not above entry {i - 1} ({a:g} rad)")
        for angle, end, which in ((angles[0], 0.0, "begins"), (angles[-1], NORMAL, "ends")):
            if abs(angle - end) > _ROUNDING:
                raise ValueError(f"must reach from 0 to 90 deg, but {which} at {angle / NORMAL * 90:g} deg")
        return angles

    @field_validator("modulus", "loss", "phase")
    @classmethod
    def _as_long_as_grazing(cls, values: tuple[float, ...] | None, info: ValidationInfo) -> tuple[float, ...] | None:
        grazing = info.data.get("grazing")
        if values is not None and grazing is not None and len(values) != len(grazing):
            raise ValueError(f"has {len(values)} entries, but grazing has {len(grazing)}")
        if info.field_name == "loss" and "modulus" in info.data and (values is None) == (info.data["modulus"] is None):
            raise ValueError("give either modulus or loss")
        return values

    def coefficient(self, grazing: Floats) -> Complexes:
        """As `ReflectionModel.coefficient`."""
        phase = np.interp(grazing, self.grazing, self.phase)
        if self.modulus is not None:
            modulus = np.interp(grazing, self.grazing, self.modulus)
        else:
            modulus = 10.0 ** (-np.interp(grazing, self.grazing, self.loss or ()) / 20.0)
        return np.asarray(modulus * np.exp(1j * phase))


Reflection = Annotated[PressureRelease | Rigid | FluidHalfSpace | Sediment | ReflectionTable, BY_KIND]
"""What a boundary is made of: the reflection of plane waves from it when it is smooth."""


@description
class SeaSurface:
    """The surface: pressure release and smooth unless said otherwise.

    Wind makes it rough (a fully developed sea) and, if asked for, puts bubbles under it, which absorb.
    """

    reflection: Reflection = PressureRelease()
    """Reflection of a plane wave, where the surface is smooth."""
    rms_height: RmsHeight = 0.0
    """Root-mean-square height of the waves; or give wind_speed."""
    wind_speed: Annotated[MetresPerSecond, Ge(0), Le(60)] | None = None
    """Wind over a fully developed sea: rms height 0.00533 U^2 (Pierson and Moskowitz 1964, U in m/s at 19.5 m)."""
    bubbles: bool = False
    """Also the loss in the bubbles under breaking waves (APL-UW TR 9407), at the frequency of the band's centre.
    It is stated for wind at 10 m, some 3 % less than at 19.5 m; the difference is left out."""

    @field_validator("wind_speed")
    @classmethod
    def _or_height(cls, speed: float | None, info: ValidationInfo) -> float | None:
        if speed is not None and info.data.get("rms_height", 0.0) > 0.0:
            raise ValueError("give either rms_height or wind_speed")
        return speed

    @field_validator("bubbles")
    @classmethod
    def _need_wind(cls, bubbles: bool, info: ValidationInfo) -> bool:
        if bubbles and info.data.get("wind_speed", 0.0) is None:
            raise ValueError("need wind_speed")
        return bubbles


@description
class SeaBottom:
    """The bottom: medium sand and smooth unless said otherwise."""

    reflection: Reflection = Sediment(name="medium sand")
    """Reflection of a plane wave, where the bottom is smooth."""
    rms_height: RmsHeight = 0.0
    """Root-mean-square height of the roughness."""
