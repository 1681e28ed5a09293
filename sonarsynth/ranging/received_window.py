"""What ranging is given: the array, its beams in the echo window, and the source estimates."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.products import BeamSpectra, EnergyImage, Signals, SourceEstimates
from sonarsynth.receiver import Elements, Sonar


@dataclass(frozen=True, eq=False)
class ReceivedWindow:
    """The array, its image and beams in the echo window, and the source estimates."""

    elements: Elements
    sonar: Sonar
    image: EnergyImage
    beams: BeamSpectra
    loudest: float  # Pa: about the largest pressure in the signals that the beams are made of
    direct: Signals  # with the direct pulse in them
    estimates: SourceEstimates
    focus: float | None = None  # m: of the beams; none: plane waves
    late: float = 0.0  # s: root mean square delay of echoes that motion makes longer or shorter than the direct pulse
    pulse: float = 0.0  # s: how long either side of its peak the direct pulse is heard

    @property
    def located(self) -> bool:
        """Whether there is a snap to range by."""
        estimates = self.estimates
        return bool(len(estimates.time) and np.isfinite(estimates.time[0]) and np.isfinite(estimates.position[0]).all())

    def without_silence(self) -> ReceivedWindow:
        """What is left where beams of a part of the window have all of its sound; itself where none do."""
        beams = self.beams.without_silence(self.elements.aperture / self.sonar.assumed_sound_speed)
        return self if beams is self.beams else replace(self, beams=beams)
