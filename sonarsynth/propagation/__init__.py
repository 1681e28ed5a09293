"""How sound travels: propagation models that join points by rays, and what is traced with them.

`Tracing` is the registry of models; `arrivals.trace` gives the arrivals of a frame, `ray_fan.fan` follows
rays wherever they go.
"""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.propagation.auto_propagation import AutoTracing
from sonarsynth.propagation.path_model import PathModel
from sonarsynth.propagation.refracted import Refracted
from sonarsynth.propagation.straight import Straight

Propagation = PathModel
"""A model of how sound travels between two points."""

Tracing = Annotated[Straight | Refracted | AutoTracing, BY_KIND]

__all__ = ["AutoTracing", "PathModel", "Propagation", "Refracted", "Straight", "Tracing"]
