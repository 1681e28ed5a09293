"""Locating by time differences over the sensors."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Literal

from sonarsynth.conventions import depth
from sonarsynth.description import description
from sonarsynth.description.method import UNSTATED, Demand
from sonarsynth.environment.sound_speed import kink, mean_gradient
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.location.locating_method import LocatingMethod, unlocatable
from sonarsynth.receiver import Band, Elements
from sonarsynth.state import Receiver, Survey


@description
class SensorDelays(LocatingMethod):
    """Direction and position from the time differences of the direct pulse over the sensors (Kuselan et al. 2011).

    Equation 6 of the thesis with its square and an intercept, then the sphere that fits the delays best, then the depth
    of the bottom. Delays are measured coherently in the band against the wave that all sensors hear, to about a
    thousandth of a sample. Standard errors are those of the lags that remain (and no less than the Cramer-Rao bound
    for the noise), of the assumed sound speed, of the depth of the bottom, and of the bending of rays where these are
    taken for straight, through the Jacobians; that of the time also of what the converter clips. A pulse that lasts
    longer than a snap is measured whole; a tone whose envelopes tell no period from the next is refused.
    """

    kind: Literal["sensor_delays"] = "sensor_delays"
    refraction: bool = False
    """Trace the bearing through the sound-speed profile of the water; otherwise paths are straight, at the sonar's
    assumed sound speed, and predicted errors hold what bending does to that: how a wave from the place that is found
    differs from a straight one, or, where no range is found, what a gradient g may do, r g/(2c) in angle."""

    on_bottom: bool | None = None
    """Whether sources are known to be on the bottom. True: its depth is used where the wavefront agrees;
    false (pingers, vehicles, fish): places are those of the wavefront alone. Left out: as the sources of the recipe,
    on it within three errors of its depth, and within 0.1 mm where it reflects sound."""

    reflected: bool | None = None
    """Whether sources are heard with their reflections at surface and bottom: predicted errors then hold what these
    do. That of a source on the bottom turns the phase by its angle and so moves where it is heard, up or down, by about
    half a wavelength (Goos and Haenchen 1947); a source that is elsewhere, and so close to surface or bottom that its
    pulse overlaps the reflection, is heard between it and its image. Left out: as the paths of the recipe."""

    def resolve(self, demand: Demand) -> tuple[SensorDelays, float]:
        """With what the recipe says of its sources and paths, where this is left out."""
        on_bottom = not demand.off_bottom if self.on_bottom is None else self.on_bottom
        reflects = demand.reflected if self.reflected is None else self.reflected
        return replace(self, on_bottom=on_bottom, reflected=reflects), UNSTATED

    def nearest(self, elements: Elements) -> float:
        """As `LocatingMethod.nearest`: there is no wavefront over an array that its source is in."""
        return elements.aperture

    def locates_nothing(self, elements: Elements, band: Band) -> str:
        """As `LocatingMethod.locates_nothing`."""
        from sonarsynth.ranging.location.pulse_times import LONGEST_HALF, half_length

        if half_length(band) > LONGEST_HALF:
            return f"a band of {band.high - band.low:.3g} Hz tells no direct pulse from its echoes"
        return unlocatable(elements) or ""

    def off_bottom_note(self) -> str:
        """As `LocatingMethod.off_bottom_note`."""
        if self.on_bottom is False:
            return ""
        then = "the sonar assumes that it is" if self.on_bottom else "snaps are located by their wavefronts alone"
        return f"{then} (scene.processing.locating.on_bottom)"

    def locate(self, signals: Signals, receiver: Receiver, survey: Survey, snaps: int) -> SourceEstimates:
        """See `LocatingMethod`. An array that cannot locate gives NaN rows (`unlocatable` says why)."""
        from sonarsynth.ranging.location.locating import locate
        from sonarsynth.ranging.location.refraction import bending

        profile, aperture, own = survey.profile, receiver.elements.aperture, float(depth(receiver.pose.position))
        gradient = mean_gradient(profile, own, survey.bottom, aperture)
        bends = self.refraction or not profile.uniform
        bend = partial(bending, profile, receiver.elements, self.refraction) if bends else None
        return locate(
            signals, receiver, survey.bottom, snaps, bend=bend, gradient=gradient,
            kink=kink(profile, own, aperture) if aperture else 0.0, on_bottom=self.on_bottom is not False,
            reflected=self.reflected is True,
        )  # fmt: skip
