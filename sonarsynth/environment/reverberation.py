"""What people write of reverberation: what bottom, surface and water scatter."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Decibels, Number, PositiveMetres
from sonarsynth.description import description
from sonarsynth.scattering.boundaries import BoundaryScattering, RoughSediment, WindySurface


@description
class Reverberation:
    """Sound of the snaps that light, scattered by bottom, surface and water: by scatterers that stay where they are in
    the world, one path each. Targets cast shadows with sharp edges; scatterers hide nothing."""

    bottom: BoundaryScattering | None = RoughSediment()
    """How the bottom scatters; none: not at all."""
    surface: BoundaryScattering | None = WindySurface()
    """How the surface scatters: by wind, nothing where the sea is smooth; none: not at all."""
    volume: Annotated[Decibels, Ge(-150), Le(-20)] | None = None
    """Scattering strength of the water (dB re 1/m): about -90 to -70 near coasts, -60 among fish or bubbles; left out:
    none."""
    bounces: Annotated[int, Ge(0), Le(4)] = 1
    """Mirror reflections at surface and bottom that are followed beside, on the way out and back together."""
    patchiness: Annotated[Number, Gt(0), Le(1e3)] | None = None
    """Shape of the gamma law of the strength of patches: 1 to 20 at sonars of high resolution, 0.5 to 3 of rock and
    ripples; left out: all alike."""
    patch: Annotated[PositiveMetres, Ge(0.05), Le(1e3)] = 1.0
    """Side of a patch."""

    @property
    def owners(self) -> tuple[str, ...]:
        """What scatters."""
        laws = {"bottom": self.bottom, "surface": self.surface, "volume": self.volume}
        return tuple(name for name, law in laws.items() if law is not None)

    def row(self) -> str:
        """What `plan` shows of it."""
        words = [f"{name} by {law.row()}" for name, law in self._laws]
        words += [] if self.volume is None else [f"volume {self.volume:g} dB"]
        words += [] if self.patchiness is None else [f"patches of shape {self.patchiness:g}"]
        return ", ".join(words)

    @property
    def _laws(self) -> list[tuple[str, BoundaryScattering]]:
        both = (("bottom", self.bottom), ("surface", self.surface))
        return [(name, law) for name, law in both if law is not None]
