"""Straight rays where they are exact, else refracted ones."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.environment.sea import Profile
from sonarsynth.products import Paths
from sonarsynth.propagation.bounces import Bounces
from sonarsynth.propagation.refracted import Refracted
from sonarsynth.propagation.straight import Straight


@description
class AutoTracing:
    """`Straight` where the sound speed is uniform, else `Refracted`."""

    kind: Literal["auto"] = "auto"
    bounces: Bounces = 0
    """Most reflections from surface and bottom on the way from the snap to the array."""

    @property
    def bends(self) -> bool:
        """Whether rays bend where the sound speed varies."""
        return True

    def resolve(self, profile: Profile) -> Straight | Refracted:
        """The model chosen."""
        return Straight(bounces=self.bounces) if profile.uniform else Refracted(bounces=self.bounces)

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """Paths of the model chosen; arguments and errors as in `Propagation`."""
        return self.resolve(profile).connect(profile, environment_depth, start, end)
