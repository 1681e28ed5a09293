"""When a snap came, in bands that are low or wide: its filter rings longer than the window that it is cut out by."""

from __future__ import annotations

import numpy as np
import pytest

from sonarsynth.conventions import direction
from sonarsynth.environment.sea import Profile
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.products import Signals
from sonarsynth.ranging import SensorDelays
from sonarsynth.receiver import Band, BandPass, PlanarLattice, Sonar, elements
from sonarsynth.signals.filtered_pulse import envelope_delay, pulse_spectrum, pulse_support
from sonarsynth.sources.shrimp import LogarithmicBubble
from sonarsynth.sources.snap_pulses import waveform
from sonarsynth.state import Receiver, Survey

C = 1540.0
SNAP = waveform(LogarithmicBubble())
POSE = Pose(np.array([0.0, 0.0, -5.0]), quaternion(np.pi / 2))


def pull(low: float, high: float, transition: float, noise: float, random: np.random.Generator) -> float:
    """Error of the time over the predicted one, of a snap at random in noise of so much of its peak."""
    chosen = BandPass(low=low, high=high, transition=transition)
    array = PlanarLattice(columns=6, rows=5, pitch=1.5 * C / high, face=0.0)
    sonar = Sonar(array=array, band=Band(low=low, high=high), filter=chosen, assumed_sound_speed=C, sound_speed_error=0)
    heard, rate = elements(array), sonar.sampling_frequency
    distance = heard.aperture * random.uniform(4.0, 20.0)
    source = distance * direction(random.uniform(-0.8, 0.8), random.uniform(-0.6, -0.1))
    way = np.linalg.norm(source - heard.position, axis=1)[:, None]
    before, after = pulse_support(SNAP, chosen)
    margin = 2.0 * max(before + after, 4.0 / (high - low)) + 2.0 * heard.aperture / C + 1e-3
    samples, start = 2 * int(margin * rate), round((distance / C - margin) * rate) / rate
    f, spectrum = pulse_spectrum(SNAP, chosen, rate, samples)
    pressure = np.fft.irfft(spectrum * np.exp(-2j * np.pi * f * (way / C - start)) / way, samples, axis=1) * rate
    pressure += noise * np.abs(pressure).max() * random.standard_normal(pressure.shape)
    signals = Signals(pressure.astype(np.float32), start, rate, 0.0, 0, 0)
    water = Profile(np.array([0.0]), np.array([C]))
    found = SensorDelays(on_bottom=False).locate(signals, Receiver(POSE, heard, sonar), Survey(100.0, water), 1)
    return float((found.time[0] - distance / C - envelope_delay(SNAP, sonar)) / found.time_error[0])


@pytest.mark.parametrize("noise", [0.0, 1e-2])
def test_times_err_by_what_is_predicted_in_any_band(noise: float) -> None:
    """From an octave to four, from 2 kHz on; without noise it is the ends of the window that move the time."""
    random, off = np.random.default_rng(1), []
    for _ in range(16):
        low = float(np.exp(random.uniform(np.log(2e3), np.log(3e4))))
        high = float(min(low * np.exp(random.uniform(np.log(2.0), np.log(16.0))), 9e4))
        off.append(pull(low, high, min(0.5 * low, 5e3) * random.uniform(0.2, 1.0), noise, random))
    known = np.array(off)[np.isfinite(off)]
    assert len(known) >= 14
    assert np.abs(known).max() < 4.0 and np.sqrt(np.mean(known**2)) < 1.5, known
