"""The closed form where it is right, else placing along rays."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.ranging.placing.isovelocity_placing import IsovelocityPlacing
from sonarsynth.ranging.placing.refracted_placing import RefractedPlacing
from sonarsynth.ranging.placing.solution import Solution
from sonarsynth.receiver import Sonar


@description
class AutoPlacing(Method):
    """`IsovelocityPlacing` where it errs by less than the accuracy of the recipe allows, else `RefractedPlacing`."""

    kind: Literal["auto"] = "auto"

    def resolve(self, demand: Demand) -> tuple[IsovelocityPlacing | RefractedPlacing, float]:
        """The closed form where bent rays make its ranges wrong by no more than is allowed (m)."""
        straight, error = IsovelocityPlacing().resolve(demand)
        if error > (0.0 if demand.exact else demand.allowed):
            return self.exact(), 0.0
        return straight, error

    def exact(self) -> RefractedPlacing:
        """Along rays."""
        return RefractedPlacing()

    def place(
        self, delay: Floats, beam: Floats, source: Floats, sonar: Sonar, sonar_pose: Pose, profile: Profile
    ) -> Solution:
        """See `PlacingMethod`. With no plan: the closed form where the sound speed is the assumed one everywhere."""
        straight = profile.uniform and profile.speed[0] == sonar.assumed_sound_speed
        method = IsovelocityPlacing() if straight else self.exact()
        return method.place(delay, beam, source, sonar, sonar_pose, profile)
