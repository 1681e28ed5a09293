"""Picking: which peaks of the beams are echoes, when they come, and from where."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.ranging.picking.beam_axis import BeamAxis
from sonarsynth.ranging.picking.first_echo import FirstEcho
from sonarsynth.ranging.picking.peaks import Peaks
from sonarsynth.ranging.picking.picked_echoes import PickedEchoes
from sonarsynth.ranging.received_window import ReceivedWindow

__all__ = ["BeamAxis", "FirstEcho", "Peaks", "PickedEchoes", "Picking", "PickingMethod"]


class PickingMethod(Protocol):
    """Finds echoes in the beams of the echo window."""

    def picks(self, window: ReceivedWindow) -> PickedEchoes:
        """The echoes of the first located snap, row 0 of `window.estimates`. It is called only where there is one."""


Picking = Annotated[Peaks | BeamAxis | FirstEcho, BY_KIND]
