"""Targets: a named shape that moves."""

from __future__ import annotations

from typing import Annotated

from pydantic import StringConstraints

from sonarsynth.description import description
from sonarsynth.world.motion import Motion
from sonarsynth.world.shapes import Shape

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,63}$")]


@description
class Target:
    """A body in the water. Its name is a group of the store."""

    name: Name
    """Letters, digits, hyphens and underscores, a letter first."""
    shape: Shape
    """What it looks like."""
    motion: Motion
    """Where it is, at any time."""
