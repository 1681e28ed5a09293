"""Straight rays where they are exact, else refracted ones."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.products import Paths
from sonarsynth.tracing.refracted import Refracted
from sonarsynth.tracing.straight import Straight
from sonarsynth.world.environment import Profile

_STRAIGHT, _REFRACTED = Straight(), Refracted()


@description
class AutoTracing:
    """`Straight` where the sound speed is uniform, else `Refracted`."""

    kind: Literal["auto"] = "auto"

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """Paths of the model chosen; arguments and errors as in `Propagation`."""
        model = _STRAIGHT if profile.uniform else _REFRACTED
        return model.connect(profile, environment_depth, start, end)
