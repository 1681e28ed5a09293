"""The fast beamformer where its error is estimated to be small enough, the dense one elsewhere."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand
from sonarsynth.imaging.delay_and_sum.dense import DenseDelayAndSum
from sonarsynth.imaging.delay_and_sum.focus_error import subarrays_for
from sonarsynth.imaging.delay_and_sum.focused import FocusedDelayAndSum
from sonarsynth.imaging.image_window import Shading
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar


@description
class AutoBeamforming(Steering):
    """Delay and sum: `focused` with the fewest subarrays that will do, `dense` where the array is no lattice or 16 by
    16 will not."""

    kind: Literal["auto"] = "auto"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""

    def resolve(self, demand: Demand) -> tuple[FocusedDelayAndSum | DenseDelayAndSum, float]:
        """`focused` where that errs by no more than is allowed (dB), as measured; else `dense`."""
        focused = FocusedDelayAndSum(focus=self.focus, shading=self.shading)
        if demand.exact or focused.refusal(demand.elements):
            return self.exact(), 0.0
        method, error = focused.resolve(demand)
        return (method, error) if error <= demand.allowed else (self.exact(), 0.0)

    def exact(self) -> DenseDelayAndSum:
        """Every sensor in every beam, with the same focus and weights."""
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def chosen(self, elements: Elements, sonar: Sonar) -> FocusedDelayAndSum | DenseDelayAndSum:
        """`focused` with the fewest subarrays whose `focus_error` is under 0.1 dB, else `dense`."""
        cut = subarrays_for(elements, self.shading, sonar, self.focus) if elements.on_lattice else None
        if cut is None:
            return self.exact()
        return FocusedDelayAndSum(focus=self.focus, shading=self.shading, subarrays=cut)

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`, of the method that is chosen."""
        return self.chosen(elements, sonar).energies(snapshots, elements, sonar)
