"""Placing by travel times through a sound-speed profile."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

from sonarsynth.conventions import Floats
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.casts import profile_of
from sonarsynth.environment.sea import Profile, SoundSpeed
from sonarsynth.geometry import Pose
from sonarsynth.ranging.placing.solution import Solution
from sonarsynth.receiver import Sonar


@description
class RefractedPlacing(Method):
    """Range by travel times through a sound-speed profile, along the beam's ray and the eigenray to the snap."""

    kind: Literal["refracted"] = "refracted"
    profile: SoundSpeed | None = None
    """Sound speed that the sonar believes in; left out: that of the water."""

    def resolve(self, demand: Demand) -> tuple[RefractedPlacing, float]:
        """Itself: as exact as its profile."""
        return self, 0.0

    def notes(self) -> tuple[str, ...]:
        """What the profile that the sonar believes in leaves open."""
        return () if self.profile is None else profile_of(self.profile).notes

    def place(
        self, delay: Floats, beam: Floats, source: Floats, sonar: Sonar, sonar_pose: Pose, profile: Profile
    ) -> Solution:
        """See `PlacingMethod`. Positions lie where the rays lead; a range is the straight distance to there. By the
        profile of the water itself no error of the assumed sound speed enters it."""
        from sonarsynth.ranging.location.refraction import refracted_solution

        believed = profile if self.profile is None else profile_of(self.profile)
        solution = refracted_solution(delay, beam, source, sonar.assumed_sound_speed, sonar_pose, believed)
        return solution if self.profile is not None else replace(solution, by_speed=0.0 * solution.by_speed)
