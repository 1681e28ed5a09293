"""Fish, or bubbles, in a cloud of their own."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Position, PositiveMetres
from sonarsynth.description import description
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.scattering import PointScatterer, Scatterers

LEAST = 1e-6
"""Of half its height: what must be in the water of a swarm, for places in less have no digits."""


@description
class Swarm(ScatteringField):
    """Alike scatterers spread evenly in an ellipsoid, or as much of it as is in the water: a school of fish, a cloud of
    bubbles. Each has a random sign and sends the same way in all directions; they stay where they are, hide nothing,
    and do not absorb.

    A fish of 20 cm has about -40 dB at its side, -45 dB on average. Source: Love (1977), J. Acoust. Soc. Am. 62, 1397.
    """

    kind: Literal["swarm"] = "swarm"
    centre: Position
    """East, north and up (negative) of its middle."""
    axes: tuple[PositiveMetres, PositiveMetres, PositiveMetres] = (1.0, 1.0, 0.5)
    """Half its size to east, north and up."""
    members: Annotated[int, Ge(1), Le(100_000)] = 200
    """How many there are."""
    strength: Annotated[Decibels, Ge(-120), Le(0)] = -45.0
    """Target strength of each (dB re 1 m2)."""

    @property
    def count(self) -> int:
        """As `ScatteringField.count`."""
        return self.members

    def scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """As `ScatteringField.scatterers`. Raises ValueError where none of it is in the water."""
        _, _, up = self.centre
        low, high = np.clip([(-bottom - up) / self.axes[2], -up / self.axes[2]], -1.0, 1.0)  # of it in the water
        if high - low < LEAST:
            raise ValueError(f"a swarm at z {up:g} m is out of the water, which is {bottom:g} m deep")
        wide = np.sqrt(1.0 - np.clip(0.0, low, high) ** 2)
        middle, size = np.array([0.0, 0.0, 0.5 * (low + high)]), np.array([wide, wide, 0.5 * (high - low)])
        position = np.zeros((0, 3))
        while len(position) < self.members:
            drawn = random.uniform(-1.0, 1.0, (4 * self.members, 3)) * size + middle
            drawn = drawn[np.sum(drawn**2, axis=1) < 1.0] * self.axes + self.centre
            position = np.concatenate([position, drawn[(drawn[:, 2] < 0.0) & (drawn[:, 2] > -bottom)]])
        return Scatterers(
            owner="volume",
            law=PointScatterer(10.0 ** (self.strength / 20.0)),
            position=position[: self.members],
            normal=np.zeros((self.members, 3)),
            area=np.ones(self.members),
            sign=random.choice([-1.0, 1.0], self.members),
        )
