"""What listens: the array, its band and filter, the converter, the beam grid, and the sound speed it assumes.

All of it belongs to the instrument, never to the water: a varied sound speed must not change the shape of a frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, Lt, MinLen
from pydantic import ValidationInfo, field_validator, model_validator

from sonarsynth.conventions import (
    Decibels,
    Floats,
    Ints,
    MetresPerSecond,
    NonNegativeMetres,
    Pascals,
    Position,
    PositiveHertz,
    PositiveMetres,
    PositiveRadians,
    PositiveSpeed,
)
from sonarsynth.description import BY_KIND, description

ROMANIS_ROWS = (4, 10, 14, 18, 20, 20, 22, 22, 24, 24, 24, 26, 26, 26, 26, 24, 24, 24, 22, 22, 20, 20, 18, 14, 10, 4)
"""Elements in each row of the 508-element disc: 500 cells centred on a corner, and the octet (9.5, 8.5), (8.5, 9.5)."""


@description
class PlanarLattice:
    """Elements on a regular lattice in the plane x = 0, facing x, centred on the origin.

    Numbered as read in a picture that the sonar looks at: rows from the top (+z) down, in a row from port (+y) to
    starboard; masked places are skipped.
    """

    kind: Literal["planar_lattice"] = "planar_lattice"
    columns: Annotated[int, Ge(1), Le(4096)]
    rows: Annotated[int, Ge(1), Le(4096)]
    pitch: PositiveMetres
    """Distance between neighbours in a row and in a column."""
    face: NonNegativeMetres | None = None
    """Side of the square face of an element; the pitch if left out, 0 for point hydrophones."""
    mask: tuple[str, ...] | None = None
    """One text a row, top first, '#' for an element and '.' for none."""
    dead: tuple[int, ...] = ()
    """Numbers of elements that give nothing."""

    @model_validator(mode="after")
    def _check(self) -> PlanarLattice:
        if self.mask is not None:
            if len(self.mask) != self.rows or any(len(row) != self.columns for row in self.mask):
                raise ValueError(f"mask must have {self.rows} rows of {self.columns} characters")
            if set("".join(self.mask)) - set("#."):
                raise ValueError("mask may hold only '#' (element) and '.' (none)")
            if "#" not in "".join(self.mask):
                raise ValueError("mask leaves no element")
        return self


@description
class Romanis:
    """The 508-element, 1.3 m array of the thesis (ROMANIS, National University of Singapore), as a named default.

    Published: 508 square faces of 49.53 mm in a disc; the layout within the disc is ours (`ROMANIS_ROWS`).
    """

    kind: Literal["romanis"] = "romanis"
    pitch: PositiveMetres = 49.53e-3
    face: NonNegativeMetres = 49.53e-3
    dead: tuple[int, ...] = ()


@description
class PositionTable:
    """Elements at any positions in the sonar frame, all facing x, numbered as listed."""

    kind: Literal["position_table"] = "position_table"
    positions: Annotated[tuple[Position, ...], MinLen(1)]
    face: NonNegativeMetres = 0.0
    dead: tuple[int, ...] = ()


Array = Annotated[PlanarLattice | Romanis | PositionTable, BY_KIND]


@dataclass(frozen=True, eq=False)
class Elements:
    """The elements of an array, in its documented order; sonar frame."""

    position: Floats  # (sensor, xyz) m
    gain: Floats  # (sensor,) 1, or 0 for a dead element
    face: float  # m: side of the square face, 0 for points
    pitch: float  # m: of the lattice; 0 where there is none
    column: Ints  # (sensor,) lattice column, 0 at port (+y); -1 where there is no lattice
    row: Ints  # (sensor,) lattice row, 0 at the top (+z)
    columns: int
    rows: int

    @property
    def count(self) -> int:
        """Number of elements, dead ones too."""
        return len(self.gain)

    @property
    def on_lattice(self) -> bool:
        """Whether the elements lie on a regular lattice."""
        return self.pitch > 0

    @cached_property
    def aperture(self) -> float:
        """Largest distance of an element from the array centre (m)."""
        return float(np.linalg.norm(self.position, axis=1).max())


def _mask(array: PlanarLattice | Romanis) -> np.ndarray:
    if isinstance(array, Romanis):
        columns = max(ROMANIS_ROWS)
        return np.array([[2 * abs(i - (columns - 1) / 2) < width for i in range(columns)] for width in ROMANIS_ROWS])
    if array.mask is None:
        return np.ones((array.rows, array.columns), bool)
    return np.array([[c == "#" for c in row] for row in array.mask])


@lru_cache(maxsize=16)
def elements(array: Array) -> Elements:
    """The elements that an array describes. Raises ValueError when `dead` names an element that is not there."""
    if isinstance(array, PositionTable):
        position = np.array(array.positions, float)
        face, pitch, rows, columns = array.face, 0.0, 0, 0
        row = column = np.full(len(position), -1)
    else:
        mask = _mask(array)
        rows, columns = mask.shape
        row, column = np.nonzero(mask)
        pitch = array.pitch
        face = array.pitch if array.face is None else array.face
        y = ((columns - 1) / 2 - column) * pitch
        z = ((rows - 1) / 2 - row) * pitch
        position = np.stack([np.zeros_like(y), y, z], axis=1)
    gain = np.ones(len(position))
    if any(not 0 <= d < len(gain) for d in array.dead):
        raise ValueError(f"dead names an element outside 0..{len(gain) - 1}")
    gain[list(array.dead)] = 0.0
    return Elements(position, gain, float(face), float(pitch), column, row, columns, rows)


@description
class Band:
    """The band that the sonar works in: the bins that are beamformed, located and ranged."""

    low: PositiveHertz
    high: PositiveHertz

    @field_validator("high")
    @classmethod
    def _check_high(cls, value: float, info: ValidationInfo) -> float:
        return above_low(value, info)

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
    attenuation: Annotated[Decibels, Ge(21), Le(160)] = 80.0


@description
class BandPass:
    """Linear-phase band-pass FIR filter (Kaiser window), zero delay."""

    kind: Literal["band_pass"] = "band_pass"
    low: PositiveHertz
    high: PositiveHertz
    transition: Transition = 5e3
    attenuation: Annotated[Decibels, Ge(21), Le(160)] = 80.0

    @field_validator("high")
    @classmethod
    def _check_high(cls, value: float, info: ValidationInfo) -> float:
        return above_low(value, info)


Filter = Annotated[LowPass | BandPass, BY_KIND]


@description
class Converter:
    """Analogue to digital: pressure is stored as a whole number of counts."""

    bits: Annotated[int, Ge(2), Le(24)] = 16
    full_scale: Annotated[Pascals, Ge(1e-9), Le(1e12)]
    """Largest pressure (Pa): counts run over +-full_scale; louder samples are clipped, and counted."""

    @property
    def quantum(self) -> float:
        """Pressure of one count (Pa)."""
        return float(self.full_scale / 2 ** (self.bits - 1))


@description
class BeamGrid:
    """Steered directions: a grid symmetric about the acoustic axis, ascending in azimuth and in elevation."""

    azimuth_span: Annotated[PositiveRadians, Lt(np.pi)] = np.deg2rad(50.0)
    azimuths: Annotated[int, Ge(1), Le(2001)] = 101
    elevation_span: Annotated[PositiveRadians, Lt(np.pi)] = np.deg2rad(50.0)
    elevations: Annotated[int, Ge(1), Le(2001)] = 101

    @property
    def azimuth(self) -> Floats:
        """(azimuth,) rad, port positive."""
        return _symmetric(self.azimuth_span, self.azimuths)

    @property
    def elevation(self) -> Floats:
        """(elevation,) rad, up positive."""
        return _symmetric(self.elevation_span, self.elevations)


def above_low(value: float, info: ValidationInfo) -> float:
    """Validate the upper edge of a band against its lower one."""
    if value <= info.data.get("low", 0.0):
        raise ValueError(f"must be above low ({info.data['low']:g} Hz)")
    return value


def _symmetric(span: float, count: int) -> Floats:
    """Exactly antisymmetric grid: kernels that use x -> -x rely on it."""
    if count == 1:
        return np.zeros(1)
    return np.asarray((2.0 * np.arange(count) - (count - 1)) * (0.5 * span / (count - 1)), float)


@description
class Sonar:
    """A passive sonar."""

    array: Array = Romanis()
    band: Band = Band(low=25e3, high=85e3)
    filter: Filter | None = None
    """Anti-alias filter before sampling; left out: a `BandPass` of the band."""
    sampling_frequency: Annotated[PositiveHertz, Le(100e6)] = 196e3
    converter: Converter | None = None
    """Left out: pressure is stored as float32."""
    beams: BeamGrid = BeamGrid()
    assumed_sound_speed: Annotated[PositiveSpeed, Ge(100.0), Le(10e3)] = 1540.0
    """The sound speed that the sonar uses to steer and to range."""
    sound_speed_error: Annotated[MetresPerSecond, Ge(0)] = 1.0
    """Standard error that the sonar ascribes to it: enters the predicted errors only."""
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
        if edge <= band.low or (isinstance(chosen, BandPass) and chosen.low - 0.5 * chosen.transition >= band.high):
            raise ValueError(f"nothing to sample: the filter stops the whole band ({band.low:g} to {band.high:g} Hz)")
        if value < 2 * edge:
            raise ValueError(f"{value:g} Hz is under twice the filter's stop edge ({edge:g} Hz)")
        return value

    @property
    def antialias(self) -> Filter:
        """The filter before sampling."""
        if self.filter is not None:
            return self.filter
        return BandPass(low=self.band.low, high=self.band.high)


def stop_frequency(filter: Filter) -> float:
    """Where the stop band begins (Hz)."""
    edge = filter.cutoff if isinstance(filter, LowPass) else filter.high
    return edge + 0.5 * filter.transition
