"""What scatters sound and belongs to no body: bottom, stones, nets, fish, bubbles. `ScattererField` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.environment.scatterers.bottom_patch import BottomPatch
from sonarsynth.environment.scatterers.net import Net
from sonarsynth.environment.scatterers.scattering_field import ScatteringField
from sonarsynth.environment.scatterers.stones import Stones
from sonarsynth.environment.scatterers.swarm import Swarm

ScattererField = Annotated[BottomPatch | Net | Stones | Swarm, BY_KIND]
"""Scatterers without a body, by `kind`."""

__all__ = ["BottomPatch", "Net", "ScattererField", "ScatteringField", "Stones", "Swarm"]
