"""What makes sound, and what that is like at 1 m. `Source` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.sources.shrimp import SnappingShrimp
from sonarsynth.sources.transmitter import Transmitter

Source = Annotated[SnappingShrimp | Transmitter, BY_KIND]
"""What makes sound, by `kind`."""
