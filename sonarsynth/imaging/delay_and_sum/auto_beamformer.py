"""The fast beamformer where its error is estimated to be small enough, the dense one elsewhere."""

from __future__ import annotations

from typing import Literal

from sonarsynth.conventions import Floats, PositiveMetres
from sonarsynth.description import description
from sonarsynth.description.method import Demand
from sonarsynth.imaging.delay_and_sum.dense import DenseDelayAndSum
from sonarsynth.imaging.delay_and_sum.focus_error import parts_needed
from sonarsynth.imaging.delay_and_sum.focused import AUTO_ERROR, FocusedDelayAndSum
from sonarsynth.imaging.image_window import Shading
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar


@description
class AutoBeamforming(Steering):
    """Delay and sum: `focused` with the fewest parts that `focus_error` allows, `dense` where the array is no lattice
    or 16 by 16 do not suffice."""

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

    def estimated(self, elements: Elements, sonar: Sonar, error_db: float) -> FocusedDelayAndSum | DenseDelayAndSum:
        """The method whose `focus_error`, an estimate and no bound, is not above `error_db` (dB)."""
        if elements.on_lattice:
            parts = parts_needed(elements, self.shading, sonar, self.focus, error_db)
            if parts is not None:
                return FocusedDelayAndSum(focus=self.focus, shading=self.shading, parts=parts)
        return DenseDelayAndSum(focus=self.focus, shading=self.shading)

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`, resolved for 0.1 dB."""
        return self.estimated(elements, sonar, AUTO_ERROR).energies(snapshots, elements, sonar)
