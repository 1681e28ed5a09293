"""Levels of beams by robust statistics over time, on which single loud samples have little weight: for impulsive noise.

They measure how loud a beam is throughout the window, as in water lit by many sources. An echo that is shorter than the
part of the window that the statistic weighs is suppressed like an impulse of noise.
Source: Chitre, Kuselan & Pallayil (2012), Ambient noise imaging in warm shallow waters; robust statistical algorithms
and range estimation, J. Acoust. Soc. Am. 132, 838.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from sonarsynth.conventions import Floats, PositiveMetres, PositiveSeconds, direction
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.imaging.image_window import Shading
from sonarsynth.imaging.steering import BEAMS_AT_ONCE, Steering
from sonarsynth.products import BeamSpectra, Snapshots
from sonarsynth.receiver import Elements, Sonar


@description
class TimeStatistic(Steering):
    """T a^2 for each beam of delay and sum: T (s) the length of the window, a (Pa) a statistic of its pressure."""

    focus: PositiveMetres | None = 20.0
    """Range at which the array is focused, in every direction as on the axis; left out (none), plane waves."""
    shading: Shading = "uniform"
    """Weights over the aperture: all alike, or falling off towards the rim (lower side lobes, a wider beam)."""
    window: PositiveSeconds | None = None
    """Length of windows, one after the other, of whose root mean squares the statistic is; left out, of samples."""

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`: beams steered one by one, and their transforms."""
        return super().cost(size) + 1e-8 * size.beams * size.bins

    @abstractmethod
    def amplitude(self, magnitude: Floats) -> Floats:
        """The statistic (beam,) in Pa of magnitudes (beam, sample or window) in Pa."""

    def energies(self, snapshots: Snapshots, elements: Elements, sonar: Sonar) -> Floats:
        """T a^2 (elevation, azimuth), in Pa2 s."""
        beams = self.beams(snapshots, elements, sonar)
        grid = direction(sonar.beams.azimuth, sonar.beams.elevation[:, None])
        u, rate = grid.reshape(-1, 3), snapshots.sampling_frequency
        length = 1 if self.window is None else max(round(self.window * rate), 1)
        level = np.empty(len(u))
        for low in range(0, len(u), BEAMS_AT_ONCE):
            block = slice(low, low + BEAMS_AT_ONCE)
            level[block] = self.amplitude(root_mean_squares(beam_pressure(beams, u[block]), length))
        return np.asarray(snapshots.duration * level.reshape(grid.shape[:2]) ** 2)


def beam_pressure(beams: BeamSpectra, direction: Floats) -> Floats:
    """Pressure (beam, sample) in Pa of beams in `direction` (beam, xyz) over their window, in the band of the beams."""
    from scipy.fft import irfft

    window = beams.snapshots
    length, first = (round(f / window.spacing) for f in (window.sampling_frequency, window.frequency[0]))
    spectra = beams.spectra(direction)
    full_band = np.zeros((len(spectra), length // 2 + 1), complex)
    full_band[:, first : first + spectra.shape[1]] = spectra
    return np.asarray(irfft(full_band, length, axis=1)[:, : window.samples])


def root_mean_squares(pressure: Floats, length: int) -> Floats:
    """Root mean squares (beam, window) over windows of `length` samples, of pressure (beam, sample); a rest that is
    shorter counts with the last window. Windows of one sample: magnitudes."""
    if length == 1:
        return np.abs(pressure)
    count = max(pressure.shape[1] // length, 1)
    begin = length * np.arange(count)
    samples = np.diff(np.append(begin, pressure.shape[1]))
    return np.asarray(np.sqrt(np.add.reduceat(pressure * pressure, begin, axis=1) / samples))
