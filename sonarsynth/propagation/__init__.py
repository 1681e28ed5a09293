"""How sound travels: propagation models that join points by rays, and what is traced with them.

`Tracing` is the registry of models; `arrivals.trace` gives the arrivals of a frame, `ray_fan.fan` follows
rays wherever they go.
"""

from __future__ import annotations

from typing import Annotated, Literal, Protocol

from sonarsynth.conventions import Floats
from sonarsynth.description import BY_KIND
from sonarsynth.environment.sea import Profile
from sonarsynth.products import Paths
from sonarsynth.propagation.auto_propagation import AutoTracing
from sonarsynth.propagation.refracted import Refracted
from sonarsynth.propagation.straight import Straight

OcclusionPoint = Literal["centre", "sensors"]
"""From where facets are seen: the middle of the array or part, or each hydrophone for itself."""


class Propagation(Protocol):
    """A model of how sound travels between two points."""

    @property
    def bounces(self) -> int:
        """Most reflections from surface and bottom on the way from the snap to the array."""
        ...

    @property
    def bends(self) -> bool:
        """Whether rays bend where the sound speed varies."""
        ...

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """All paths with at most `bounces` reflections from start (pair, xyz) to end (pair, xyz) in the world.

        environment_depth: depth of the bottom in m.

        Raises ValueError for points outside the water or not finite.
        """
        ...


Tracing = Annotated[Straight | Refracted | AutoTracing, BY_KIND]

__all__ = ["AutoTracing", "Propagation", "Refracted", "Straight", "Tracing"]
