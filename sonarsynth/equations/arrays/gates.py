"""Gates: the stretch of the signals that is looked at, tapered, and its spectra in the band."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

GATE_TAPER: Final = 1e-4
"""Length (s) of the raised cosine at each end of a gate; a quarter of the gate at most."""

SENSORS_AT_ONCE: Final = 64
"""Sensors whose gates are transformed together: they stay in the cache."""

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
    """Length of the FFT of a gate of `count` samples: the next that is fast."""
    from scipy.fft import next_fast_len

    return int(next_fast_len(count, real=True))


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
    """Sum of |spectrum|^2 in Pa2 over all sensors and bins of `gated_spectra`, whose arguments it has.

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


def gated_spectra(
    pressure: npt.NDArray[np.floating],
    sampling_frequency: float,
    first_sample: int,
    count: int,
    band: tuple[float, float],
) -> tuple[Floats, npt.NDArray[np.complex64], Floats]:
    """Frequencies (bin,) in Hz and rfft spectra (sensor, bin) in Pa of a gate, bins of the band (low, high) only; and
    the power (sample,) in Pa2 of all sensors before it was tapered.

    pressure (sensor, sample) Pa. Phases refer to `first_sample`. The gate is tapered (`gate_taper`) and padded with
    zeros to a fast length (`frequency_spacing`). Raises ValueError when no frequency in band is below half the sampling
    frequency.
    """
    from scipy.fft import rfft

    from sonarsynth.equations.kernels.tapers import taper_rows

    length, (first, stop) = fast_length(count), band_bins(count, sampling_frequency, band)
    taper = gate_taper(count, sampling_frequency)
    power = np.zeros(count, pressure.dtype)
    spectra = np.empty((len(pressure), stop - first), np.complex64)
    cut = np.zeros((SENSORS_AT_ONCE, length), np.result_type(pressure, taper))
    for low in range(0, len(pressure), SENSORS_AT_ONCE):
        some = pressure[low : low + SENSORS_AT_ONCE]
        taper_rows(some, first_sample, taper, cut, power)
        spectra[low : low + len(some)] = rfft(cut[: len(some)], axis=1)[:, first:stop]
    return np.arange(first, stop, dtype=float) * (sampling_frequency / length), spectra, power


def short_spectra(rows: Floats, first: int, stop: int) -> npt.NDArray[np.complex128]:
    """The bins `first` to `stop` of the rfft of rows (row, sample): of short ones, whose length is not fast, in half of
    its time."""
    if rows.shape[1] > SHORT:
        from scipy.fft import rfft

        return np.asarray(rfft(rows, axis=1)[:, first:stop])
    return np.asarray((rows @ _waves(rows.shape[1], first, stop)).view(complex))


@lru_cache(maxsize=16)
def _waves(samples: int, first: int, stop: int) -> Floats:
    """What `short_spectra` multiplies rows by (sample, 2 bins): real and imaginary parts by turns."""
    turns = np.outer(np.arange(samples), np.arange(first, stop)) / samples
    return np.asarray(np.exp(-2j * np.pi * turns).view(float))
