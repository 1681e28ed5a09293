"""How facets scatter: amplitude and shape of the pulse, by each law. `Scattering` is the registry."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.scattering.components import Component
from sonarsynth.scattering.isotropic import Isotropic
from sonarsynth.scattering.kirchhoff import Kirchhoff
from sonarsynth.scattering.kirchhoff_surface import PartlyReflecting
from sonarsynth.scattering.law_validity import Scatterer
from sonarsynth.scattering.mirror_lobe import MirrorLobe


class ScatteringLaw(Protocol):
    """A law of scattering by facets."""

    @property
    def kind(self) -> str:
        """Its name in recipes."""
        ...

    @property
    def parts(self) -> tuple[Component, ...]:
        """What an echo is made of, each a path of its own (`scattering.components`)."""
        ...

    @property
    def coherent(self) -> bool:
        """Whether the echoes of facets add with their phases."""
        ...

    def too_small(self, body: Scatterer) -> str | None:
        """One line if the body is too small against the wavelengths for this law, and by how many dB; None if not."""
        ...

    def validity(self, body: Scatterer) -> tuple[str, ...]:
        """Where this law does not hold for a body in a band, one line each: ka, facets against the wavelength, angles.

        `plan` says these, and the store has them (root attribute `validity`).
        """
        ...


Scattering = Annotated[MirrorLobe | Isotropic | Kirchhoff, BY_KIND]
"""Laws of scattering."""

__all__ = [
    "Component",
    "Isotropic",
    "Kirchhoff",
    "MirrorLobe",
    "PartlyReflecting",
    "Scatterer",
    "Scattering",
    "ScatteringLaw",
]
