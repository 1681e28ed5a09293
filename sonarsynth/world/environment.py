"""The water: depth, sound speed, surface, bed, absorption and ambient noise."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import ValidationInfo, field_validator

from sonarsynth.conventions import (
    Decibels,
    DegreesCelsius,
    Floats,
    NonNegativeMetres,
    Number,
    PositiveMetres,
    PositiveSpeed,
    PracticalSalinity,
    WaterSoundSpeed,
)
from sonarsynth.description import BY_KIND, description
from sonarsynth.world.boundaries import SeaBed, SeaSurface

Depths = Annotated[tuple[NonNegativeMetres, ...], MinLen(1)]


def _ascending(depth: tuple[float, ...]) -> tuple[float, ...]:
    for i, (above, below) in enumerate(pairwise(depth), start=1):
        if below < above:
            raise ValueError(f"must not decrease, but entry {i} ({below:g} m) is above entry {i - 1} ({above:g} m)")
    return depth


def _as_long_as_depth(values: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
    depth = info.data.get("depth")
    if depth is not None and len(values) != len(depth):
        raise ValueError(f"has {len(values)} entries, but depth has {len(depth)}")
    return values


@description
class Isovelocity:
    """The same sound speed everywhere."""

    kind: Literal["isovelocity"] = "isovelocity"
    speed: WaterSoundSpeed


@description
class Tabulated:
    """Sound speed at depths, linear between them, constant beyond the ends. Two equal depths make a jump."""

    kind: Literal["tabulated"] = "tabulated"
    depth: Depths
    """Depths below the surface (m), not decreasing."""
    speed: tuple[WaterSoundSpeed, ...]
    """Sound speed at each depth."""

    _depth = field_validator("depth")(_ascending)
    _speed = field_validator("speed")(_as_long_as_depth)


@description
class TemperatureSalinity:
    """Sound speed from temperature and salinity at depths, by Mackenzie (1981); linear between the depths."""

    kind: Literal["temperature_salinity"] = "temperature_salinity"
    depth: Depths
    """Depths below the surface (m), not decreasing."""
    temperature: tuple[DegreesCelsius, ...]
    """Temperature at each depth."""
    salinity: tuple[Annotated[PracticalSalinity, Ge(0)], ...]
    """Practical salinity at each depth."""

    _depth = field_validator("depth")(_ascending)
    _values = field_validator("temperature", "salinity")(_as_long_as_depth)


@description
class Cast:
    """A CTD cast in a CSV file, as the instrument exported it (CastAway), or with named columns.

    Comment lines begin with '%' or '#'; then a line of column names. Depth (m or dbar) and either sound speed or
    temperature and salinity are found by name.
    """

    kind: Literal["cast"] = "cast"
    path: str
    """Path of the file, relative to the recipe."""
    quantity: Literal["auto", "sound_speed", "temperature_salinity"] = "auto"
    """Which columns to use; auto takes the instrument's own sound speed where there is one."""


SoundSpeed = Annotated[Isovelocity | Tabulated | TemperatureSalinity | Cast, BY_KIND]


@dataclass(frozen=True, eq=False)
class Profile:
    """Sound speed (m/s) at node depths (m), piecewise linear, constant beyond the ends: what rays go through."""

    depth: Floats  # (node,) not decreasing
    speed: Floats  # (node,)

    @property
    def uniform(self) -> bool:
        """True where the sound speed is the same everywhere."""
        return bool(np.all(self.speed == self.speed[0]))

    def at(self, depth: np.ndarray | float) -> Floats:
        """Sound speed (m/s) at depths (m, positive down)."""
        return np.asarray(np.interp(depth, self.depth, self.speed))


@description
class Absorption:
    """Absorption of sound in sea water (Francois and Garrison 1982, or Ainslie and McColm 1998), or none."""

    formula: Literal["francois_garrison", "ainslie_mccolm", "none"] = "francois_garrison"
    temperature: Annotated[DegreesCelsius, Ge(-5), Le(60)] = 27.0
    salinity: Annotated[PracticalSalinity, Ge(0), Le(100)] = 35.0
    ph: Annotated[Number, Ge(0), Le(14)] = 8.1
    """pH of the water; it matters under some 10 kHz, where boric acid absorbs."""


@description
class FlatNoise:
    """Gaussian noise, independent between hydrophones, flat over the band."""

    kind: Literal["flat"] = "flat"
    level: Annotated[Decibels, Ge(-200), Le(300)]
    """Spectral level in dB re 1 uPa2/Hz."""


@description
class WenzNoise:
    """Gaussian noise, independent between hydrophones: turbulence, shipping, wind and thermal (Coates 1989)."""

    kind: Literal["wenz"] = "wenz"
    shipping: Annotated[Number, Ge(0), Le(1)] = 0.5
    """How busy the sea is, from 0 to 1."""
    wind_speed: Annotated[PositiveSpeed, Le(60)] = 5.0


Noise = Annotated[FlatNoise | WenzNoise, BY_KIND]


@description
class Environment:
    """The water and its boundaries."""

    depth: Annotated[PositiveMetres, Le(12e3)]
    """Depth of the bed below the mean surface."""
    sound_speed: SoundSpeed
    surface: SeaSurface = SeaSurface()
    bed: SeaBed = SeaBed()
    absorption: Absorption = Absorption()
    noise: Noise | None = None
    """Ambient noise at the hydrophones; none if left out."""
