"""Delay and sum, every sensor in every beam: any array, exact, slow. The check of the fast ones."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, PositiveMetres, direction
from sonarsynth.description import description
from sonarsynth.description.method import Demand, FrameSize
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.arrays.beams import first_and_spacing
from sonarsynth.imaging.image_window import Shading, weights
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import Snapshots
from sonarsynth.receiver import Elements, Sonar

BEAMS_AT_ONCE = 128


@description
class DenseDelayAndSum(Steering):
    """Delay and sum for any array, with the exact spherical delay to the focus in every direction, in float64."""

    separable: ClassVar[bool] = False
    kind: Literal["dense"] = "dense"
    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""

    def resolve(self, demand: Demand) -> tuple[DenseDelayAndSum, float]:
        """Itself: exact."""
        return self, 0.0

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: every sensor in every beam."""
        return 2.5e-9 * size.sensors * size.beams * size.bins

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """As `Steering.energies`, in float64."""
        beams = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None])
        delay = focus_delay(elements.position, beams.reshape(-1, 3), self.focus, sonar.assumed_sound_speed)
        weight = weights(elements, self.shading)
        energy = dense_energies(snapshots.spectra, delay, weight, snapshots.frequency)
        return snapshots.unit * energy.reshape(beams.shape[:2])


def dense_energies(
    spectra: npt.NDArray[np.complexfloating], delay: Floats, weight: Floats, frequencies: Floats
) -> Floats:
    """Sum over bins of |sum_q weight_q spectra_q exp(+i 2 pi f delay_q)|^2: (beam,), in float64.

    spectra (sensor, bin), delay (beam, sensor) s, weight (sensor,), frequencies (bin,) Hz, evenly spaced: each bin's
    phasors are those of the bin before, turned on (1e-16 a bin).
    """
    live = np.flatnonzero(weight)
    weighted = np.conj((weight[live, None] * spectra[live]).T)
    first, spacing = first_and_spacing(frequencies)
    energy = np.zeros(len(delay))
    for start in range(0, len(delay), BEAMS_AT_ONCE):
        block = slice(start, start + BEAMS_AT_ONCE)
        turn = np.exp(2j * np.pi * spacing * delay[block][:, live])
        phasor = np.exp(2j * np.pi * first * delay[block][:, live])
        for spectrum in weighted:
            energy[block] += np.abs(np.vecdot(spectrum, phasor)) ** 2  # row by row: threads would wait for each other
            phasor *= turn
    return energy
