"""How facets scatter: amplitude and shape of the pulse, by each law. `Scattering` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.scattering.components import Component
from sonarsynth.scattering.facet_law import FacetLaw
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.scattering.kirchhoff import Kirchhoff
from sonarsynth.scattering.kirchhoff_surface import PartlyReflecting
from sonarsynth.scattering.law_validity import Scatterer
from sonarsynth.scattering.mirror_lobe import MirrorLobe
from sonarsynth.scattering.scatterers import PointScatterer, Scatterers

Scattering = Annotated[MirrorLobe | Isotropic | Kirchhoff, BY_KIND]
"""Laws of scattering."""

__all__ = [
    "Component",
    "FacetLaw",
    "Isotropic",
    "Kirchhoff",
    "MirrorLobe",
    "PartlyReflecting",
    "PointScatterer",
    "Scatterer",
    "Scatterers",
    "Scattering",
]
