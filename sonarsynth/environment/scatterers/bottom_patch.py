"""A disc of the bottom that gives back sound by Lambert's law."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, Metres, PositiveMetres
from sonarsynth.description import description
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.scattering import MirrorLobe, Scatterers


@description
class BottomPatch(ScatteringField):
    """Pieces of the bottom of equal area at random places in a disc, each with a random sign.

    The power of a piece is area mu sin(grazing in) sin(grazing out), so that the expected sum over pieces is the
    integral over the disc, whatever their number: few of them make it rougher (relative variance 2/number that count).
    Source: Mackenzie (1961), J. Acoust. Soc. Am. 33, 1498, for mu of -27 dB; 6 to 9 dB more is usual of sand at 50 kHz.
    """

    kind: Literal["bottom_patch"] = "bottom_patch"
    centre: tuple[Metres, Metres]
    """Centre of the disc: east and north."""
    radius: PositiveMetres
    """Radius of the disc."""
    pieces: Annotated[int, Ge(1), Le(100_000)] = 1000
    """How many pieces the disc is cut into."""
    strength: Annotated[Decibels, Ge(-100), Le(-5)] = -27.0
    """10 log10 of mu; -5 dB gives back all that arrives."""

    @property
    def count(self) -> int:
        """As `ScatteringField.count`."""
        return self.pieces

    def scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """As `ScatteringField.scatterers`."""
        r, turn = self.radius * np.sqrt(random.random(self.pieces)), 2.0 * np.pi * random.random(self.pieces)
        east, north = self.centre
        down = np.full(self.pieces, -bottom)
        return Scatterers(
            owner="bottom",
            law=MirrorLobe(reflectivity=0.0, diffuse=np.pi * 10.0 ** (self.strength / 10.0)),
            position=np.stack([east + r * np.cos(turn), north + r * np.sin(turn), down], axis=1),
            normal=np.tile([0.0, 0.0, 1.0], (self.pieces, 1)),
            area=np.full(self.pieces, np.pi * self.radius**2 / self.pieces),
            sign=random.choice([-1.0, 1.0], self.pieces),
        )
