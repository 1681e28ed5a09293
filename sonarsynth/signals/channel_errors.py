"""Errors of channels: response, cross-talk, sampling clock and overload; and their correction."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from sonarsynth.conventions import Bools
from sonarsynth.equations.noise.filters import TAPS, windowed_sinc
from sonarsynth.products import Signals
from sonarsynth.receiver import Elements
from sonarsynth.receiver.sensor_errors import DrawnErrors, Overload, SensorErrors, SensorState

if TYPE_CHECKING:
    from scipy.sparse import csr_array

BLEND = 256
"""Samples over which the end of a window is blended into its start, so that a filter meets no step there."""
TOGETHER = 32
"""Sensors filtered at once, which bounds the memory."""


def respond(signals: Signals, drawn: DrawnErrors, sound_speed: float) -> Signals:
    """Signals after gain, phase and delay of each channel; dead ones are silent. Windows are taken for periodic: the
    ends are wrong for as long as the delay."""
    return _through(signals, drawn, sound_speed, drawn.state != SensorState.DEAD)


def corrected(signals: Signals, errors: SensorErrors, drawn: DrawnErrors, sound_speed: float) -> Signals:
    """Signals that processing uses: corrected for the errors that it knows (`SensorErrors.known`)."""
    if errors.known == "none":
        return signals
    return _through(signals, drawn, sound_speed, drawn.works, phases=errors.known == "all", inverse=True)


def _through(
    signals: Signals,
    drawn: DrawnErrors,
    sound_speed: float,
    works: Bools,
    *,
    phases: bool = True,
    inverse: bool = False,
) -> Signals:
    """Signals after the response of channels that work (sensor,), or its inverse; without phases, of gains alone."""
    if not (phases and (drawn.phase.any() or drawn.delays(sound_speed).any())):
        gain = works * (1.0 / drawn.gain if inverse else drawn.gain)
        return replace(signals, pressure=signals.pressure * gain[:, None].astype(np.float32))
    response = _response(drawn, _length(signals), signals.sampling_frequency, sound_speed, inverse)
    return _filtered(signals, response, works)


@lru_cache(maxsize=4)
def _response(
    drawn: DrawnErrors, samples: int, rate: float, sound_speed: float, inverse: bool
) -> npt.NDArray[np.complex64]:
    """As `DrawnErrors.response`, or one over it, at the frequencies of so many samples: the same in all frames of a
    sequence."""
    response = drawn.response(rfftfreq(samples, 1.0 / rate), sound_speed)
    return (1.0 / response if inverse else response).astype(np.complex64)


def _length(signals: Signals) -> int:
    """Samples of the window, made periodic."""
    return int(next_fast_len(signals.pressure.shape[1] + BLEND, real=True))


def _filtered(signals: Signals, response: npt.NDArray[np.complex64], works: Bools) -> Signals:
    """Signals times a response (sensor, bin), silent where they do not work (sensor,); a few at once."""
    p, length = signals.pressure, _length(signals)
    down = np.linspace(1.0, 0.0, length - p.shape[1] + 2, dtype=np.float32)[1:-1]
    out = np.empty(p.shape, np.float32)
    for first in range(0, len(p), TOGETHER):
        rows = slice(first, first + TOGETHER)
        periodic = np.concatenate([p[rows], p[rows, -1:] * down + p[rows, :1] * (1.0 - down)], axis=1)
        spectrum = rfft(periodic.astype(np.float32, copy=False), axis=1) * response[rows]
        out[rows] = irfft(spectrum, length, axis=1)[:, : p.shape[1]] * works[rows, None]
    return replace(signals, pressure=out)


def talk(signals: Signals, elements: Elements, level: float) -> Signals:
    """Signals with what each channel gets of its neighbours, at a level (dB, negative) below them: (I + K) x."""
    return replace(signals, pressure=(signals.pressure + neighbours(elements, level) @ signals.pressure))


def neighbours(elements: Elements, level: float) -> csr_array:
    """K (sensor, sensor): the amplitude at neighbours, else 0; an element that gives nothing gets nothing either."""
    from scipy.sparse import csr_array  # here and below: few scenes need it, and it is slow to load

    count = elements.count
    position = np.stack([elements.column, elements.row], axis=1) if elements.on_lattice else np.arange(count)[:, None]
    number = {tuple(at): n for n, at in enumerate(position.tolist()) if elements.gain[n] > 0.0}
    steps = np.concatenate([np.eye(position.shape[1], dtype=int), -np.eye(position.shape[1], dtype=int)])
    pairs = [
        (n, number[near]) for at, n in number.items() for near in map(tuple, (at + steps).tolist()) if near in number
    ]
    to, of = np.array(pairs, dtype=int).reshape(-1, 2).T
    return csr_array((np.full(len(pairs), 10.0 ** (level / 20.0), np.float32), (to, of)), shape=(count, count))


def sampled(signals: Signals, jitter: float, clock_rate: float, random: np.random.Generator) -> Signals:
    """Signals at the times of a real clock: sample n, n/fs after the start, is taken at n/fs (1 + clock_rate) and
    `jitter` (s, standard deviation) off; the same for all channels. Beyond the window is silence."""
    from scipy.sparse import csr_array

    samples, fs = signals.pressure.shape[1], signals.sampling_frequency
    position = np.arange(samples) * (1.0 + clock_rate) + fs * jitter * random.standard_normal(samples)
    tap = np.floor(position).astype(int)[:, None] + np.arange(1 - TAPS // 2, TAPS // 2 + 1)
    away = position[:, None] - tap
    weight = windowed_sinc(away)
    inside = (tap >= 0) & (tap < samples)
    at = np.broadcast_to(np.arange(samples)[:, None], tap.shape)
    matrix = csr_array((weight[inside].astype(np.float32), (at[inside], tap[inside])), shape=(samples, samples))
    return replace(signals, pressure=np.ascontiguousarray((matrix @ signals.pressure.T).T))


def overloaded(signals: Signals, overload: Overload) -> Signals:
    """Signals cut at the level of overload; after that each channel's gain comes back as 1 - exp(-t/recovery)."""
    p = signals.pressure
    cut = np.abs(p) > overload.level
    if not cut.any():
        return signals
    n = np.arange(p.shape[1])
    last = np.maximum.accumulate(np.where(cut, n, -(1 << 40)), axis=1)
    since = (n - last) / (signals.sampling_frequency * overload.recovery)
    gain = np.where(cut, 1.0, -np.expm1(-since))
    return replace(signals, pressure=(np.clip(p, -overload.level, overload.level) * gain).astype(np.float32))
