"""Stones that lie on the bottom."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import MaxLen, MinLen

from sonarsynth.conventions import Metres, PositiveMetres
from sonarsynth.description import description
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.scattering import PointScatterer, Scatterers


@description
class Stones(ScatteringField):
    """Hard round stones of one size: point echoes of amplitude radius/2, that of a large sphere, with random signs.

    They hide nothing. Source: Urick (1983), Principles of
    Underwater Sound, section 9.3.
    """

    kind: Literal["stones"] = "stones"
    positions: Annotated[tuple[tuple[Metres, Metres], ...], MinLen(1), MaxLen(100_000)]
    """East and north of each; `{table: stones.csv}` reads them from a table with columns x and y."""
    radius: PositiveMetres = 0.1
    """Radius of each stone."""

    @property
    def count(self) -> int:
        """As `ScatteringField.count`."""
        return len(self.positions)

    def scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """As `ScatteringField.scatterers`."""
        position = np.array(self.positions)
        return Scatterers(
            owner="bottom",
            law=PointScatterer(0.5 * self.radius),
            position=np.column_stack([position, np.full(self.count, self.radius - bottom)]),
            normal=np.zeros((self.count, 3)),
            area=np.full(self.count, np.pi * self.radius**2),
            sign=random.choice([-1.0, 1.0], self.count),
        )
