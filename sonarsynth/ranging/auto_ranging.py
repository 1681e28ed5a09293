"""The closed form where it is right, else ranging along rays."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt

from sonarsynth.conventions import Decibels, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates
from sonarsynth.ranging.isovelocity import IsovelocityRange
from sonarsynth.ranging.refracted_ranging import RefractedRange
from sonarsynth.receiver import Elements, Sonar


@description
class AutoRange(Method):
    """`IsovelocityRange` where it errs by less than the accuracy of the recipe allows, else `RefractedRange`."""

    kind: Literal["auto"] = "auto"
    threshold: Annotated[Decibels, Gt(0)] = 12.0
    """Beams this far below the loudest beam of the image give no point."""
    locality: Annotated[Decibels, Ge(0)] = 3.0
    """A beam gives no point where one within a beam width holds this much more at the same delay: the echo is its."""
    focus: PositiveMetres | None = 20.0
    """Distance at which the ranged beams are focused; none: plane waves."""

    def resolve(self, demand: Demand) -> tuple[IsovelocityRange | RefractedRange, float]:
        """The closed form where bent rays make its ranges wrong by no more than is allowed (m)."""
        method, error = self._straight().resolve(demand)
        return (method, error) if error <= (0.0 if demand.exact else demand.allowed) else (self.exact(), 0.0)

    def exact(self) -> RefractedRange:
        """Along rays."""
        return self._straight().exact()

    def _straight(self) -> IsovelocityRange:
        return IsovelocityRange(threshold=self.threshold, locality=self.locality, focus=self.focus)

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
        """See `RangingMethod`. With no plan: the closed form where the sound speed is the assumed one everywhere."""
        straight = profile.uniform and profile.speed[0] == sonar.assumed_sound_speed
        method = self._straight() if straight else self.exact()
        return method.cloud(signals, image, estimates, elements, sonar, sonar_pose, profile, direct)
