"""What scatterers without a body say of themselves: a kind that is added needs `count` and `scatterers`."""

from __future__ import annotations

import numpy as np

from sonarsynth.description.method import Method, returned_rows
from sonarsynth.scattering import Scatterers


class ScatteringField(Method):
    """Scatterers at rest in the world: the same in every frame of a sequence."""

    @property
    def count(self) -> int:
        """How many there are."""
        raise NotImplementedError(f"{type(self).__name__} does not say how many scatterers it has")

    def scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """All of them; bottom: its depth in m, positive down; random: a stream of their own in each sequence."""
        raise NotImplementedError(f"{type(self).__name__} has no scatterers")

    def checked_scatterers(self, bottom: float, random: np.random.Generator) -> Scatterers:
        """What `scatterers` returns, once it has the shape of that."""
        made, known = self.scatterers(bottom, random), ("position", "normal", "area", "sign")
        wide = {"position": (3,), "normal": (3,)}
        loose: Scatterers = returned_rows(self, "scatterers", made, Scatterers, "area", known, wide)
        return loose

    def row(self) -> str:
        """As `Method.row`: with their number."""
        return f"{self.count} scatterers of {self.kind}"
