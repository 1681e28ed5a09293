"""Ranging by the closed form for straight paths."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt

from sonarsynth.conventions import Decibels, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand, Method
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose
from sonarsynth.products import EnergyImage, PointCloud, Signals, SourceEstimates
from sonarsynth.ranging.refracted_ranging import RefractedRange
from sonarsynth.receiver import Elements, Sonar


@description
class IsovelocityRange(Method):
    """Range by the closed form for straight paths at the assumed sound speed, from the delay after the direct arrival.

    For the beams over threshold the peak of the beam's signal is the echo, as in the thesis, after the snap's own
    waveform has been taken out by means of the direct pulse. A glint lights every beam within a beam width and more, so
    `locality` decides how many of them give a point. Measured on 22 frames of a REMUS-100 hull at 20 m (508 elements,
    0.5 degree grid; points whose beam meets the hull, and all others; error of range along the beam):

        locality    on    off    median    nine in ten
        0.5 dB      61     45    2.4 cm         4.4 cm
        1 dB        83     93    2.6 cm         5.9 cm
        3 dB       121    248    3.3 cm         9.6 cm
        60 dB      149    609    4.4 cm          12 cm

    Points come out a few centimetres short: beside a glint a beam takes the shortest path that it hears. Predicted
    errors hold it (all of these are within three).
    """

    kind: Literal["isovelocity"] = "isovelocity"
    threshold: Annotated[Decibels, Gt(0)] = 12.0
    """Beams this far below the loudest beam of the image give no point."""
    locality: Annotated[Decibels, Ge(0)] = 3.0
    """A beam gives no point where one within a beam width holds this much more at the same delay: the echo is its."""
    focus: PositiveMetres | None = 20.0
    """Distance at which the ranged beams are focused; none: plane waves. On a lattice that is the focus of
    `FocusedDelayAndSum`, the acoustic axis's in every direction (its table says what that costs); elsewhere exact."""

    def resolve(self, demand: Demand) -> tuple[IsovelocityRange, float]:
        """Itself, and by how much (m) bent rays make its ranges wrong."""
        return self, demand.error(self)

    def exact(self) -> RefractedRange:
        """Along rays."""
        return RefractedRange(threshold=self.threshold, locality=self.locality, focus=self.focus)

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
        """See `RangingMethod`."""
        from sonarsynth.ranging.clouds import isovelocity_solution, point_cloud

        return point_cloud(
            signals,
            image,
            estimates,
            elements,
            sonar,
            threshold=self.threshold,
            locality=self.locality,
            focus=self.focus,
            solve=lambda delay, beam, source: isovelocity_solution(delay, beam, source, sonar.assumed_sound_speed),
            direct=direct,
        )
