"""Gaussian noise in the record, and the converter."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft

from sonarsynth.conventions import Floats
from sonarsynth.description.method import returned
from sonarsynth.environment.noise import NoiseField
from sonarsynth.equations.noise.ambient_noise import power_density
from sonarsynth.equations.noise.filters import duration
from sonarsynth.geometry import Pose
from sonarsynth.products import Signals
from sonarsynth.receiver import Converter, Electronics, Elements, Filter, Sonar
from sonarsynth.signals.filtered_pulse import filter_response, fir
from sonarsynth.signals.segments import fast_length

QUIETEST = 1e-7
"""Bins of less noise power than this, relative to the loudest, are left empty."""


AT_ONCE = 16
"""Hydrophones whose noise is drawn at once: so few that the numbers stay in the cache."""
MATRIX_ELEMENTS = 1 << 22
"""Matrix elements of cross spectral densities that are computed at once."""


@lru_cache(maxsize=16)
def _noise_size(
    noise: NoiseField, antialias: Filter, sampling_frequency: float, length: int
) -> tuple[int, npt.NDArray[np.float32], Floats]:
    """First bin of `rfft` that is drawn; the standard deviation of the real and of the imaginary part of each; and what
    that is of noise of 1 Pa2/Hz."""
    f = _frequencies(1, length // 2, sampling_frequency, length)
    passed = filter_response(antialias, sampling_frequency, length)[1 : length // 2] ** 2
    power = returned(noise, "density", noise.density(f), f.shape) * passed
    bins = np.flatnonzero(power > QUIETEST * power.max())
    # half of the power of a bin in each part; irfft divides by the length
    size, gain = (np.sqrt(x * sampling_frequency * length) / 2.0 for x in (power, passed))
    drawn = slice(bins[0], bins[-1] + 1)
    return 1 + int(bins[0]), size[drawn].astype(np.float32), gain[drawn]


def _frequencies(first: int, end: int, sampling_frequency: float, length: int) -> Floats:
    """Of the bins of `rfft` from first to end, in Hz."""
    return np.asarray(np.arange(first, end) * (sampling_frequency / length), float)


def add_noise(
    signals: Signals,
    noise: NoiseField,
    sonar: Sonar,
    elements: Elements,
    rng: np.random.Generator,
    pose: Pose | None = None,
    sound_speed: float = 1500.0,
) -> Signals:
    """Signals with Gaussian noise through the anti-alias filter; a dead element stays silent. pose: of the array, which
    noise that hydrophones hear together depends on; none: that of the world's axes. sound_speed (m/s): at the array.

    Drawn in the frequency domain over a period longer than the window by the filter's length, so that the ends are not
    alike.
    """
    sensors, samples = signals.pressure.shape
    fs = signals.sampling_frequency
    length = fast_length(samples + int(np.ceil(duration(fir(sonar.antialias)) * fs)))
    low, size, gain = _noise_size(noise, sonar.antialias, fs, length)
    high = low + size.size
    fast = np.random.Generator(np.random.SFC64(rng.integers(0, 1 << 32, 4, np.uint32)))  # half the time of Philox
    frequency = _frequencies(low, high, fs, length)
    together: npt.NDArray[np.complex64] | None = None  # (sensor, bin) of noise that hydrophones hear together
    if noise.directions is not None:
        from sonarsynth.signals.noise.drawing import draw  # compiled, and seldom needed

        array_pose = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])) if pose is None else pose
        together = size * draw(noise.directions, elements, array_pose, sonar, frequency, sound_speed, fast)
    elif noise.correlated:
        position = elements.position if pose is None else pose.to_world(elements.position)
        together = np.empty((sensors, size.size), np.complex64)
        _draw_correlated(together, noise, frequency, gain, position, fast)
    from sonarsynth.equations.noise.complex_normals import complex_normals  # compiled: read where it is needed

    spectrum, power = np.zeros((AT_ONCE, length // 2 + 1), np.complex64), np.broadcast_to(size**2, (AT_ONCE, size.size))
    pressure = np.empty(signals.pressure.shape, np.result_type(signals.pressure, np.float32))
    for first in range(0, sensors, AT_ONCE):
        rows = slice(first, min(first + AT_ONCE, sensors))
        some = spectrum[: rows.stop - first]
        some[:, low:high] = complex_normals(power[: len(some)], fast) if together is None else together[rows]
        if not np.all(elements.gain[rows] == 1.0):
            some *= elements.gain[rows, None].astype(np.float32)
        np.add(signals.pressure[rows], irfft(some, length, axis=1)[:, :samples], out=pressure[rows])
    return replace(signals, pressure=pressure)


def _draw_correlated(
    out: npt.NDArray[np.complex64],
    noise: NoiseField,
    frequency: Floats,
    gain: Floats,
    position: Floats,
    rng: np.random.Generator,
) -> None:
    """Fills spectra (sensor, bin) of the cross spectral density of a noise, bin by bin, so that blocks do not matter.

    Raises ValueError for factors that are not finite.
    """
    block = max(MATRIX_ELEMENTS // len(position) ** 2, 1)
    for first in range(0, len(frequency), block):
        bins = slice(first, first + block)
        factors = noise.factors(frequency[bins], position)
        assert factors is not None, "noise that is correlated has factors"
        if not np.isfinite(factors).all():
            raise ValueError(f"{noise.kind} noise: its cross spectral density is not finite")
        drawn = rng.standard_normal((len(factors), factors.shape[2], 2), dtype=np.float32).astype(float)
        sound = np.einsum("fsk,fk->sf", factors, drawn[..., 0] + 1j * drawn[..., 1], optimize=True)
        out[:, bins] = gain[bins] * sound


class ElectronicNoise(NoiseField):
    """Noise of the preamplifiers, 1/f below a corner."""

    kind = "electronics"

    def __init__(self, electronics: Electronics) -> None:
        self.electronics = electronics

    def density(self, frequency: Floats) -> Floats:
        """As `NoiseField.density`."""
        own = self.electronics
        return power_density(own.level + 10.0 * np.log10(1.0 + own.corner / frequency))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ElectronicNoise) and self.electronics == other.electronics

    def __hash__(self) -> int:
        return hash(self.electronics)


def convert(signals: Signals, converter: Converter | None) -> Signals:
    """Signals as whole counts times the quantum (float32); samples beyond full scale are clipped, and counted.

    Counts run from -(2^(bits-1) - 1) to 2^(bits-1) - 1: the lowest code is kept free for "no value". Raises ValueError
    for NaN.
    """
    if converter is None:
        return signals
    from sonarsynth.equations.kernels.rounding import round_off

    exact = np.float32 if converter.bits <= 16 else np.float64  # in which every count and its half are numbers
    step, largest = exact(converter.quantum), exact(2 ** (converter.bits - 1) - 1)
    pressure, done, clipped = np.empty(signals.shape, np.float32), 0, signals.clipped
    for first, analog in signals.segments():
        pressure[:, done:first], done = 0.0, first + analog.shape[1]
        beyond, unknown = round_off(analog.astype(exact, copy=False), step, largest, pressure, first)
        if unknown:
            raise ValueError("the signals hold NaN: they cannot be converted")
        clipped += beyond
    pressure[:, done:] = 0.0
    return Signals(pressure, signals.start, signals.sampling_frequency, converter.quantum, clipped, signals.outside)
