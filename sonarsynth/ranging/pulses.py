"""Find direct pulses in the signals and measure when each sensor hears them, to a small part of a sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.fft import ifft, irfft, next_fast_len, rfft
from scipy.ndimage import uniform_filter1d

from sonarsynth.acoustics.arrays import element_directivity
from sonarsynth.acoustics.bearings import wavefront_delays
from sonarsynth.conventions import Floats
from sonarsynth.products import Signals
from sonarsynth.sonar import Band, Elements

Complexes = npt.NDArray[np.complex128]

PULSE_HALF = 160e-6
"""Half length (s) of what is kept round a pulse after alignment: the snap in band and the ringing of its filter."""
DEAF = 1e-4
"""Mean square response (of one sensor on its axis) below which a bin counts as not heard at all."""
QUIET = 2.0
"""The mean power while a pulse passes over the array must exceed that of the quiet by this factor."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A pulse over the array, after alignment on a wavefront: its waveform, and who deviates."""

    frequency: Floats  # (bin,) Hz, evenly spaced
    template: Complexes  # (bin,) Pa s: the wave at the array centre, face directivity removed, time 0 at `time`
    inside: npt.NDArray[np.bool_]  # (bin,) in band
    time: float  # s at the array centre to which the template refers
    lag: Floats  # (sensor,) s: delay of each sensor after the wavefront
    weight: Floats  # (sensor,) (Pa s/s)^2: sum over bins of |2 pi f M|^2, inverse variance of a lag per noise power
    noise: float  # (Pa s)^2: mean power in a bin of what the model does not explain


def energy_track(signals: Signals, live: npt.NDArray[np.bool_], length: int) -> tuple[Floats, float]:
    """Mean power (Pa2, summed over live sensors) in a sliding window of `length` samples (sample,), and in quiet.

    The quiet power is the tenth part from below of short means: a snap and its echoes fill no more of the signals.
    """
    pressure = signals.pressure[live] if not live.all() else signals.pressure
    power = np.einsum("qn,qn->n", pressure, pressure, dtype=np.float64)
    track = uniform_filter1d(power, min(length, len(power)), mode="constant")
    quiet = np.percentile(uniform_filter1d(power, min(16, len(power))), 10)
    return np.asarray(np.maximum(track, 0.0)), float(max(quiet, 0.0))


def transit(elements: Elements, sound_speed: float) -> float:
    """Longest time (s) that a wave takes from the array centre to a sensor."""
    return elements.aperture / sound_speed


def excerpt(signals: Signals, centre: float, half: float) -> tuple[npt.NDArray[np.float32], float]:
    """Samples (sensor, sample) within `half` s of `centre`, zeros beyond the ends; and the time of the first (s)."""
    rate = signals.sampling_frequency
    first = int(np.floor((centre - half - signals.start) * rate))
    count = int(np.ceil(2 * half * rate)) + 1
    held = signals.pressure.shape[1]
    a, b = max(first, 0), min(first + count, held)
    cut = np.zeros((signals.pressure.shape[0], count), np.float32)
    if b > a:
        cut[:, a - first : b - first] = signals.pressure[:, a:b]
    return cut, signals.start + first / rate


def envelope_peaks(cut: npt.NDArray[np.float32], rate: float, band: Band) -> tuple[Floats, Floats]:
    """Time after the first sample (s) and relative height of the envelope's peak at each sensor, in band.

    The band is moved to zero frequency and sampled twice as fast as it needs; a parabola finds the top.
    """
    count = next_fast_len(cut.shape[1], real=True)
    inside = in_band(_frequencies(count, rate), band)
    base = rfft(cut, count, axis=1)[:, inside]
    short = next_fast_len(2 * base.shape[1])
    wave = ifft(base, short, axis=1)
    power = wave.real**2 + wave.imag**2
    top = np.clip(power.argmax(axis=1), 1, short - 2)
    rows = np.arange(len(power))
    place, height = parabola(*(np.sqrt(power[rows, top + i]) for i in (-1, 0, 1)))
    return (top + place) * (count / (short * rate)), height


def parabola(left: npt.ArrayLike, middle: npt.ArrayLike, right: npt.ArrayLike) -> tuple[Floats, Floats]:
    """Place (in samples from the middle, within +-0.5) and height of the vertex through three equidistant values."""
    a, b, c = (np.asarray(v, float) for v in (left, middle, right))
    bend = a - 2 * b + c
    safe = np.where(bend < 0, bend, -1.0)
    place = np.where(bend < 0, np.clip(0.5 * (a - c) / safe, -0.5, 0.5), 0.0)
    return np.asarray(place), np.asarray(b - 0.25 * (a - c) * place)


@dataclass(frozen=True, eq=False)
class Aligned:
    """Spectra of a pulse at the sensors, each about its own time, everything else cut away."""

    frequency: Floats  # (bin,) Hz, evenly spaced: those of the band, or all up to half the sampling frequency
    spectrum: Complexes  # (sensor, bin) Pa s; 0 for dead sensors
    time: Floats  # (sensor,) s to which the phases refer
    inside: npt.NDArray[np.bool_]  # (bin,) in band
    spacing: float  # Hz


def align(signals: Signals, elements: Elements, band: Band, time: Floats, *, whole: bool = False) -> Aligned:
    """Cut a short window out of each sensor about `time` (sensor,), when its pulse is expected.

    Frequencies of the band, or `whole`: all of them, from which the waveform can be had. The window moves with the
    time, not with the samples, so that every sensor's pulse is cut alike.
    """
    rate, held = signals.sampling_frequency, signals.pressure.shape[1]
    half = max(int(PULSE_HALF * rate), 4)
    place = (time - signals.start) * rate
    first = np.floor(place).astype(np.int64) - half
    index = first[:, None] + np.arange(2 * half)
    window = _flat_top((index - place[:, None]) / half)
    window[(index < 0) | (index >= held)] = 0.0
    cut = np.take_along_axis(signals.pressure, np.clip(index, 0, held - 1), axis=1) * (window * elements.gain[:, None])
    f = _frequencies(2 * half, rate)
    kept = np.flatnonzero(in_band(f, band) | whole)
    turns = _phasor((place - first) / rate, f[1], kept)
    spectrum = rfft(cut, axis=1)[:, kept] * turns / rate
    return Aligned(f[kept], spectrum, time, in_band(f[kept], band), float(f[1]))


def measure(
    aligned: Aligned, elements: Elements, sound_speed: float, direction: Floats, curvature: float, time: float
) -> Pulse:
    """Each sensor's lag on a wavefront, and the waveform that the wavefront carries.

    The wave at the centre, W(f), is unknown. Sensor q hears M = W(f) D(f) R/R_q, D the face directivity towards the
    source, which may well be near zero or negative: W = sum conj(h) P / sum |h|^2 with h = D R/R_q is its maximum
    likelihood, and sensors and bins that hear little count for little. The lag of sensor q is the maximum of
    Re sum_f conj(M) P exp(i 2 pi f lag), by one Newton step: lags are small after alignment, and the caller iterates.
    """
    f = aligned.frequency
    toward = direction - curvature * elements.position
    distance = np.linalg.norm(toward, axis=1)
    response = element_directivity(f, (toward / distance[:, None])[:, None], elements.face, sound_speed)
    response = response * (elements.gain / distance)[:, None]
    shift = time + wavefront_delays(elements.position, direction, curvature, sound_speed) - aligned.time
    heard = aligned.spectrum * _phasor(shift, aligned.spacing, np.rint(f / aligned.spacing))
    power = np.sum(response * response, axis=0) + DEAF * elements.count
    template = np.sum(response * heard, axis=0) / power
    inside = aligned.inside
    omega = 2 * np.pi * f[inside]
    model = response[:, inside] * template[inside]
    rest = heard[:, inside] - model
    weight = (model.real**2 + model.imag**2) @ omega**2
    lag = (model.imag * rest.real - model.real * rest.imag) @ omega / np.where(weight > 0, weight, np.inf)
    live = elements.gain != 0
    freedom = max(2 * (np.sum(live) - 1) * len(omega) - np.sum(live), 1)
    noise = 2 * float(np.sum(rest.real[live] ** 2 + rest.imag[live] ** 2)) / freedom
    return Pulse(f, template, inside, time, lag, weight, noise)


def template_spectrum(pulse: Pulse, frequency: Floats) -> Complexes:
    """The waveform of the pulse at the array centre, Fourier transformed at other frequencies (bin,), in Pa s.

    Phases refer to `pulse.time`; the pulse must be of an alignment of all frequencies. It is short, so its spectrum is
    smooth: its waveform is transformed directly.
    """
    half = len(pulse.frequency) - 1
    rate = 2 * pulse.frequency[-1]
    centred = pulse.template * (-1.0) ** np.arange(half + 1)  # time 0 at the middle sample
    wave = irfft(centred, 2 * half)
    angle = np.outer(frequency, (np.arange(2 * half) - half) / rate)
    return np.asarray(np.exp(-2j * np.pi * angle) @ wave, np.complex128)


def _frequencies(count: int, rate: float) -> Floats:
    return np.asarray(np.arange(count // 2 + 1) * (rate / count))


def in_band(frequency: Floats, band: Band) -> npt.NDArray[np.bool_]:
    """Which frequencies lie in the band."""
    return (frequency >= band.low) & (frequency <= band.high)


def _phasor(shift: Floats, spacing: float, bins: npt.NDArray[Any]) -> Complexes:
    """exp(i 2 pi f shift) (sensor, bin) at f = spacing * bins (consecutive), by products of coarse and fine steps."""
    fine = 8
    angle = 2j * np.pi * spacing * shift
    coarse = np.exp(np.outer(angle, bins[0] + np.arange(0, len(bins), fine)))
    steps = np.exp(np.outer(angle, np.arange(fine)))
    product = coarse[:, :, None] * steps[:, None, :]
    return np.asarray(product.reshape(len(shift), -1)[:, : len(bins)])


def _flat_top(place: Floats) -> Floats:
    """Window over place in -1..1: 1 in the middle three quarters, raised-cosine flanks, 0 beyond."""
    into = np.clip((1 - np.abs(place)) * 4, 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * into))
