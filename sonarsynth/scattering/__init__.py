"""How facets scatter: amplitude and shape of the pulse, by each law. `Scattering` is the registry."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.scattering.kirchhoff import Kirchhoff, PartlyReflecting
from sonarsynth.scattering.mirror_lobe import MirrorLobe
from sonarsynth.scattering.parts import Part


class ScatteringLaw(Protocol):
    """A law of scattering by facets."""

    @property
    def parts(self) -> tuple[Part, ...]:
        """What an echo is made of, each a path of its own (`scattering.parts`)."""
        ...


Scattering = Annotated[MirrorLobe | Isotropic | Kirchhoff, BY_KIND]
"""Laws of scattering."""

__all__ = ["Isotropic", "Kirchhoff", "MirrorLobe", "Part", "PartlyReflecting", "Scattering", "ScatteringLaw"]
