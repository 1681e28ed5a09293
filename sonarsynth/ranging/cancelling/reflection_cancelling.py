"""Cancelling the snap's own reflections from surface and bottom by their wavefronts."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Decibels, PositiveRadians
from sonarsynth.description import description
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.cancelling.cancelling_method import CancellingMethod
from sonarsynth.state import Receiver, Survey


@description
class WavefrontCancelling(CancellingMethod):
    """Find the snap's reflections that come from outside the field of view, and take their wavefronts out.

    Through surface and bottom the snap reaches a shallow array again while echoes are heard, far louder than they are,
    and enters the image by the grating lobes of a sparse array. Each reflection is predicted by its image source
    (located snap, depth of the bottom, own pose, assumed sound speed), searched about there by tilting a beam, fitted
    by the lags of the sensors to a sphere, and averaged over the sensors along it, face and spreading taken into
    account, to the one wave that all hear. That is taken out of every sensor. What comes from the beam grid, or a beam
    beside it, is never touched, nor a direct pulse, nor what does not fit; signals in which nothing is found stay as
    they are, bit for bit (`multipath.cancel` says what became of each arrival).

    Measured on a REMUS-100 at 20 m (508 elements, 16 bits, thermocline of 6 m/s, snap -> surface -> bottom -> array 59
    degrees below the axis), against the same frames without that arrival: energy of the arrival at the sensors, and in
    the loudest beam that it lights; change of the loudest beam on the hull, and the largest of any beam within 12 dB:

        echoes at the same time    arrival    in beams    hull        worst
        none                       -48 dB     -54 dB      0.000 dB    0.000 dB
        some                       -37 dB     -39 dB      0.002 dB    0.005 dB
        throughout, 7 dB less      -26 dB     -23 dB      0.010 dB    0.27 dB

    16 frames of 64: brightest beam on the hull in 16, in 9 without; points off it 381 and 2150. 9 ms a frame and
    arrival on one core. What limits it: counts of the converter (the first line), and the average over N sensors, which
    keeps 1/N of the energy of noise and echoes in the same window. Two arrivals less than a beam width and a pulse
    apart (a snap 0.2 m above the bottom, three reflections) fall by 24 to 35 dB together, and cost some 40 ms more.
    """

    kind: Literal["wavefront"] = "wavefront"
    bounces: Annotated[int, Ge(1), Le(16)] = 2
    """Reflections up to so many at surface and bottom are looked for."""
    search: Annotated[PositiveRadians, Le(0.5)] = np.float64(0.03)
    """How far from where straight paths lead an arrival is looked for."""
    excess: Annotated[Decibels, Ge(6)] = 12.0
    """An arrival is cancelled if, in the better half of the band, a beam on it stands so far above all else in its
    window. Echoes alone reached 12 dB in 6661 searches of random scenes; what stands out must fit a sphere as well."""
    weakest: Annotated[Decibels, Ge(0)] = 40.0
    """An arrival this far below what reflections without loss would bring is not the one looked for."""

    def cancel(
        self,
        signals: Signals,
        estimates: SourceEstimates,
        receiver: Receiver,
        survey: Survey,
        window: tuple[float, float],
    ) -> Signals:
        """See `CancellingMethod`."""
        from sonarsynth.ranging.cancelling.multipath import Limits, cancel

        limits = Limits(self.bounces, self.search, self.excess, self.weakest)
        return cancel(signals, estimates, receiver, survey.bottom, window, limits).signals
