"""What a law of a boundary says of itself: one that is added needs no more than `strength`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Method, returned
from sonarsynth.equations.reverberation.bottom_strength import Angles


@dataclass(frozen=True, eq=False)
class BoundarySite:
    """A boundary, and the sound that it scatters."""

    frequency: float  # Hz
    wavenumber: float  # rad/m in the water at the boundary
    mirrored: Callable[[Floats], Floats]  # modulus of the reflection coefficient (...) at grazing angles (...) in rad
    wind_speed: float | None = None  # m/s
    rms_height: float = 0.0  # m
    sediment: str | None = None  # name, where the boundary is described by one


class BoundaryLaw(Method):
    """How much a boundary scatters, in all directions."""

    def strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """Cross-section (...) per m2 and sr. Raises ValueError in one line where the site is not what it needs."""
        raise NotImplementedError(f"{type(self).__name__} has no strength")

    def checked_strength(self, angles: Angles, site: BoundarySite) -> Floats:
        """What `strength` returns, once it is of each pair of angles."""
        return np.asarray(returned(self, "strength", self.strength(angles, site), np.shape(angles.sine_in)))
