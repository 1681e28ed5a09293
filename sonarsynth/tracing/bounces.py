"""How many reflections a propagation model follows."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Le

Bounces = Annotated[int, Ge(0), Le(8)]
"""Most reflections from surface and bed together; 0: the direct family alone."""
