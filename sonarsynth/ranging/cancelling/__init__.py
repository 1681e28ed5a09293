"""Taking the direct pulse and its reflections out of the signals. `Cancelling` is the registry."""

from __future__ import annotations

from typing import Annotated

from sonarsynth.description import BY_KIND
from sonarsynth.ranging.cancelling.reflection_cancelling import WavefrontCancelling

Cancelling = Annotated[WavefrontCancelling, BY_KIND]
"""Methods that cancel reflections, by `kind`."""
