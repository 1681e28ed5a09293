"""How a facet scatters: the far-field amplitude of each law. `Scattering` is the registry."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.conventions import Floats
from sonarsynth.description import BY_KIND
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.scattering.kirchhoff import Kirchhoff, PartlyReflecting
from sonarsynth.scattering.mirror_lobe import MirrorLobe
from sonarsynth.world.meshes import Mesh


class ScatteringLaw(Protocol):
    """A law of scattering by one facet."""

    def amplitude(self, incident: Floats, scattered: Floats, normal: Floats, area: Floats) -> Floats:
        """Far-field scattering amplitude f (...) in m: pressure f/r at r from a facet in a wave of unit pressure.

        incident, scattered: unit vectors of propagation (..., xyz), in and away; normal: outward unit normals
        (..., xyz); area: m2 (...); broadcast together. 0 where the facet is not lit (n.incident >= 0) or not seen
        (n.scattered <= 0).
        """
        ...

    def polarity(self, mesh: Mesh) -> Floats:
        """Sign (facet,) of the echo of each facet: f is the amplitude times it."""
        ...


Scattering = Annotated[MirrorLobe | Isotropic, BY_KIND]
"""Laws of echoes in a frame."""

StrengthLaw = Annotated[Kirchhoff | MirrorLobe | Isotropic, BY_KIND]
"""Laws of target strength."""

__all__ = ["Isotropic", "Kirchhoff", "MirrorLobe", "PartlyReflecting", "Scattering", "ScatteringLaw", "StrengthLaw"]
