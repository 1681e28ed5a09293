"""Times at which each sensor hears a direct pulse, measured to a small part of a sample."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import fftfreq, ifft, next_fast_len, rfft

from sonarsynth.conventions import Bools, Complexes, Floats, Ints
from sonarsynth.equations.arrays.correlated_errors import correlated_error_factor
from sonarsynth.equations.arrays.gates import short_spectra
from sonarsynth.equations.arrays.spherical_wave import Wavefront, parabola, wavefront_delays
from sonarsynth.products import Signals
from sonarsynth.ranging import ranging_kernels
from sonarsynth.receiver import Band, Elements, Sonar

PULSE_HALF = 160e-6
"""Half length (s) of what is kept round a pulse after alignment: the snap in band and the ringing of its filter."""
LONGEST_HALF = 2e-3
"""The same at most (s): bands whose pulses last longer tell no direct pulse from its echoes."""
PERIODS = 2.0
"""The same in units of the inverse of the bandwidth, where that is more."""
CUT = 0.1
"""Of the peak of the envelope: what is louder where the window falls is a pulse that lasts longer, whose time and whose
lags would be in part those of the window: it is looked at in one `LONGER` times as long."""
LONGER = 3.0
"""Where faces have a null in the band, or that is low, a window cuts off tails that each hydrophone hears otherwise.
They move the peak by up to 88 ns (4.2 cm, 70 deg), 2.1 us (11.8 cm, 49 deg, 10 to 34 kHz) and 3 us (2.4 kHz wide), and
bend the wavefront by 3 ns (1.4 m, 49 deg); by under 1 ns, 95 ns, 40 ns and 0.1 ns in one so many times as long."""
DEAF = 1e-4
"""Mean square response (of one sensor on its axis) below which a bin counts as not heard at all."""
DEAFEST = 1e-8
"""The same where there is no noise: single precision."""
NEXT_TO_NULL = 1e3
"""Next to a null of the faces more is in doubt than noise: it counts as so many times its power. Times of `grid.yaml`
58 degrees and more off the axis err by 3.0 ns by once, and by that 2.7: 1.2 and 1.1 of what is predicted."""
FLOOR = 1e-9
"""Standard error (s) of a lag without any noise: what cutting the pulse's tail off does, by windows of `PULSE_HALF`;
more by longer ones of pulses that last, over the square of `LONGER` by those for tails."""
FINE = 256
"""Samples of an envelope at least: at the 18 of a band of 3 kHz peaks err by 5 us, more than aligning can undo; and
where there are two, which is the higher follows from where samples fall."""
BESIDE = 4
"""Sensors that count as the neighbours of one: as many as it has on a lattice."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A pulse over the array, compared with a wavefront: its waveform, and who deviates."""

    frequency: Floats  # (bin,) Hz, evenly spaced
    template: Complexes  # (bin,) Pa s: the wave at the array centre, face directivity removed, time 0 at `time`
    time: float  # s at the array centre to which the template refers
    lag: Floats  # (sensor,) s: delay of each sensor after the wavefront
    weight: Floats  # (sensor,) (Pa s/s)^2: sum over bins of |2 pi f M|^2, inverse variance of a lag per noise power
    noise: float  # (Pa s)^2: mean power in a bin of noise: twice that of what is out of phase with the model
    rest: float  # (Pa s)^2: the same of all that the model does not explain
    power: Floats  # (bin,) sum over sensors of their responses squared: so much less noise is in the template
    share: float  # of the power of the pulse at the sensors: not explained by the model, or twice what is out of phase
    deaf: float = DEAF  # as for `waveform`
    other: Pulse | None = None  # by a longer window, or a shorter, where that of a snap cuts off tails

    @property
    def window(self) -> float:
        """Length (s) of the window that it was cut out with."""
        return float(1.0 / (self.frequency[1] - self.frequency[0])) if len(self.frequency) > 1 else 0.0

    @property
    def by_window(self) -> tuple[Pulse, Pulse]:
        """Itself by the shorter and by the longer window of those that it was measured by."""
        other = self.other or self
        return (self, other) if self.window < other.window else (other, self)

    @property
    def lasts(self) -> bool:
        """Whether the envelope of the waveform is over `CUT` of its peak where the window is not flat any more."""
        envelope, half = self._envelope, 4 * len(self.template)
        return bool(envelope[3 * half // 4 : 5 * half // 4 + 1].max() > CUT * envelope.max())

    @property
    def aside(self) -> float:
        """How far (s) the peak of the envelope is from the time to which the template refers."""
        envelope = self._envelope
        return float(abs(fftfreq(len(envelope))[envelope.argmax()]) * self.window)

    @property
    def _envelope(self) -> Floats:
        return np.asarray(np.abs(ifft(_taper(len(self.template)) * self.template, 8 * len(self.template))))

    def one_tone(self, share: float) -> bool:
        """Whether less than a share of its power tells it from itself a period later, at its mean frequency."""
        power = np.abs(self.template) ** 2
        mean = power @ self.frequency / max(power.sum(), 1e-300)
        return bool(power @ (self.frequency - mean) ** 2 * (2 * np.pi / mean) ** 2 < share * power.sum())

    @property
    def noise_to_signal(self) -> float:
        """Noise of the mean of all sensors over the wave, power in a bin, times `NEXT_TO_NULL`: `DEAF` at most, and
        `DEAFEST` at least."""
        loud = float(np.mean(np.abs(self.template) ** 2)) * max(int(np.count_nonzero(self.weight)), 1)
        return float(np.clip(NEXT_TO_NULL * self.noise / max(loud, 1e-300), DEAFEST, DEAF))


def half_length(band: Band) -> float:
    """Half length (s) of what is kept round a pulse: a band's narrowest pulse lasts 1/bandwidth."""
    return max(PULSE_HALF, PERIODS / (band.high - band.low))


def cuts_tails(band: Band) -> bool:
    """Whether a window of so few periods of the band's lower edge, or inverses of its width, cuts off tails that move
    the peak of the envelope: by up to 20 ns from 2 to 22 kHz, 2 ns from 10 to 60 kHz, 0.5 ns or less beyond."""
    return half_length(band) * min(band.low / 3.0, (band.high - band.low) / 5.0) < 1.0


def null_in_band(elements: Elements, sonar: Sonar, direction: Floats) -> bool:
    """Whether faces hear nothing of a wave from a direction (xyz, sonar frame) at a frequency in the band: they are a
    whole number of wavelengths wide along it. The bins, as few as 7, may lie beside it."""
    across = np.abs(direction[1:]) * elements.face / sonar.assumed_sound_speed  # s, from edge to edge
    return bool(np.any(np.floor(across * sonar.band.high) > np.floor(across * sonar.band.low)))


def rounding(signals: Signals, peak: float, half: float = PULSE_HALF) -> float:
    """Mean power in a bin, (Pa s)^2, of what the converter (a count) and single precision (of `peak`, Pa) round off, of
    spectra of 2 `half` (s)."""
    step = signals.quantum**2 + (float(np.finfo(np.float32).eps) * peak) ** 2
    return step / 12 * 2 * half / signals.sampling_frequency


def transit(elements: Elements, sound_speed: float) -> float:
    """Longest time (s) that a wave takes from the array centre to a sensor."""
    return elements.aperture / sound_speed


def excerpt(signals: Signals, centre: float, half: float) -> tuple[npt.NDArray[np.float32], float]:
    """Samples (sensor, sample) within `half` s of `centre`, zeros beyond the ends; and the time of the first (s)."""
    rate = signals.sampling_frequency
    first = int(np.floor((centre - half - signals.start) * rate))
    count = int(np.ceil(2 * half * rate)) + 1
    cut = signals.pressure[:, max(first, 0) : max(first + count, 0)]
    if cut.shape[1] < count:
        early = min(max(-first, 0), count - cut.shape[1])
        cut = np.pad(cut, ((0, 0), (early, count - cut.shape[1] - early)))
    return cut, signals.start + first / rate


def envelope_peaks(cut: npt.NDArray[np.float32], rate: float, band: Band) -> tuple[Floats, Floats]:
    """Time after the first sample (s) and relative height of the envelope's peak at each sensor, in band.

    The band is moved to zero frequency and sampled twice as fast as it needs, `FINE` times at least; a parabola finds
    the top.
    """
    count = next_fast_len(cut.shape[1], real=True)
    base = rfft(cut, count, axis=1)[:, in_band(_frequencies(count, rate), band)]
    short = next_fast_len(max(2 * base.shape[1], FINE))
    wave = ifft(base, short, axis=1)
    power = wave.real**2 + wave.imag**2
    top = np.clip(power.argmax(axis=1), 1, short - 2)
    rows = np.arange(len(power))
    offset, height = parabola(*(np.sqrt(power[rows, top + i]) for i in (-1, 0, 1)))
    return (top + offset) * (count / (short * rate)), height


@dataclass(frozen=True, eq=False)
class AlignedPulse:
    """Spectra of a pulse at the sensors, each about its own time, everything else cut away."""

    frequency: Floats  # (bin,) Hz, evenly spaced: those of the band, or all up to half the sampling frequency
    spectrum: Complexes  # (sensor, bin) Pa s; 0 for dead sensors
    time: Floats  # (sensor,) s to which the phases refer
    spacing: float  # Hz


def align(signals: Signals, elements: Elements, band: Band, time: Floats, longer: float = 1.0) -> AlignedPulse:
    """A window of each sensor about `time` (sensor,), when its pulse is expected: a short one, times `longer`."""
    return cut(signals, elements.gain, time, longer * half_length(band), band)


def cut(signals: Signals, gain: Floats | Bools, time: Floats, half: float, band: Band | None) -> AlignedPulse:
    """A window of `half` (s) to either side of `time` (sensor,), times gain (sensor,); without a band: all frequencies,
    from which the waveform can be had.

    The window moves with the time, not with the samples, so that every sensor's pulse is cut alike.
    """
    rate = signals.sampling_frequency
    samples = max(int(half * rate), 4)
    arrival = (time - signals.start) * rate
    window = ranging_kernels.cut_out(signals.pressure, arrival, samples, gain / rate)
    f = _frequencies(2 * samples, rate)
    bins = slice(None) if band is None else in_band(f, band)
    spectrum = rfft(window, axis=1) if band is None else short_spectra(window, *bins.indices(len(f))[:2])
    since = (arrival - np.floor(arrival) + samples) / rate
    return AlignedPulse(f[bins], ranging_kernels.turned(spectrum, since, f[bins][0], f[1]), time, float(f[1]))


@dataclass(frozen=True, eq=False)
class Wave:
    """What a wavefront brings, and what of it each sensor hears."""

    template: Complexes  # (bin,) Pa s: the wave at the array centre, face directivity removed
    spectrum: Complexes  # (sensor, bin) Pa s, moved to the centre
    response: Floats  # (sensor, bin) of a sensor to the wave at the centre
    power: Floats  # (bin,) sum over sensors of the response squared


def waveform(
    aligned: AlignedPulse,
    elements: Elements,
    sound_speed: float,
    direction: Floats,
    curvature: float,
    time: float,
    deaf: float = DEAF,
) -> Wave:
    """The waveform that a wavefront carries; held down where the mean square response is not well over `deaf`.

    The wave at the centre, W(f), is unknown. Sensor q hears M = W(f) D(f) R/R_q, D the face directivity towards the
    source, which may well be near zero or negative: W = sum conj(h) P / sum |h|^2 with h = D R/R_q is its maximum
    likelihood, and sensors and bins that hear little count for little.
    """
    shift = time + wavefront_delays(elements.position, direction, curvature, sound_speed) - aligned.time
    wave = direction, curvature, elements.face / sound_speed, aligned.frequency[0], aligned.spacing
    spectrum, response, total, power = ranging_kernels.common_wave(
        aligned.spectrum, shift, elements.position, elements.gain, *wave
    )
    return Wave(total / (power + deaf * elements.count), spectrum, response, power)


def measure(
    aligned: AlignedPulse,
    elements: Elements,
    sound_speed: float,
    direction: Floats,
    curvature: float,
    time: float,
    deaf: float = DEAF,
) -> Pulse:
    """Each sensor's lag on a wavefront, and the waveform that the wavefront carries; `deaf` as for `waveform`.

    The lag of sensor q is the maximum of Re sum_f conj(M) P exp(i 2 pi f lag), M as in `waveform`, by one Newton step:
    lags are small after alignment, and the caller iterates.
    """
    wave = waveform(aligned, elements, sound_speed, direction, curvature, time, deaf)
    f, omega = aligned.frequency, 2 * np.pi * aligned.frequency
    slope, weight, unexplained, across = ranging_kernels.lag_sums(wave.spectrum, wave.response, wave.template, omega)
    lag = slope / np.where(weight > 0, weight, np.inf)
    # gains and responses that are not the model's are in phase, and no noise; half of noise, or of another wave, is not
    left, noise = float(unexplained.sum()), 2.0 * float(across.sum())
    power = left + float(wave.power @ np.abs(wave.template) ** 2)
    share = min(left, noise) / power if power > 0 else 1.0
    free = max((int(np.count_nonzero(elements.gain)) - 1) * len(omega), 1)
    return Pulse(f, wave.template, time, lag, weight, noise / free, left / free, wave.power, share, deaf)


def lag_variance(wave: Wavefront, pulse: Pulse, elements: Elements, rounding: float, half: float = PULSE_HALF) -> float:
    """Variance of a lag of weight one: the larger of what the lags show and of the Cramer-Rao bound for the noise seen.

    What lags show over `FLOOR`, which allows for that, is taken times `correlated_error_factor`. The noise is not taken
    below that of `rounding`, (Pa s)^2 in a bin. half (s): of the windows that pulses were cut out by.
    """
    count = int(np.sum(pulse.weight > 0))
    floor = FLOOR * half / PULSE_HALF / (1.0 if pulse.by_window[0] is pulse else LONGER**2)
    least = floor**2 * float(np.sum(pulse.weight)) / max(count, 1)
    shown = float(pulse.weight @ wave.residual**2) / max(count - 4, 1)
    if shown > least and np.count_nonzero(elements.gain) > 2:
        error = np.sqrt(pulse.weight) * wave.residual
        shown += (shown - least) * (correlated_error_factor(error, *neighbours(elements)) - 1)
    return float(np.max([shown, least, 0.5 * pulse.noise, 0.5 * rounding]))


@lru_cache(maxsize=16)
def neighbours(elements: Elements) -> tuple[Ints, Ints]:
    """Live sensors (live,), and those next to each (live, beside)."""
    from scipy.spatial import cKDTree  # loading it takes a third as long as planning

    live = np.flatnonzero(elements.gain)
    count = min(BESIDE, len(live) - 1)
    _, near = cKDTree(elements.position[live]).query(elements.position[live], range(2, count + 2))
    return live, live[near]


@lru_cache(maxsize=16)
def _taper(bins: int) -> Floats:
    """Weights (bin,) of the frequencies of a band: those at its edges do not count."""
    return np.asarray(np.sin(np.pi * (np.arange(bins) + 0.5) / bins) ** 2)


def _frequencies(count: int, rate: float) -> Floats:
    return np.asarray(np.arange(count // 2 + 1) * (rate / count))


def in_band(frequency: Floats, band: Band) -> slice:
    """The bins of ascending frequencies that lie in the band; the nearest one where the band falls between two."""
    low, high = np.searchsorted(frequency, band.low), np.searchsorted(frequency, band.high, side="right")
    if low == high:
        low = np.argmin(np.abs(frequency - band.centre))
        high = low + 1
    return slice(int(low), int(high))
