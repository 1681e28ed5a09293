"""The fast beamformer where it is right, the dense one elsewhere."""

from __future__ import annotations

from typing import Literal

from sonarsynth.beamforming.dense import DenseDelayAndSum
from sonarsynth.beamforming.focused import AUTO_ERROR, FocusedDelayAndSum
from sonarsynth.beamforming.window import Shading
from sonarsynth.conventions import PositiveMetres
from sonarsynth.description import description
from sonarsynth.products import EnergyImage, Signals
from sonarsynth.sonar import Elements, Sonar


@description
class AutoBeamforming:
    """Delay and sum: `focused` with the fewest zones that are right, `dense` where the array is no lattice or 32 do
    not suffice."""

    kind: Literal["auto"] = "auto"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""

    def resolve(self, elements: Elements, sonar: Sonar, error_db: float) -> FocusedDelayAndSum | DenseDelayAndSum:
        """The method whose beams within 20 dB of the peak are right to `error_db` (dB), a source being at the focus."""
        if elements.on_lattice:
            from sonarsynth.beamforming.focus_error import zones_needed

            zones = zones_needed(elements, self.shading, sonar, self.focus, error_db)
            if zones is not None:
                return FocusedDelayAndSum(focus=self.focus, shading=self.shading, zones=zones)
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def image(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> EnergyImage:
        """Image of the window from start to stop (s), by the method that is right to 0.1 dB."""
        return self.resolve(elements, sonar, AUTO_ERROR).image(signals, elements, sonar, start, stop)
