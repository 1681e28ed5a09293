"""Ranging by travel times through a sound-speed profile."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt

from sonarsynth.conventions import Decibels, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.casts import profile_of
from sonarsynth.environment.sea import Profile, SoundSpeed
from sonarsynth.geometry import Pose
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates
from sonarsynth.receiver import Elements, Sonar


@description
class RefractedRange(Method):
    """Range by travel times through a sound-speed profile, along the beam's ray and the eigenray to the snap."""

    kind: Literal["refracted"] = "refracted"
    threshold: Annotated[Decibels, Gt(0)] = 12.0
    """Beams this far below the loudest beam of the image give no point."""
    locality: Annotated[Decibels, Ge(0)] = 3.0
    """A beam gives no point where one within a beam width holds this much more at the same delay: the echo is its."""
    focus: PositiveMetres | None = 20.0
    """Distance at which the ranged beams are focused; none: plane waves. On a lattice that is the focus of
    `FocusedDelayAndSum`, the acoustic axis's in every direction (its table says what that costs); elsewhere exact."""
    profile: SoundSpeed | None = None
    """Sound speed that the sonar believes in; left out: that of the water."""

    def resolve(self, demand: Demand) -> tuple[RefractedRange, float]:
        """Itself: as exact as its profile."""
        return self, 0.0

    def cloud(
        self,
        signals: Signals,
        image: EnergyImage,
        estimates: SourceEstimates,
        elements: Elements,
        sonar: Sonar,
        sonar_pose: Pose,
        profile: Profile,
        direct: Signals | None = None,
    ) -> PointCloud:
        """See `RangingMethod`. Positions lie where the rays lead; a range is the straight distance to there."""
        from sonarsynth.ranging.clouds import point_cloud
        from sonarsynth.ranging.location.refraction import refracted_solution

        believed = profile if self.profile is None else profile_of(self.profile)
        speed = sonar.assumed_sound_speed
        return point_cloud(
            signals,
            image,
            estimates,
            elements,
            sonar,
            threshold=self.threshold,
            locality=self.locality,
            focus=self.focus,
            solve=lambda delay, beam, source: refracted_solution(delay, beam, source, speed, sonar_pose, believed),
            direct=direct,
        )
