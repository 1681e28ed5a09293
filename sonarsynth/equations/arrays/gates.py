"""Gates: the stretch of the signals that is looked at, tapered, and its spectra in the band."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.products.steered_spectra import PARTS

GATE_TAPER: Final = 1e-4
"""Length (s) of the raised cosine at each end of a gate; a quarter of the gate at most."""

SENSORS_AT_ONCE: Final = 64
"""Sensors whose gates are transformed together: they stay in the cache."""

LONG: Final = 1000
"""Samples of a long transform; shorter ones take little time."""

SHORT: Final = 256
"""Samples up to which waves in a matrix are faster than a transform."""


def gate_samples(
    start: float, stop: float, first_time: float, sampling_frequency: float, samples: int
) -> tuple[int, int]:
    """First sample and number of samples of the gate [start, stop] (s); sample 0 of the signals is at `first_time` (s).

    The number depends on the length of the gate alone, so that every frame has the same frequencies. Raises ValueError
    when the gate holds no sample or reaches outside the signals: what was not recorded is not silence.
    """
    length = (stop - start) * sampling_frequency
    if not (np.isfinite(start) and np.isfinite(length) and length >= 1.0 - 1e-6):
        raise ValueError(f"window {start:g} to {stop:g} s holds no sample at {sampling_frequency:g} Hz")
    first, count = int(np.ceil((start - first_time) * sampling_frequency - 1e-6)), int(np.floor(length + 1e-6))
    if first < 0 or first + count > samples:
        end = first_time + samples / sampling_frequency
        raise ValueError(f"window {start:g} to {stop:g} s reaches outside the signals, {first_time:g} to {end:g} s")
    return first, count


def gate_taper(count: int, sampling_frequency: float) -> npt.NDArray[np.float32]:
    """Weights (count,) of a gate: one, with raised cosines of `GATE_TAPER` at both ends."""
    length = min(round(GATE_TAPER * sampling_frequency), count // 4)
    rise = np.sin(0.5 * np.pi * (np.arange(length) + 0.5) / max(length, 1)) ** 2
    return np.concatenate([rise, np.ones(count - 2 * length), rise[::-1]]).astype(np.float32)


def fast_length(count: int) -> int:
    """Length of the FFT of a gate of `count` samples: the next that is fast and, if `LONG`, a multiple of `PARTS`."""
    from scipy.fft import next_fast_len

    divisor = PARTS if count >= LONG else 1
    return divisor * int(next_fast_len(-(-count // divisor), real=True))


def frequency_spacing(count: int, sampling_frequency: float) -> float:
    """Distance (Hz) of the frequencies of a gate of `count` samples: those of its FFT, padded to a fast length."""
    return float(sampling_frequency / fast_length(count))


def band_bins(count: int, sampling_frequency: float, band: tuple[float, float]) -> tuple[int, int]:
    """First bin in a band (low, high) in Hz, and the one after the last, of the FFT of a gate of `count` samples.

    Raises ValueError when no frequency in band is below half the sampling frequency.
    """
    length = fast_length(count)
    low, high = (edge * length / sampling_frequency for edge in band)
    # Nothing is known of the phase at half the sampling frequency, so that bin never counts.
    lowest, highest = int(np.ceil(low - 1e-9)), min(int(np.floor(high + 1e-9)), (length - 1) // 2)
    if highest < lowest:
        raise ValueError(
            f"a window of {count} samples resolves no frequency in {band[0]:g} to {band[1]:g} Hz: take a longer one"
        )
    return lowest, highest + 1


def gated_energy(
    pressure: npt.NDArray[np.floating],
    sampling_frequency: float,
    first_sample: int,
    count: int,
    band: tuple[float, float],
) -> float:
    """Sum of |spectrum|^2 in Pa2 over all sensors and bins of `gate_of`, whose arguments it has.

    Fast where few samples of the gate are not 0: powers at all frequencies are the transform of the autocorrelation,
    summed over sensors (Wiener and Khinchin). Raises ValueError as `band_bins`.
    """
    from scipy.fft import irfft, rfft

    gate = pressure[:, first_sample : first_sample + count]
    sounds = np.flatnonzero(np.einsum("ij,ij->j", gate, gate))
    if not len(sounds):
        return 0.0
    short, length = slice(sounds[0], sounds[-1] + 1), fast_length(count)
    cut = gate[:, short] * gate_taper(count, sampling_frequency)[short].astype(float)
    lags = np.arange(1 - cut.shape[1], cut.shape[1])
    wide = fast_length(len(lags))
    correlation = irfft(np.sum(np.abs(rfft(cut, wide, axis=1)) ** 2, axis=0), wide)
    circle = np.zeros(length)
    np.add.at(circle, lags % length, correlation[lags])
    return float(np.sum(rfft(circle).real[slice(*band_bins(count, sampling_frequency, band))]))


@dataclass(frozen=True, eq=False)
class Gate:
    """A gate of the signals, tapered (`gate_taper`) and padded with zeros to a `fast_length`: its spectra are made when
    they are asked for."""

    pressure: npt.NDArray[np.floating]  # (sensor, sample) Pa
    sampling_frequency: float  # Hz
    first_sample: int
    count: int
    bins: range  # of the FFT in the band
    power: Floats  # (sample,) Pa2 of all sensors, before it was tapered

    @property
    def frequency(self) -> Floats:
        """Of the bins (bin,), Hz."""
        return np.array(self.bins, float) * frequency_spacing(self.count, self.sampling_frequency)

    def __call__(self, bins: range, begin: float = 0.0) -> npt.NDArray[np.complex64]:
        """rfft spectra (sensor, bin) in Pa at bins whose step divides the length; phases refer to `begin` (samples).

        They are those of sound that is wound round a circle of a step-th of the length (time aliasing), and turned,
        unless bins are multiples of their step, by the rest.
        """
        from scipy.fft import fft, rfft

        from sonarsynth.equations.kernels.sensor_rows import wind_rows

        length, sample, (first, rest) = fast_length(self.count), int(begin), divmod(bins.start, bins.step)
        taper, heard = _turned_taper(self.count, self.sampling_frequency, rest, sample), np.flatnonzero(self.power)
        low, high = (heard[0], heard[-1] + 1) if len(heard) else (0, 0)
        spectra = np.empty((len(self.pressure), len(bins)), np.complex64)
        wound = np.empty((SENSORS_AT_ONCE, length // bins.step), np.result_type(self.pressure, taper))
        for n in range(0, len(spectra), SENSORS_AT_ONCE):
            some = self.pressure[n : n + SENSORS_AT_ONCE]
            wind_rows(some, self.first_sample, low, high, taper, sample, wound)
            transformed = (fft if rest else rfft)(wound[: len(some)], axis=1)
            spectra[n : n + len(some)] = transformed[:, first : first + len(bins)]
        if begin > sample:
            spectra *= np.exp(2j * np.pi * np.array(bins) * ((begin - sample) / length)).astype(np.complex64)
        return spectra


@lru_cache(maxsize=16)
def _turned_taper(count: int, sampling_frequency: float, bins: int, begin: int) -> npt.NDArray[Any]:
    """The taper of a gate (sample,), turned by so many bins of its transform about a sample."""
    taper, turns = gate_taper(count, sampling_frequency), bins * (np.arange(count) - begin) / fast_length(count)
    return (taper * np.exp(-2j * np.pi * turns)).astype(np.complex64) if bins else taper


def gate_of(
    pressure: npt.NDArray[np.floating], sampling_frequency: float, first_sample: int, count: int,
    band: tuple[float, float], power: Floats | None = None,
) -> Gate:  # fmt: skip
    """The gate of `count` samples of pressure (sensor, sample) Pa, and its bins in a band (low, high) in Hz; its power
    (sample,) where that is known. Raises ValueError when no frequency in band is below half the sampling frequency."""
    from sonarsynth.equations.kernels.sensor_rows import power_and_peak

    bins, every = range(*band_bins(count, sampling_frequency, band)), np.ones(len(pressure), bool)
    if power is None:
        power, _ = power_and_peak(pressure, every, first_sample, first_sample + count)
    return Gate(pressure, sampling_frequency, first_sample, count, bins, power)


def short_spectra(rows: Floats, first: int, stop: int) -> npt.NDArray[np.complexfloating]:
    """The bins `first` to `stop` of the rfft of rows (row, sample): of short ones, whose length is not fast, in single
    precision, as pressure is, and in a quarter of its time."""
    if rows.shape[1] > SHORT:
        from scipy.fft import rfft

        return np.asarray(rfft(rows, axis=1)[:, first:stop])
    return np.asarray((rows.astype(np.float32) @ _waves(rows.shape[1], first, stop)).view(np.complex64))


@lru_cache(maxsize=16)
def _waves(samples: int, first: int, stop: int) -> npt.NDArray[np.float32]:
    """What `short_spectra` multiplies rows by (sample, 2 bins): real and imaginary parts by turns."""
    turns = np.outer(np.arange(samples), np.arange(first, stop)) / samples
    return np.asarray(np.exp(-2j * np.pi * turns).view(float).astype(np.float32))
