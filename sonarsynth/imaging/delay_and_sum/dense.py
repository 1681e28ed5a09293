"""Delay and sum, every sensor in every beam: any array, exact, slow. The check of the fast ones."""

from __future__ import annotations

from typing import ClassVar, Literal

from sonarsynth.conventions import PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand
from sonarsynth.imaging.image_window import Shading
from sonarsynth.imaging.steering import Steering


@description
class DenseDelayAndSum(Steering):
    """Delay and sum for any array, with the exact spherical delay to the focus in every direction.

    Float32 sums: error 2e-6 of the largest beam at a frequency.
    """

    separable: ClassVar[bool] = False
    kind: Literal["dense"] = "dense"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""

    def resolve(self, demand: Demand) -> tuple[DenseDelayAndSum, float]:
        """Itself: exact."""
        return self, 0.0
