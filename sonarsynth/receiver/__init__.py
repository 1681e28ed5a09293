"""What listens: the array, its band and filter, the converter, the beam grid, and the sound speed it assumes.

All of it belongs to the instrument, never to the water: a varied sound speed must not change the shape of a frame.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, Lt
from pydantic import ValidationInfo, field_validator, model_validator

from sonarsynth.conventions import (
    Decibels,
    Floats,
    MetresPerSecond,
    NonNegativeMetres,
    Pascals,
    PositiveHertz,
    PositiveMetres,
    PositiveRadians,
    WaterSoundSpeed,
)
from sonarsynth.description import BY_KIND, description
from sonarsynth.receiver.hydrophones import POINT, Array, Elements, PlanarLattice, PositionTable, Romanis, elements
from sonarsynth.receiver.sensor_errors import Electronics, Overload, SensorErrors

__all__ = [
    "POINT",
    "Band",
    "BandPass",
    "BeamGrid",
    "Converter",
    "Electronics",
    "Elements",
    "Filter",
    "LowPass",
    "Overload",
    "PlanarLattice",
    "PositionTable",
    "Romanis",
    "SensorErrors",
    "Sonar",
    "elements",
    "stop_frequency",
]


def _above_low(value: float, info: ValidationInfo) -> float:
    """Validate the upper edge of a band against its lower one."""
    if value <= info.data.get("low", 0.0):
        raise ValueError(f"must be above low ({info.data['low']:g} Hz)")
    return value


@description
class Band:
    """The band that the sonar works in: the bins that are beamformed, located and ranged."""

    low: PositiveHertz
    """Lowest frequency."""
    high: PositiveHertz
    """Highest frequency."""

    _high = field_validator("high")(_above_low)

    @property
    def centre(self) -> float:
        """Middle of the band (Hz)."""
        return 0.5 * (self.low + self.high)


Transition = Annotated[PositiveHertz, Ge(100.0)]
"""A filter rings for several periods of its transition: narrower ones would ring for more than 0.1 s."""


@description
class LowPass:
    """Linear-phase low-pass FIR filter (Kaiser window), zero delay."""

    kind: Literal["low_pass"] = "low_pass"
    cutoff: PositiveHertz
    """Where the response is one half (-6 dB)."""
    transition: Transition = 10e3
    """From where it passes everything to where it stops everything."""
    attenuation: Annotated[Decibels, Ge(21), Le(160)] = 80.0
    """Attenuation of what is stopped, at least."""

    @property
    def edges(self) -> tuple[float, float]:
        """Hz: lower and upper edge of what passes."""
        return 0.0, self.cutoff


@description
class BandPass:
    """Linear-phase band-pass FIR filter (Kaiser window), zero delay."""

    kind: Literal["band_pass"] = "band_pass"
    low: PositiveHertz
    """Lower edge of what passes."""
    high: PositiveHertz
    """Upper edge of what passes."""
    transition: Transition = 5e3
    """From where it passes everything to where it stops everything."""
    attenuation: Annotated[Decibels, Ge(21), Le(160)] = 80.0
    """Attenuation of what is stopped, at least."""

    _high = field_validator("high")(_above_low)

    @property
    def edges(self) -> tuple[float, float]:
        """As `LowPass.edges`."""
        return self.low, self.high


Filter = Annotated[LowPass | BandPass, BY_KIND]


@description
class Converter:
    """Analogue to digital: pressure is stored as a whole number of counts."""

    bits: Annotated[int, Ge(2), Le(24)] = 16
    """Counts run over +-(2^(bits - 1) - 1)."""
    full_scale: Annotated[Pascals, Ge(1e-9), Le(1e12)]
    """Largest pressure (Pa): counts run over +-full_scale; louder samples are clipped, and counted."""

    @property
    def quantum(self) -> float:
        """Pressure of one count (Pa)."""
        return float(self.full_scale / 2 ** (self.bits - 1))


MOST_RANGES = 100_000


@description
class BeamGrid:
    """Steered directions: a grid symmetric about the acoustic axis, ascending in azimuth and in elevation."""

    azimuth_span: Annotated[PositiveRadians, Lt(np.pi)] = np.deg2rad(50.0)
    """Angle from the first beam of a row to the last."""
    azimuths: Annotated[int, Ge(1), Le(2001)] = 101
    """Beams in a row."""
    elevation_span: Annotated[PositiveRadians, Lt(np.pi)] = np.deg2rad(50.0)
    """Angle from the lowest row of beams to the highest."""
    elevations: Annotated[int, Ge(1), Le(2001)] = 101
    """Rows of beams."""

    @property
    def azimuth(self) -> Floats:
        """(azimuth,) rad, port positive."""
        return _symmetric(self.azimuth_span, self.azimuths)

    @property
    def elevation(self) -> Floats:
        """(elevation,) rad, up positive."""
        return _symmetric(self.elevation_span, self.elevations)


@description
class RangeGrid:
    """Ranges of the cells of a range image."""

    near: PositiveMetres
    """Of the first cells."""
    far: PositiveMetres
    """Of the last, or less than a step beyond."""
    step: PositiveMetres
    """From one to the next. A cell has the loudest of what is heard half a step before and after its range."""

    @model_validator(mode="after")
    def _check(self) -> RangeGrid:
        if not self.near < self.far:
            raise ValueError("far must be beyond near")
        if (self.far - self.near) / self.step > MOST_RANGES:
            raise ValueError(f"more than {MOST_RANGES} ranges")
        return self

    @property
    def count(self) -> int:
        """How many ranges there are."""
        return 1 + int(np.ceil((self.far - self.near) / self.step - 1e-9))

    @property
    def range(self) -> Floats:
        """(range,) m, ascending."""
        return np.asarray(self.near + self.step * np.arange(self.count), float)


def _symmetric(span: float, count: int) -> Floats:
    """Exactly antisymmetric grid: kernels that use x -> -x rely on it."""
    if count == 1:
        return np.zeros(1)
    return np.asarray((2.0 * np.arange(count) - (count - 1)) * (0.5 * span / (count - 1)), float)


@description
class Sonar:
    """A passive sonar."""

    array: Array = Romanis()
    """Where the hydrophones are."""
    band: Band = Band(low=25e3, high=85e3)
    """Band that it works in."""
    filter: Filter | None = None
    """Anti-alias filter before sampling; left out: a `BandPass` of the band."""
    sampling_frequency: Annotated[PositiveHertz, Le(100e6)] = 196e3
    """Sampling frequency of every channel."""
    electronics: Electronics | None = None
    """Noise of the preamplifiers; left out: none."""
    sensor_errors: SensorErrors | None = None
    """What is wrong with hydrophones and channels; left out: nothing."""
    baffle: Annotated[Decibels, Ge(0), Le(200)] = 0.0
    """How much weaker hydrophones hear what comes from behind the array."""
    converter: Converter | None = None
    """Converter to whole counts; left out: pressure is stored as float32."""
    beams: BeamGrid = BeamGrid()
    """Directions of the images."""
    ranges: RangeGrid | None = None
    """Ranges of range images, which it then listens for; left out: there are none."""
    assumed_sound_speed: WaterSoundSpeed = 1540.0
    """The sound speed that the sonar uses to steer and to range."""
    sound_speed_error: Annotated[MetresPerSecond, Ge(0)] = 0.1
    """Standard error that the sonar ascribes to it: enters the predicted errors only, which are too large where the
    water differs by less; left out: about that of formulas for sea water (Mackenzie 1981: 0.07 m/s)."""
    mesh_sound_speed: WaterSoundSpeed | None = None
    """Sound speed by which meshes of laws that sum phases are fine enough; left out: the assumed one, the slowest where
    sequences assume several, so that all have the same meshes."""
    bed_depth_error: NonNegativeMetres = 0.05
    """Standard error of the depth of a snap below the surface, as the sonar knows it."""

    @field_validator("sampling_frequency")
    @classmethod
    def _check_sampling(cls, value: float, info: ValidationInfo) -> float:
        band, chosen = info.data.get("band"), info.data.get("filter")
        if band is None:
            return value
        if value < 2 * band.high:
            raise ValueError(f"{value:g} Hz is under twice the band ({band.high:g} Hz)")
        chosen = chosen or BandPass(low=band.low, high=band.high)
        edge = stop_frequency(chosen)
        if edge <= band.low or chosen.edges[0] - 0.5 * chosen.transition >= band.high:
            raise ValueError(f"nothing to sample: the filter stops the whole band ({band.low:g} to {band.high:g} Hz)")
        if value < 2 * edge:
            raise ValueError(f"{value:g} Hz is under twice the filter's stop edge ({edge:g} Hz)")
        return value

    @model_validator(mode="after")
    def _check_errors(self) -> Sonar:
        errors = self.sensor_errors
        if errors is None:
            return self
        if errors.stuck and self.converter is None:
            raise ValueError("stuck channels give a number of the converter: describe a converter")
        if errors.noisy and self.electronics is None:
            raise ValueError("noisy channels have louder electronics: describe electronics")
        if errors.jitter * self.band.high > 1.0:
            raise ValueError(f"jitter of {errors.jitter:g} s is over a period of the band's highest frequency")
        return self

    @property
    def behind(self) -> float:
        """What the baffle leaves of the pressure of a wave from behind, 1 at most."""
        return float(10.0 ** (-self.baffle / 20.0))

    @property
    def antialias(self) -> Filter:
        """The filter before sampling."""
        return self.filter if self.filter is not None else _pass_band(self.band)

    @property
    def shortest_wavelength(self) -> float:
        """In the band (m): what meshes are fine enough for."""
        return (self.mesh_sound_speed or self.assumed_sound_speed) / self.band.high


@lru_cache(maxsize=64)
def _pass_band(band: Band) -> BandPass:
    return BandPass(low=band.low, high=band.high)


def stop_frequency(filter: Filter) -> float:
    """Where the stop band begins (Hz)."""
    return filter.edges[1] + 0.5 * filter.transition
