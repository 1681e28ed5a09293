"""Placing by the closed form for straight paths."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from sonarsynth.conventions import Floats, NonNegativeMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.ranging.placing.refracted_placing import RefractedPlacing
from sonarsynth.ranging.placing.solution import Solution, isovelocity_solution
from sonarsynth.receiver import Sonar


@description
class IsovelocityPlacing(Method):
    """Range by the closed form for straight paths at the assumed sound speed, from the delay after the direct arrival
    (`equations.arrays.bistatic_range`)."""

    kind: Literal["isovelocity"] = "isovelocity"
    bending_error: NonNegativeMetres | None = None
    """Standard error of its ranges in water that bends rays: enters the predicted errors only. Left out: the most that
    bending makes of it in frames of the recipe that are tried."""

    def resolve(self, demand: Demand) -> tuple[IsovelocityPlacing, float]:
        """With what bent rays make its ranges err by, where this is left out, and by how much (m) these are wrong."""
        bending = float(f"{demand.bending:.1e}") if self.bending_error is None else self.bending_error
        return replace(self, bending_error=bending), demand.error(self)

    def exact(self) -> RefractedPlacing:
        """Along rays."""
        return RefractedPlacing()

    def place(
        self, delay: Floats, beam: Floats, source: Floats, sonar: Sonar, sonar_pose: Pose, profile: Profile
    ) -> Solution:
        """See `PlacingMethod`."""
        solution = isovelocity_solution(delay, beam, source, sonar.assumed_sound_speed)
        return replace(solution, model_error=self.bending_error or 0.0)
