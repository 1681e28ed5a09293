"""The band that levels are taken in: what each snap sends there, and what water takes from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sonarsynth.conventions import Floats

SLICES = 960
"""Equal slices of a band: many numbers divide it."""

DIVISORS = [n for n in range(1, SLICES + 1) if SLICES % n == 0]

ALIKE = 0.01
"""Pulses so far apart that their correlation stays below this count as apart: sums of paths err by 0.02 dB at most."""


@dataclass(frozen=True, eq=False)
class Band:
    """Energy that each snap sends in slices of a band of frequencies."""

    low: float  # Hz
    high: float  # Hz
    energy: Floats  # (snap, slice) Pa2 s of the filtered snap at 1 m, at positive frequencies, in equal slices
    relative: Floats  # (slice,) absorption in the middle of each over that at the centre of the band, less one
    late: Floats  # (snap, slice) s: group delay of the filtered snap, after the time that delays of paths count from

    @cached_property
    def frequency(self) -> Floats:
        """(slice,) Hz: the middle of each."""
        count = len(self.relative)
        return np.asarray(self.low + (np.arange(count) + 0.5) * ((self.high - self.low) / count))

    @cached_property
    def weight(self) -> Floats:
        """(snap, slice) share of the energy of each snap; all slices alike for one that sends nothing."""
        total = self.energy.sum(axis=1, keepdims=True)
        flat = np.full_like(self.energy, 1.0 / self.energy.shape[1])
        return np.asarray(np.divide(self.energy, total, out=flat, where=total > 0.0))

    def sliced(self, wanted: float) -> Band:
        """The same band in as many slices as are wanted, or somewhat more; no more than it has."""
        return _sliced(self, next((n for n in DIVISORS if n >= wanted), SLICES))

    @cached_property
    def pulse(self) -> float:
        """How far apart (s) pulses of these spectra no longer interfere: their correlation stays below ALIKE."""
        if not len(self.energy):
            return 0.0
        correlation = np.abs(np.fft.ifft(self.weight, 2 * self.energy.shape[1], axis=1)).max(axis=0)
        half = correlation[: self.energy.shape[1]]
        last = int(np.flatnonzero(half > ALIKE * half[0])[-1])
        return (last + 1) * 0.5 / (self.high - self.low)


@lru_cache(maxsize=64)
def _sliced(band: Band, count: int) -> Band:
    """A band in so many slices."""
    slices = (len(band.energy), count, SLICES // count)
    energy = band.energy.reshape(slices).sum(axis=2)
    weight = band.weight.reshape(slices) + np.finfo(float).tiny
    late = (weight * band.late.reshape(slices)).sum(axis=2) / weight.sum(axis=2)
    return Band(band.low, band.high, energy, band.relative.reshape(slices[1:]).mean(axis=1), late)
