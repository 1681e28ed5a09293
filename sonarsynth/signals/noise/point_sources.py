"""Noise of one place at hydrophones: its spectrum, or what it plays, through each path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.fft import irfft, rfft, rfftfreq

from sonarsynth.conventions import Floats
from sonarsynth.description.method import returned
from sonarsynth.equations.noise.filters import duration, response
from sonarsynth.products import Arrivals, Signals
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals.array_paths import array_paths
from sonarsynth.signals.direct_sum import attenuation, exact_spectra, relative_absorption
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.segments import fast_length
from sonarsynth.sources.noise_source import NoiseRecording, NoiseSource
from sonarsynth.state import Emission

MARGIN = 8
"""Samples of the period beyond window, filter and delays."""
QUIETEST = 1e-7
"""Bins that the filter passes less of are left empty."""


def add_noise_source(
    signals: Signals,
    source: NoiseSource,
    arrivals: Arrivals,
    instant: Emission,
    elements: Elements,
    sonar: Sonar,
    absorption: Callable[[Floats], Floats] | None,
    *,
    time: float,
    faster: float,
    random: np.random.Generator,
) -> Signals:
    """Signals with the sound of a source.

    arrivals: its paths, of an emission of 1 Pa at 1 m (`instant`) and delayed after that; time: of this emission, in s
    since the start of the motions; faster: how many times as fast as it was played the array hears a recording.
    """
    if not arrivals.delay.size:
        return signals
    fs, samples = signals.sampling_frequency, signals.pressure.shape[1]
    front = array_paths(arrivals, (instant,), elements, attenuation(absorption, sonar.band.centre))
    passed = fir(sonar.antialias)
    first, beside = float(arrivals.delay.min()), 2.0 * elements.aperture / arrivals.sound_speed
    early = first - beside
    spread = float(arrivals.delay.max()) + beside - early
    lead = int(np.ceil((spread + duration(passed)) * fs)) + MARGIN
    length = fast_length(lead + samples + MARGIN)
    frequency = rfftfreq(length, 1.0 / fs)
    through = response(frequency, passed)
    drawn = np.flatnonzero((through**2 > QUIETEST) & (frequency > 0.0))
    heard = slice(drawn[0], drawn[-1] + 1)
    f = frequency[drawn]
    sent = np.zeros(frequency.size, complex)
    if isinstance(source.sound, NoiseRecording):
        begin = (signals.start - instant.time - first + beside) * fs - lead  # after the emission is heard
        played = source.sound.segment(time + begin * faster / fs, faster / fs, length)
        sent[drawn] = rfft(played)[drawn] * through[drawn]
    else:
        normal = random.standard_normal((2, drawn.size))
        density = returned(source.sound, "density", source.sound.density(f), f.shape)
        sent[drawn] = (normal[0] + 1j * normal[1]) * through[drawn] * np.sqrt(density * fs * length) / 2
    relative = relative_absorption(absorption, frequency[heard], sonar.band.centre)
    spectrum = np.zeros((elements.count, frequency.size), np.complex64)  # as exact as pressure is
    spectrum[:, heard] = exact_spectra(front, elements, frequency[heard], relative, early) * sent[heard]
    sound = irfft(spectrum, length, axis=1)[:, lead : lead + samples]
    return replace(signals, pressure=signals.pressure + sound)
