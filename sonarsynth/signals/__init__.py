"""From arrivals to the pressure at each hydrophone."""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.products import Arrivals, Signals
from sonarsynth.signals.auto_synthesis import AutoSynthesis
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.electronics import add_noise, convert
from sonarsynth.signals.filtered_pulse import pulse_support
from sonarsynth.signals.gridded_synthesis import GriddedSynthesis
from sonarsynth.signals.segments import Reception
from sonarsynth.state import Emission

__all__ = [
    "AutoSynthesis",
    "DirectSum",
    "GriddedSynthesis",
    "Reception",
    "SignalSynthesis",
    "Synthesis",
    "add_noise",
    "convert",
    "pulse_support",
]


class SignalSynthesis(Protocol):
    """A method of synthesis."""

    def signals(self, arrivals: Arrivals, snaps: tuple[Emission, ...], reception: Reception) -> Signals:
        """Pressure at each hydrophone, without noise and without a converter, in the window of the reception; where
        that is not asked for whole, a stretch of it that holds all of the sound will do.

        Absorption at the band centre is inside the amplitudes already. Zero paths are silence. Raises ValueError for
        arrivals that are not finite, have no amplitude or a negative blur, are stretched by a tenth or more, or come
        from a hydrophone itself or from what is no facet, or too large a one.
        """
        ...


Synthesis = Annotated[AutoSynthesis | GriddedSynthesis | DirectSum, BY_KIND]
"""The methods of synthesis, by `kind`."""
