"""How many reflections a propagation model follows."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le

MOST_BOUNCES = 8

Bounces = Annotated[int, Ge(0), Le(MOST_BOUNCES)]
"""Most reflections from surface and bottom together; 0: the direct family alone. Ways that coincide, from a snap
exactly on the bottom and from its image there, are one, and count as the one with fewer reflections."""
