"""A recording of the sea played at hydrophones: stretch after stretch, each a plane wave of a direction of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq

from sonarsynth.conventions import Floats
from sonarsynth.environment.noise import RecordedNoise
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.noise.filters import Fir, duration, response
from sonarsynth.equations.noise.wave_directions import drawn
from sonarsynth.geometry import Pose
from sonarsynth.products import Signals
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.noise.point_sources import MARGIN, QUIETEST
from sonarsynth.signals.segments import fast_length
from sonarsynth.sources.noise_source import NoiseRecording

STRETCH: Final = 2e-3
"""Seconds of the recording that come from one direction."""
CROSSFADE: Final = 1e-4
"""Seconds in which one stretch fades into the next. Their pressures add up to the recording; where they come at
different times, off the middle of the array, a quarter of the power is missing meanwhile: 0.05 dB in all."""
ENDS: Final = 4.0
"""Durations of the filter over which what is played fades in before the window, and out after it."""


def add_played_noise(
    signals: Signals,
    noise: RecordedNoise,
    sonar: Sonar,
    elements: Elements,
    pose: Pose,
    sound_speed: float,
    *,
    time: float,
    even: Callable[[int], Floats],
) -> Signals:
    """Signals with a recording through faces, baffle and anti-alias filter; in the middle of the array point
    hydrophones hear the recording itself.

    time: of the frame, in s since the start of the motions; even: two random numbers, evenly in 0 to 1, of the stretch
    of a number, from which its direction is drawn. sound_speed (m/s): at the array.
    """
    sampled = NoiseRecording(
        path=noise.path, pascals=noise.pascals, sampling_frequency=noise.sampling_frequency, dataset=noise.dataset,
        channel=noise.channel, start=noise.start,
    )  # fmt: skip
    fs, samples, passed = signals.sampling_frequency, signals.pressure.shape[1], fir(sonar.antialias)
    spare = int(np.ceil(elements.aperture / sound_speed * fs)) + MARGIN  # what a wave is early or late by
    ends = int(np.ceil(ENDS * duration(passed) * fs))
    lead = ends + 2 * spare
    length = fast_length(2 * lead + samples)
    first = time + signals.start - lead / fs
    played = _filtered(sampled.segment(first, 1.0 / fs, length), fs, passed, ends)
    size = fast_length(int(np.ceil((STRETCH + CROSSFADE) * fs)) + 2 * spare + 1)
    frequency = rfftfreq(size, 1.0 / fs)
    bins = np.flatnonzero((response(frequency, passed) ** 2 > QUIETEST) & (frequency > 0.0))
    f = frequency[bins]
    sound = np.zeros((elements.count, length + 2 * size), np.float32)
    last = first + length / fs
    for number in range(int(np.floor(first / STRETCH)), int(np.floor((last + CROSSFADE) / STRETCH)) + 1):
        begin = int(np.floor((number * STRETCH - 0.5 * CROSSFADE - first) * fs)) - spare  # of its own samples
        own = np.arange(begin, begin + size)
        inside = (own >= 0) & (own < length)
        piece = np.where(inside, played[np.clip(own, 0, length - 1)], 0.0) * _fade(first + own / fs, number)
        toward = _direction(noise, pose, even(number))
        sent = rfft(piece)[bins] * element_directivity(f, toward, elements.face, sound_speed)
        sent *= sonar.behind if toward[0] < 0.0 else 1.0
        turns = np.outer(elements.position @ toward, 2.0 * np.pi * f / sound_speed)
        spectrum = np.zeros((elements.count, frequency.size), np.complex64)
        wave = np.empty(turns.shape, np.complex64)
        wave.real, wave.imag = np.cos(turns), np.sin(turns)
        spectrum[:, bins] = wave * sent.astype(np.complex64)
        sound[:, begin + size : begin + 2 * size] += irfft(spectrum, size, axis=1)
    sound *= elements.gain[:, None].astype(np.float32)
    return replace(signals, pressure=signals.pressure + sound[:, size + lead : size + lead + samples])


def _filtered(pressure: Floats, sampling_frequency: float, passed: Fir, ends: int) -> Floats:
    """Pressure (sample,) through the anti-alias filter, over its period, fading in and out over `ends` samples: an edge
    would ring in bins that are left out."""
    through = response(rfftfreq(len(pressure), 1.0 / sampling_frequency), passed)
    inside = np.arange(len(pressure)) / ends
    gain = np.sin(0.5 * np.pi * np.minimum(np.minimum(inside, inside[::-1]), 1.0)) ** 2
    return np.asarray(irfft(rfft(pressure) * through, len(pressure)) * gain)


def _direction(noise: RecordedNoise, pose: Pose, even: Floats) -> Floats:
    """Unit vector (xyz) to where a stretch comes from, sonar frame."""
    directions = noise.directions
    assert directions is not None, "what is played has directions"
    one = directions.toward
    return pose.turn_to_body(drawn(directions.intensity, directions.edges, even) if one is None else one)


def _fade(clock: Floats, number: int) -> Floats:
    """Gain (sample,) of a stretch: those of all stretches add up to one."""
    since, until = clock - number * STRETCH, (number + 1) * STRETCH - clock
    rise, fall = (np.clip(t / CROSSFADE + 0.5, 0.0, 1.0) for t in (since, until))
    return np.asarray(np.sin(0.5 * np.pi * rise) ** 2 * np.sin(0.5 * np.pi * fall) ** 2)
