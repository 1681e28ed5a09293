"""What makes sound, and what that is like at 1 m. `Source` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.sources.shrimp import SnappingShrimp

Source = Annotated[SnappingShrimp, BY_KIND]
"""What makes sound, by `kind`."""
