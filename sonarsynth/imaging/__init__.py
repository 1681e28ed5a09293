"""Beamformers: energy in each steered direction, from the signals of a window.

The beam of each direction is the mean over live elements of their spectra, delayed to the array centre at the sound
speed that the sonar assumes (`equations.arrays.beams`). Its energy follows by Parseval over the bins of the sonar's
band: a plane wave p(t) in band, from a steered direction, has int p^2 dt there (Pa2 s).
"""

from __future__ import annotations

from typing import Annotated, Protocol

from sonarsynth.description import BY_KIND
from sonarsynth.imaging.capon import Capon
from sonarsynth.imaging.clean import Clean
from sonarsynth.imaging.delay_and_sum.auto_beamformer import AutoBeamforming
from sonarsynth.imaging.delay_and_sum.dense import DenseDelayAndSum
from sonarsynth.imaging.delay_and_sum.focused import FocusedDelayAndSum
from sonarsynth.imaging.lp import LpMean
from sonarsynth.imaging.order_statistic import OrderStatistic
from sonarsynth.imaging.steering import Steering
from sonarsynth.imaging.sub_band import SubBand
from sonarsynth.products import BeamSpectra, Snapshots
from sonarsynth.receiver import Elements, Sonar

__all__ = [
    "AutoBeamforming",
    "Beamformer",
    "BeamformingMethod",
    "Capon",
    "Clean",
    "DenseDelayAndSum",
    "FocusedDelayAndSum",
    "LpMean",
    "OrderStatistic",
    "Steering",
    "SubBand",
]


class BeamformingMethod(Protocol):
    """One way to make beams of the signals of a window."""

    @property
    def focus(self) -> float | None:
        """Range (m) at which the array is focused; none: plane waves."""
        ...

    def beams(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> BeamSpectra:
        """Beams of a window of the signals: their energies on the sonar's grid, and their spectra in any direction.

        `Steering` makes them of a method's own `steer` or `energies`; of delay and sum, where it has none. The energies
        raise ValueError when no element is live, or when the method cannot take the array.
        """
        ...


DelayAndSum = FocusedDelayAndSum | DenseDelayAndSum | AutoBeamforming
Beamformer = Annotated[DelayAndSum | SubBand | LpMean | OrderStatistic | Capon | Clean, BY_KIND]
