"""What the instrument adds to the sound: noise, and the converter."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import FlatNoise, Noise
from sonarsynth.equations.noise.ambient_noise import power_density, wenz_level
from sonarsynth.equations.noise.filters import duration, response
from sonarsynth.products import Signals
from sonarsynth.receiver import Converter, Elements, Filter, Sonar
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.segments import fast_length

QUIETEST = 1e-7
"""Bins of less noise power than this, relative to the loudest, are left empty."""


def noise_density(noise: Noise, frequency: Floats) -> Floats:
    """One-sided power spectral density (Pa2/Hz) of ambient noise at frequencies (Hz, positive)."""
    if isinstance(noise, FlatNoise):
        return power_density(np.full(frequency.shape, noise.level))
    return power_density(wenz_level(frequency, noise.shipping, noise.wind_speed))


@lru_cache(maxsize=16)
def _noise_size(
    noise: Noise, antialias: Filter, sampling_frequency: float, length: int
) -> tuple[int, npt.NDArray[np.float32]]:
    """First bin of `rfft` that is drawn, and the standard deviation of the real and of the imaginary part of each."""
    f = np.asarray(np.arange(1, length // 2) * (sampling_frequency / length), float)
    power = noise_density(noise, f) * response(f, fir(antialias)) ** 2
    heard = np.flatnonzero(power > QUIETEST * power.max())
    # half of the power of a bin in each part; irfft divides by the length
    size = np.sqrt(power * sampling_frequency * length) / 2.0
    return 1 + int(heard[0]), size[heard[0] : heard[-1] + 1].astype(np.float32)


def add_noise(
    signals: Signals, noise: Noise | None, sonar: Sonar, elements: Elements, rng: np.random.Generator
) -> Signals:
    """Signals with Gaussian noise, independent between hydrophones, through the anti-alias filter; a dead element stays
    silent.

    Drawn in the frequency domain over a period longer than the window by the filter's length, so that the ends are not
    alike.
    """
    if noise is None:
        return signals
    sensors, samples = signals.pressure.shape
    fs = signals.sampling_frequency
    length = fast_length(samples + int(np.ceil(duration(fir(sonar.antialias)) * fs)))
    low, size = _noise_size(noise, sonar.antialias, fs, length)
    high = low + size.size
    spectrum = np.zeros((sensors, length // 2 + 1), np.complex64)
    fast = np.random.Generator(np.random.SFC64(rng.integers(0, 1 << 32, 4, np.uint32)))  # half the time of Philox
    drawn = fast.standard_normal((sensors, 2 * (high - low)), dtype=np.float32).view(np.complex64)
    np.multiply(drawn, size, out=spectrum[:, low:high])
    if not np.all(elements.gain == 1.0):
        spectrum *= elements.gain[:, None].astype(np.float32)
    return replace(signals, pressure=signals.pressure + irfft(spectrum, length, axis=1, overwrite_x=True)[:, :samples])


def convert(signals: Signals, converter: Converter | None) -> Signals:
    """Signals as whole counts times the quantum (float32); samples beyond full scale are clipped, and counted.

    Counts run from -(2^(bits-1) - 1) to 2^(bits-1) - 1: the lowest code is kept free for "no value". Raises ValueError
    for NaN.
    """
    if converter is None:
        return signals
    largest = 2 ** (converter.bits - 1) - 1
    exact = np.float32 if converter.bits <= 16 else np.float64  # in which every count and its half are numbers
    counts = signals.pressure / exact(converter.quantum)
    np.rint(counts, out=counts)
    highest, lowest = counts.max(initial=0.0), counts.min(initial=0.0)
    if np.isnan(highest):
        raise ValueError("the signals hold NaN: they cannot be converted")
    clipped = 0
    if max(highest, -lowest) > largest:
        clipped = int(np.count_nonzero(np.abs(counts) > largest))
        np.clip(counts, -largest, largest, out=counts)
    counts *= exact(converter.quantum)
    pressure = counts.astype(np.float32, copy=False)
    return replace(signals, pressure=pressure, quantum=converter.quantum, clipped=signals.clipped + clipped)
