"""The water: depth, sound speed, surface, bottom, absorption and ambient noise."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le
from pydantic import Tag, model_validator

from sonarsynth.conventions import Number, PositiveMetres
from sonarsynth.description import ONE_OR_SEVERAL, description
from sonarsynth.environment.boundaries import SeaBottom, SeaSurface
from sonarsynth.environment.hydrography import WaterSalinity, WaterTemperature
from sonarsynth.environment.noise import Noise
from sonarsynth.environment.sound_speed import (
    Cast,
    Catenary,
    Isovelocity,
    Linear,
    Munk,
    Profile,
    SoundSpeed,
    Tabulated,
    TemperatureSalinity,
    Thermocline,
    reaches,
)

__all__ = [
    "Absorption",
    "Cast",
    "Catenary",
    "Environment",
    "Isovelocity",
    "Linear",
    "Munk",
    "Profile",
    "SoundSpeed",
    "Tabulated",
    "TemperatureSalinity",
    "Thermocline",
]


@description
class Absorption:
    """Absorption of sound in sea water (Francois and Garrison 1982, or Ainslie and McColm 1998), or none.

    It falls with depth, by its pressure: each path loses its mean over the depths that it passes. Temperature, salinity
    and pH are one value for all of the water.
    """

    formula: Literal["francois_garrison", "ainslie_mccolm", "none"] = "francois_garrison"
    """`ainslie_mccolm` is simpler, within 10 % of the other; `none`: no absorption."""
    temperature: WaterTemperature = 27.0
    """Temperature of the water, alike at all depths."""
    salinity: WaterSalinity = 35.0
    """Salinity of the water, alike at all depths."""
    ph: Annotated[Number, Ge(0), Le(14)] = 8.1
    """pH of the water; it matters under some 10 kHz, where boric acid absorbs."""


@description
class Environment:
    """The water and its boundaries."""

    depth: Annotated[PositiveMetres, Le(12e3)]
    """Depth of the bottom below the mean surface."""
    sound_speed: SoundSpeed
    """Against depth: a formula, or a measured cast."""
    surface: SeaSurface = SeaSurface()
    """What a reflection at the surface does to sound."""
    bottom: SeaBottom = SeaBottom()
    """What a reflection at the bottom does to sound."""
    absorption: Absorption = Absorption()
    """What is lost on the way."""
    noise: (
        Annotated[Annotated[Noise, Tag("one")] | Annotated[tuple[Noise, ...], Tag("several")], ONE_OR_SEVERAL] | None
    ) = None
    """Ambient noise at the hydrophones: one, or a list whose powers add up; none if left out. One that is appended to
    the list changes nothing of those before it."""

    @property
    def noises(self) -> tuple[Noise, ...]:
        """All of the ambient noise, as a list."""
        if self.noise is None:
            return ()
        return self.noise if isinstance(self.noise, tuple) else (self.noise,)

    @model_validator(mode="after")
    def _water_all_the_way(self) -> Environment:
        reaches(self.sound_speed, self.depth)
        return self
