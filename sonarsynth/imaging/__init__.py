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
from sonarsynth.products import BeamSpectra, EnergyImage, Signals
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
    """One way to make an image from signals."""

    @property
    def focus(self) -> float | None:
        """Range (m) at which the array is focused; none: plane waves."""
        ...

    def image(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> EnergyImage:
        """Image of the window from start to stop (s, clock of the signals) on the sonar's beam grid.

        Raises ValueError when the window reaches outside the signals, when it is too short to resolve the sonar's band,
        when no element is live, or when the method cannot take the array.
        """
        ...

    def beams(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> BeamSpectra:
        """Beams of the same window in any direction, that echoes are picked from: of `Steering`, delay and sum, where
        a method has none of its own (`Steering.steer`)."""
        ...


DelayAndSum = FocusedDelayAndSum | DenseDelayAndSum | AutoBeamforming
Beamformer = Annotated[DelayAndSum | SubBand | LpMean | OrderStatistic | Capon | Clean, BY_KIND]
