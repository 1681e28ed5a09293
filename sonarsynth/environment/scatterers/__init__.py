"""What scatters sound and belongs to no body: pieces of the bottom, stones on it. `ScattererField` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.environment.scatterers.bottom_patch import BottomPatch
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.environment.scatterers.stones import Stones

ScattererField = Annotated[BottomPatch | Stones, BY_KIND]
"""Scatterers without a body, by `kind`."""

__all__ = ["BottomPatch", "ScattererField", "ScatteringField", "Stones"]
