"""Delay and sum, every sensor in every beam: any array, exact, slow. The check of the fast ones."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats, PositiveMetres, direction
from sonarsynth.description import description
from sonarsynth.description.method import Demand
from sonarsynth.equations.arrays.apertures import focus_delay
from sonarsynth.equations.arrays.beams import first_and_spacing
from sonarsynth.imaging.image_window import Shading, energy_image, weights, window_spectra
from sonarsynth.imaging.steering import Steering
from sonarsynth.products import EnergyImage, Signals
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

    def image(self, signals: Signals, elements: Elements, sonar: Sonar, start: float, stop: float) -> EnergyImage:
        """Image of the window from start to stop (s)."""
        frequencies, spectra, unit = window_spectra(signals, sonar, start, stop)
        return energy_image(unit * self.energies(spectra, frequencies, elements, sonar), sonar, start, stop)

    def energies(
        self, spectra: npt.NDArray[np.complexfloating], frequencies: Floats, elements: Elements, sonar: Sonar
    ) -> Floats:
        """Sum over bins of |B|^2 of the beams of the grid: (elevation, azimuth), in the unit of spectra (sensor, bin)
        squared; frequencies (bin,) Hz, evenly spaced. Raises ValueError when no element is live."""
        beams = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None])
        delay = focus_delay(elements.position, beams.reshape(-1, 3), self.focus, sonar.assumed_sound_speed)
        energy = dense_energies(spectra, delay, weights(elements, self.shading), frequencies)
        return energy.reshape(beams.shape[:2])


def dense_energies(
    spectra: npt.NDArray[np.complexfloating], delay: Floats, weight: Floats, frequencies: Floats
) -> Floats:
    """Sum over bins of |sum_q weight_q spectra_q exp(+i 2 pi f delay_q)|^2: (beam,), in float64.

    spectra (sensor, bin), delay (beam, sensor) s, weight (sensor,), frequencies (bin,) Hz, evenly spaced: each bin's
    phasors are those of the bin before, turned on (1e-16 a bin).
    """
    live = np.flatnonzero(weight)
    heard = np.conj((weight[live, None] * spectra[live]).T)
    first, spacing = first_and_spacing(frequencies)
    energy = np.zeros(len(delay))
    for start in range(0, len(delay), BEAMS_AT_ONCE):
        block = slice(start, start + BEAMS_AT_ONCE)
        turn = np.exp(2j * np.pi * spacing * delay[block][:, live])
        phasor = np.exp(2j * np.pi * first * delay[block][:, live])
        for spectrum in heard:
            energy[block] += np.abs(np.vecdot(spectrum, phasor)) ** 2  # row by row: threads would wait for each other
            phasor *= turn
    return energy
