"""Nets, and chains: knots in rows."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Metres, Position
from sonarsynth.description import description
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.scattering import PointScatterer, Scatterers


@description
class Net(ScatteringField):
    """Knots of a net in rows and columns, each a point that sends the same way in all directions and in phase: seen
    along its normal it glints as a mirror does. With one column it is a chain of links, with one row a rope of floats.
    It stays where it is and hides nothing."""

    kind: Literal["net"] = "net"
    corner: Position
    """East, north and up (negative) of its first knot."""
    along: tuple[Metres, Metres, Metres] = (1.0, 0.0, 0.0)
    """From there to the last knot of the first row."""
    down: tuple[Metres, Metres, Metres] = (0.0, 0.0, -1.0)
    """From there to the first knot of the last row."""
    columns: Annotated[int, Ge(1), Le(1000)] = 1
    """Knots in a row."""
    rows: Annotated[int, Ge(1), Le(1000)] = 20
    """Rows of knots."""
    strength: Annotated[Decibels, Ge(-120), Le(0)] = -50.0
    """Target strength of each knot (dB re 1 m2): 20 lg of half its radius (m), if it is hard and round."""

    @property
    def count(self) -> int:
        """As `ScatteringField.count`."""
        return self.columns * self.rows

    def scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """As `ScatteringField.scatterers`. Raises ValueError where a knot is out of the water."""
        across, deep = np.meshgrid(np.linspace(0.0, 1.0, self.columns), np.linspace(0.0, 1.0, self.rows))
        position = np.array(self.corner) + across.reshape(-1, 1) * self.along + deep.reshape(-1, 1) * self.down
        if position[:, 2].max() >= 0.0 or position[:, 2].min() < -bottom:
            raise ValueError(f"a net from z {position[:, 2].min():g} to {position[:, 2].max():g} m is out of the water")
        return Scatterers(
            owner="volume",
            law=PointScatterer(10.0 ** (self.strength / 20.0)),
            position=position,
            normal=np.zeros((self.count, 3)),
            area=np.ones(self.count),
            sign=np.ones(self.count),
        )
