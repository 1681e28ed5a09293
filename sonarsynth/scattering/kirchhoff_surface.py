"""What the parts of Kirchhoff's law need to know of a surface, and how it reflects."""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Bools, Floats, Number
from sonarsynth.description import description
from sonarsynth.equations.scattering.kirchhoff_integral import local_grazing
from sonarsynth.equations.water.boundary_reflection import rayleigh


@description
class PartlyReflecting:
    """The surface of a fluid body so thick that nothing returns from inside: Rayleigh's coefficient at each angle."""

    kind: Literal["partly_reflecting"] = "partly_reflecting"
    density_ratio: Annotated[Number, Ge(1e-9), Le(1e9)]
    """Density over that of the water."""
    speed_ratio: Annotated[Number, Ge(1e-9), Le(1e9)]
    """Sound speed over that of the water."""
    loss_tangent: Annotated[Number, Ge(0), Le(1)] = 0.0
    """Imaginary over real part of the wavenumber in the body."""


class KirchhoffSurface(Protocol):
    """What the parts of the Kirchhoff law need to know of a surface; as `Kirchhoff` says."""

    @property
    def surface(self) -> Literal["rigid", "soft"] | PartlyReflecting:
        """What reflects."""
        ...

    @property
    def roughness(self) -> float:
        """Rms height (m)."""
        ...

    @property
    def slope(self) -> float:
        """Rms slope."""
        ...

    @property
    def diffuse(self) -> float:
        """Share that is scattered by Lambert's law."""
        ...

    def lit(self, incident: Floats, scattered: Floats, normal: Floats, curved: Bools) -> Floats:
        """Factor on the amplitude."""
        ...


def reflection(law: KirchhoffSurface, incident: Floats, scattered: Floats) -> np.ndarray:
    """Plane-wave coefficient V (...) of facets that would mirror one way into the other: reciprocal."""
    surface = law.surface
    if isinstance(surface, str):
        return np.asarray(1.0 + 0.0j if surface == "rigid" else -1.0 + 0.0j)
    grazing = local_grazing(incident, scattered)
    return rayleigh(grazing, surface.density_ratio, surface.speed_ratio, surface.loss_tangent)
