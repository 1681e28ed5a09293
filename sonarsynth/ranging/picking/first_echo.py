"""The thesis's picking: the first echo of a beam over a threshold, in place of the loudest."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Lt

from sonarsynth.conventions import Decibels, Number
from sonarsynth.description import description
from sonarsynth.description.method import Method
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes
from sonarsynth.ranging.received_window import ReceivedWindow

if TYPE_CHECKING:
    from sonarsynth.ranging.picking.axis_echoes import AxisEchoes
    from sonarsynth.ranging.range_profiles import Profiles


@description
class FirstEcho(Method):
    """The first delay at which a beam holds `share` of the power of its loudest echo, on the axis of the beam."""

    kind: Literal["first_echo"] = "first_echo"
    threshold: Annotated[Decibels, Gt(0)] = 12.0
    """Beams this far below the loudest beam of the image give no point."""
    locality: Annotated[Decibels, Ge(0)] = 3.0
    """A beam gives no point where one within a beam width holds this much more at the same delay: the echo is its."""
    share: Annotated[Number, Gt(0), Lt(1)] = 0.5
    """Share of the power of the loudest echo in a beam from which on a peak is an echo too."""

    def picks(self, window: ReceivedWindow) -> PickedEchoes:
        """See `PickingMethod`."""
        from sonarsynth.ranging.picking.axis_echoes import axis_echoes

        return axis_echoes(window, self.threshold, self.locality, self._first)

    def _first(self, profiles: Profiles, loudest: AxisEchoes) -> AxisEchoes:
        """The first delay of each profile over the share, where the beam has an echo of its own at all."""
        over = profiles.power >= self.share * profiles.power.max(axis=1, keepdims=True)
        first = profiles.first + over.argmax(axis=1) * profiles.step
        delay = np.minimum(first, loudest.delay)
        beyond = (loudest.delay - delay) / np.sqrt(3.0)  # it is anywhere between the two, root mean square
        return replace(loudest, delay=delay, delay_error=np.hypot(loudest.delay_error, beyond))
