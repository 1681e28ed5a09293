"""Locating the snap, cancelling its reflections, and ranging its echoes."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates
from sonarsynth.ranging.auto_ranging import AutoRange
from sonarsynth.ranging.cancelling.reflection_cancelling import WavefrontCancelling
from sonarsynth.ranging.isovelocity import IsovelocityRange
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


class LocatingMethod(Protocol):
    """Finds where snaps are from what the array hears."""

    def locate(
        self,
        signals: Signals,
        elements: Elements,
        sonar: Sonar,
        sonar_pose: Pose,
        bottom_depth: float,
        snaps: int,
        profile: Profile,
    ) -> SourceEstimates:
        """The `snaps` loudest direct pulses, loudest first, one row each; NaN rows for those that were not found.

        bottom_depth (m, positive down) is where the snaps are known to be; profile the sound speed of the water, as the
        sonar knows it from a cast: for tracing rays, or for what straight ones may cost.
        """


class CancellingMethod(Protocol):
    """Takes what reaches the array by surface and bottom without an echo out of what it hears."""

    def cancel(
        self,
        signals: Signals,
        estimates: SourceEstimates,
        elements: Elements,
        sonar: Sonar,
        sonar_pose: Pose,
        bottom_depth: float,
        window: tuple[float, float],
    ) -> Signals:
        """The signals without the reflections of the located snaps in the echo window (start, stop), in s.

        The same object where nothing is taken out; `quantum` stays that of the converter, though pressures are no
        whole multiples of it where something is. bottom_depth in m, positive down.
        """


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


Locator = Annotated[SensorDelays, BY_KIND]
Cancelling = Annotated[WavefrontCancelling, BY_KIND]
Ranging = Annotated[AutoRange | IsovelocityRange | RefractedRange, BY_KIND]
