"""What a beamformer gets and gives: spectra of the sensors over a window, and beams that are made when asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Spectra of the sensors over a window of the signals, in the sonar's band."""

    frequency: Floats  # (bin,) Hz, evenly spaced
    spacing: float  # Hz between two
    spectra: npt.NDArray[np.complex64]  # (sensor, bin) Pa, as `rfft` gives them
    start: float  # s: the sample that phases refer to
    samples: int  # of the window
    sampling_frequency: float  # Hz
    sample_power: npt.NDArray[np.floating]  # (sample,) Pa2 of all sensors together

    @property
    def duration(self) -> float:
        """Of the window, s."""
        return self.samples / self.sampling_frequency

    @property
    def unit(self) -> float:
        """Energy (Pa2 s) of |spectrum|^2 = 1 in one bin, by Parseval: 2 df/fs^2."""
        return 2.0 * self.spacing / self.sampling_frequency**2

    def power(self, weight: Floats) -> Floats:
        """Mean over sensors of |spectrum|^2 (bin,), by weight (sensor,) of sum one."""
        return np.asarray(weight @ np.abs(self.spectra).astype(float) ** 2)

    def select(self, bins: npt.NDArray[np.integer]) -> Snapshots:
        """Some bins, next to each other: of part of a band, sound may last as long as the window."""
        unknown = np.ones_like(self.sample_power)
        return replace(self, frequency=self.frequency[bins], spectra=self.spectra[:, bins], sample_power=unknown)


@dataclass(frozen=True, eq=False)
class BeamSpectra:
    """What a beamformer hears of a window in any direction. All beams at all frequencies are never held."""

    snapshots: Snapshots
    energies: Callable[[], Floats]
    """Energy (elevation, azimuth) in Pa2 s of the beams of the sonar's grid, of which the image is made."""
    spectra: Callable[[Floats], npt.NDArray[np.complex64]]
    """Spectra (beam, bin) in Pa of beams in directions (beam, xyz), sonar frame, of which echoes are picked: a plane
    wave from there gives its own. The array is new each time, and its user's to change."""
