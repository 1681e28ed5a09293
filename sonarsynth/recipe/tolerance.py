"""How much the simulation may err: one tolerance, which the planner spends at the least cost."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Gt, Le

from sonarsynth.conventions import Number
from sonarsynth.description import description


@description
class Accuracy:
    """Largest error that is allowed to what the scene describes, against computing it the slow, exact way.

    Exact: paths are traced to each hydrophone by itself, none is too faint, and summed one by one in float64; every
    beam is steered with the exact delay of every hydrophone; echoes are ranged along rays. What the scene says is
    taken at its word: its facets, its band and its beams are not errors.
    """

    signal: Annotated[Number, Ge(1e-7), Le(0.3)] = 1e-2
    """Error of the echoes, and of the direct arrivals, relative: root of the summed squares, over the array."""
    range_m: Annotated[Number, Gt(0)] = 0.01
    """Error of ranges by the method that turns delays into places, in m."""
    image_db: Annotated[Number, Gt(0), Le(10)] = 0.1
    """Error of the energy in a beam, in dB: root mean square over those within 20 dB of the brightest, and over frames;
    it is measured in three, and single ones may err by half as much again."""
    speckle: Annotated[Number, Ge(1e-4), Le(10)] = 0.1
    """Error of the contrast of reverberation at a hydrophone, <I^2>/<I>^2, by few scatterers in place of many: it
    decides how many there are. Their energy has no error from that."""
    exact: bool = False
    """Whether everything is computed the slow, exact way, but for what the scene chooses otherwise."""

    @property
    def cheap(self) -> float:
        """Error of signals that is allowed to what costs nothing to do better: never more than 1e-3."""
        return min(self.signal, 1e-3)
