"""From arrivals to the pressure at each hydrophone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Protocol

from sonarsynth.conventions import Floats
from sonarsynth.description import BY_KIND
from sonarsynth.products import Arrivals, Signals
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals.auto_synthesis import AutoSynthesis
from sonarsynth.signals.direct_sum import DirectSum
from sonarsynth.signals.electronics import add_noise, convert
from sonarsynth.signals.filtered_pulse import pulse_support
from sonarsynth.signals.gridded_synthesis import GriddedSynthesis
from sonarsynth.state import Emission

__all__ = [
    "AutoSynthesis",
    "DirectSum",
    "GriddedSynthesis",
    "SignalSynthesis",
    "Synthesis",
    "add_noise",
    "convert",
    "pulse_support",
]


class SignalSynthesis(Protocol):
    """A method of synthesis."""

    def signals(
        self,
        arrivals: Arrivals,
        snaps: tuple[Emission, ...],
        elements: Elements,
        sonar: Sonar,
        absorption: Callable[[Floats], Floats] | None,
        start: float,
        samples: int,
    ) -> Signals:
        """Pressure at each hydrophone at `samples` times from `start` (s), without noise and without a converter.

        absorption gives dB/m at frequencies (Hz); its value at the band centre is inside the amplitudes already. Zero
        paths are silence. Raises ValueError for arrivals that are not finite, have no amplitude or a negative blur, are
        stretched by a tenth or more, or come from a hydrophone itself or from what is no facet, or too large a one.
        """
        ...


Synthesis = Annotated[AutoSynthesis | GriddedSynthesis | DirectSum, BY_KIND]
"""The methods of synthesis, by `kind`."""
