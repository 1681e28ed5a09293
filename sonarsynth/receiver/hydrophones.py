"""Arrays of hydrophones: what people write, and the elements that it means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le, MinLen
from pydantic import model_validator

from sonarsynth.conventions import Floats, Ints, NonNegativeMetres, Position, PositiveMetres
from sonarsynth.description import BY_KIND, description

ROMANIS_ROWS = (4, 10, 14, 18, 20, 20, 22, 22, 24, 24, 24, 26, 26, 26, 26, 24, 24, 24, 22, 22, 20, 20, 18, 14, 10, 4)
"""Elements in each row of the 508-element disc: 500 cells centred on a corner, and the octet (9.5, 8.5), (8.5, 9.5)."""


MOST_PLACES = 100_000
"""Of a lattice."""
CLOSEST = 1e-9
"""m: hydrophones that span less, and are not at one place, differ by less than paths can be told apart."""
Pitch = Annotated[PositiveMetres, Ge(CLOSEST)]


@description
class PlanarLattice:
    """Elements on a regular lattice in the plane x = 0, facing x, centred on the origin.

    Numbered as read in a picture that the sonar looks at: rows from the top (+z) down, in a row from port (+y) to
    starboard; masked places are skipped.
    """

    kind: Literal["planar_lattice"] = "planar_lattice"
    columns: Annotated[int, Ge(1), Le(4096)]
    """Places in a row, from port to starboard."""
    rows: Annotated[int, Ge(1), Le(4096)]
    """Rows, from top to bottom."""
    pitch: Pitch
    """Distance between neighbours in a row and in a column."""
    face: NonNegativeMetres | None = None
    """Side of the square face of an element; the pitch if left out, 0 for point hydrophones."""
    mask: tuple[str, ...] | None = None
    """One text a row, top first, '#' for an element and '.' for none."""
    dead: tuple[int, ...] = ()
    """Numbers of elements that give nothing."""

    @model_validator(mode="after")
    def _check(self) -> PlanarLattice:
        if self.columns * self.rows > MOST_PLACES:
            raise ValueError(f"has {self.columns * self.rows} places, more than {MOST_PLACES}")
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
    pitch: Pitch = 49.53e-3
    """Distance between neighbours in a row and in a column."""
    face: NonNegativeMetres = 49.53e-3
    """Side of the square face of an element, 0 for point hydrophones."""
    dead: tuple[int, ...] = ()
    """Numbers of elements that give nothing."""


@description
class PositionTable:
    """Elements at any positions in the sonar frame, all facing x, numbered as listed."""

    kind: Literal["position_table"] = "position_table"
    positions: Annotated[tuple[Position, ...], MinLen(1)]
    """Positions (x, y, z) of the elements; `{table: array.csv}` reads them from a table with these columns, of m or
    with a unit: `x [mm]`."""
    face: NonNegativeMetres = 0.0
    """Side of the square face of an element, 0 for point hydrophones."""
    dead: tuple[int, ...] = ()
    """Numbers of elements that give nothing."""

    @model_validator(mode="after")
    def _check(self) -> PositionTable:
        span = float(np.ptp(np.array(self.positions), axis=0).max())
        if 0.0 < span < CLOSEST:
            raise ValueError(f"positions span {span:g} m: they must be one place, or span {CLOSEST:g} m or more")
        return self


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

    def select(self, sensor: Ints | slice) -> Elements:
        """Some of them (element,), where they are."""
        columns = {name: getattr(self, name)[sensor] for name in ("position", "gain", "column", "row")}
        return replace(self, **columns)

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
    if beyond := [d for d in array.dead if not 0 <= d < len(gain)]:
        raise ValueError(f"dead: there is no hydrophone {beyond[0]}; they are 0 to {len(gain) - 1}")
    gain[list(array.dead)] = 0.0
    return Elements(position, gain, float(face), float(pitch), column, row, columns, rows)


POINT = elements(PositionTable(positions=((0.0, 0.0, 0.0),)))
"""A point hydrophone of gain 1 in the middle of its array."""
