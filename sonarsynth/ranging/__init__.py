"""Locating the snap, cancelling its reflections, and ranging its echoes."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates
from sonarsynth.ranging.auto_ranging import AutoRange
from sonarsynth.ranging.cancelling import Cancelling
from sonarsynth.ranging.cancelling.cancelling_method import CancellingMethod
from sonarsynth.ranging.cancelling.reflection_cancelling import WavefrontCancelling
from sonarsynth.ranging.isovelocity import IsovelocityRange
from sonarsynth.ranging.location import Locator
from sonarsynth.ranging.location.locating_method import LocatingMethod
from sonarsynth.ranging.location.sensor_delays import SensorDelays
from sonarsynth.ranging.refracted_ranging import RefractedRange
from sonarsynth.receiver import Elements, Sonar

__all__ = [
    "AutoRange",
    "Cancelling",
    "CancellingMethod",
    "IsovelocityRange",
    "LocatingMethod",
    "Locator",
    "Ranging",
    "RangingMethod",
    "RefractedRange",
    "SensorDelays",
    "WavefrontCancelling",
]


class RangingMethod(Protocol):
    """Places the echoes of an image in space."""

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
        """Points lit by the first snap of `estimates`; none of a beam whose echo is not to be trusted.

        profile: the sound speed of the water, for methods that trace rays and were given none of their own. direct:
        signals with the direct pulse in them, where it was taken out of `signals`.
        """


Ranging = Annotated[AutoRange | IsovelocityRange | RefractedRange, BY_KIND]
