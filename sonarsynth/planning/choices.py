"""The choices of a plan: what was left to the planner, made concrete."""

from __future__ import annotations

from typing import Annotated, Any

from annotated_types import Ge, Lt
from pydantic import TypeAdapter

from sonarsynth.conventions import Number
from sonarsynth.description import description
from sonarsynth.imaging import Beamformer, FocusedDelayAndSum
from sonarsynth.ranging import IsovelocityPlacing, Peaks, Picking, Placing
from sonarsynth.signals import GriddedSynthesis, Synthesis
from sonarsynth.state import OcclusionPoint

PRODUCTS = ("signals", "image", "cloud")
"""What a build makes where nothing else is asked for. Truth is always written; with any product, levels of what is
traced too."""
ALL_PRODUCTS = (*PRODUCTS, "beams", "range_image", "paths")
"""What a build can be asked for."""
OF_BEAMS = frozenset({"image", "cloud", "beams", "range_image"})
"""Products that the signals are steered for."""
OWN_VIEW = 5e-3
"""Error of signals under which each hydrophone sees the targets by itself: what is hidden from a few of them alone, in
a few frames, was seen to err by 2.5e-3 to 5.6e-3 at the worst, and no few frames at a few hydrophones tell."""


@description
class Choices:
    """Methods and their settings, the same for every frame of a dataset. The arrays of a store follow from the recipe
    and these alone."""

    subarrays: Annotated[int, Ge(1)] = 1
    """Parts that the array is cut into; as many as it has hydrophones: each is traced by itself."""
    occlusion: OcclusionPoint = "centre"
    """From where facets must be seen to be heard: from the middle of the array or part, or from each hydrophone."""
    negligible: Annotated[Number, Ge(0), Lt(1)] = 1e-7
    """Share of the power of a target's echo that its faintest paths may have, and be left out."""
    synthesis: Synthesis = GriddedSynthesis()
    beamforming: Beamformer = FocusedDelayAndSum()
    picking: Picking = Peaks()
    placing: Placing = IsovelocityPlacing()

    def as_json(self) -> dict[str, Any]:
        """The choices as plain JSON values."""
        value: dict[str, Any] = _CHOICES.dump_python(self, mode="json")
        return value


_CHOICES: TypeAdapter[Choices] = TypeAdapter(Choices)


def choices_from(value: object) -> Choices:
    """Choices from JSON values, as `Choices.as_json` gives them. Raises ValueError where they are none."""
    if isinstance(value, dict) and value.get("degree") == 3:  # of stores from before cubics were all that there is
        value = {k: v for k, v in value.items() if k != "degree"}
    return _CHOICES.validate_python(value)
