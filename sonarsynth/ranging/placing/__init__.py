"""Placing: from the delay and the direction of an echo to where it was made."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.conventions import Floats
from sonarsynth.description import BY_KIND
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.ranging.placing.auto_placing import AutoPlacing
from sonarsynth.ranging.placing.isovelocity_placing import IsovelocityPlacing
from sonarsynth.ranging.placing.refracted_placing import RefractedPlacing
from sonarsynth.ranging.placing.solution import Solution
from sonarsynth.receiver import Sonar

__all__ = ["AutoPlacing", "IsovelocityPlacing", "Placing", "PlacingMethod", "RefractedPlacing"]


class PlacingMethod(Protocol):
    """Places echoes in space."""

    def place(
        self, delay: Floats, beam: Floats, source: Floats, sonar: Sonar, sonar_pose: Pose, profile: Profile
    ) -> Solution:
        """Where echoes come from that arrive `delay` (echo,) s after the direct pulse, from `beam` (echo, xyz).

        source (xyz) m: the located snap; unit vectors and places in the sonar frame. profile: the sound speed of the
        water, for methods that trace rays and were given none of their own.
        """


Placing = Annotated[AutoPlacing | IsovelocityPlacing | RefractedPlacing, BY_KIND]
