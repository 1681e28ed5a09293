"""What a beamformer gets and gives: spectra of the sensors over a window, and beams that are made when asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

Spectra = npt.NDArray[np.complex64]

PARTS = 12
"""Parts of a window: it is cut to one of them, or to so many as divide them, where the rest is silent."""
FEWEST = 64
"""Bins that are left then, at least."""


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Spectra of the sensors over a window of the signals, in the sonar's band."""

    frequency: Floats  # (bin,) Hz, evenly spaced
    spacing: float  # Hz between two
    bins: range  # (bin,) their numbers
    transform: Callable[[range, float], Spectra]  # spectra (sensor, bin) in Pa of bins, phases from `begin` on
    start: float  # s: the sample that phases refer to
    samples: int  # of the window
    sampling_frequency: float  # Hz
    sample_power: npt.NDArray[np.floating]  # (sample,) Pa2 of all sensors together
    begin: float = 0.0  # sample of the window that phases refer to

    @cached_property
    def spectra(self) -> Spectra:
        """(sensor, bin) Pa, as `rfft` gives them; made when asked for."""
        return self.transform(self.bins, self.begin)

    def having(self, spectra: Spectra) -> Snapshots:
        """The same window with other spectra (sensor, bin)."""
        some = partial(_some, spectra, self.frequency / self.sampling_frequency)
        return replace(self, bins=range(len(self.frequency)), transform=some, begin=0)

    def every(self, step: int, first: int, begin: float = 0.0) -> Snapshots:
        """Every step-th bin from the `first` on, whose transform is their own, unless that of all is made or its length
        is no multiple of the step; phases refer to a sample `begin` later."""
        together = "spectra" in vars(self) or round(self.sampling_frequency / self.spacing) % step > 0
        of = self.having(self.spectra) if together else self
        frequency, bins, begin = self.frequency[first::step], of.bins[first::step], of.begin + begin
        start = self.start + (begin - of.begin) / self.sampling_frequency
        return replace(of, frequency=frequency, spacing=step * self.spacing, bins=bins, start=start, begin=begin)

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
        return replace(self, frequency=self.frequency[bins], sample_power=unknown).having(self.spectra[:, bins])

    def without_silence(self, margin: float) -> Snapshots:
        """Every k-th bin, which are all that a k-th of the window has: of that which has the sound and `margin` (s)
        before and after it, to the beginning of which phases then refer. As it is where no k over 1 is possible.

        Silent is what single precision leaves of the loudest. `PARTS` is a multiple of k, and what is left begins at a
        quarter of such a part: so its delays are among those of the whole. Found once: it is imaged and ranged.
        """
        part = self._parts.get(margin) or self._without_silence(margin)
        if part is not self:
            self._parts[margin] = part
        return part

    @cached_property
    def _parts(self) -> dict[float, Snapshots]:
        """By their margins, s."""
        return {}

    def _without_silence(self, margin: float) -> Snapshots:
        heard = np.flatnonzero(self.sample_power > np.finfo(np.float32).eps ** 2 * self.sample_power.max(initial=0.0))
        around, whole = margin * self.sampling_frequency, self.sampling_frequency / self.spacing
        first, stop = (heard[0] - around, heard[-1] + 1 + around) if len(heard) else (0.0, whole)
        most = min(PARTS, len(self.frequency) // FEWEST) if first >= 0.0 and stop <= self.samples else 1
        for k in (k for k in range(most, 1, -1) if PARTS % k == 0):
            begin = int(4 * PARTS * min(first, self.samples - whole / k) / whole) * whole / (4 * PARTS)
            if begin >= 0.0 and begin + whole / k >= stop:
                part = self.every(k, -round(self.frequency[0] / self.spacing) % k, begin)
                return replace(part, sample_power=np.ones_like(self.sample_power))
        return self


def _some(spectra: Spectra, frequency: Floats, bins: range, begin: float) -> Spectra:
    """As `Snapshots.transform`, of spectra (sensor, bin) that are given, at frequencies (bin,) in turns a sample."""
    some = slice(bins.start, None, bins.step)
    turn = np.exp(2j * np.pi * frequency[some] * begin).astype(np.complex64)
    return spectra[:, some] * turn if begin else spectra[:, some]


@dataclass(frozen=True, eq=False)
class BeamSpectra:
    """What a beamformer hears of a window in any direction. All beams at all frequencies are never held."""

    snapshots: Snapshots
    energies: Callable[[], Floats]
    """Energy (elevation, azimuth) in Pa2 s of the beams of the sonar's grid, of which the image is made."""
    spectra: Callable[[Floats], npt.NDArray[np.complex64]]
    """Spectra (beam, bin) in Pa of beams in directions (beam, xyz), sonar frame, of which echoes are picked: a plane
    wave from there gives its own. The array is new each time, and its user's to change."""
    of_snapshots: Callable[[Snapshots], BeamSpectra] | None = None
    """The same of other snapshots of the window, where beams of a bin are made of that bin alone."""

    def without_silence(self, margin: float) -> BeamSpectra:
        """Beams of the part of the window that has sound, as `Snapshots.without_silence`; all, where that is not known
        to have the same echoes."""
        part = self.snapshots.without_silence(margin) if self.of_snapshots else self.snapshots
        return self.of_snapshots(part) if self.of_snapshots and part is not self.snapshots else self
