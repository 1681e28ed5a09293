"""The pressure of reverberation at each hydrophone: a short impulse a scatterer and sensor, then the pulse for all.

What scatters repeats the pulse of its emission: impulses behind a gentle filter are added, each exactly delayed on its
sphere with what water and the faces of the sensors leave of each frequency, and their spectrum at each sensor is
multiplied by that of the pulse behind the sonar's filter. So pulses may be of any length.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import Floats
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.products.pulse_arrivals import PulseArrivals
from sonarsynth.receiver import Elements, Sonar, stop_frequency
from sonarsynth.signals.filtered_pulse import pulse_spectrum, pulse_support, snap_gains
from sonarsynth.signals.pulse_sums.adding_pulses import add_arrivals, sensor_blocks
from sonarsynth.signals.pulse_sums.gentle_filter import grid_factor, node_frequencies
from sonarsynth.signals.pulse_sums.pulse_modes import FRACTIONS, PulseModes, shapes_of, tabulated
from sonarsynth.signals.segments import fast_length
from sonarsynth.state import Emission

FACES_TURN = 0.4
"""rad: as `adding_pulses.TURN`; each path errs by 3 % rms, at random."""
FEWER = 12
"""Frequencies that modes are made at."""
ATTENUATION = 40.0
"""dB: of the gentle filter."""
GUARD = 0.2e-3
"""s: either side of a window, beside aperture and pulse: an impulse behind the gentle filter is over."""


def _passing(sonar: Sonar) -> Fir:
    """Passes all that the sonar does, and stops what would fold into that."""
    stop = stop_frequency(sonar.antialias)
    width = sonar.sampling_frequency * grid_factor(sonar) - 2.0 * stop
    return Fir(0.0, stop + 0.5 * width, width, ATTENUATION)


@lru_cache(maxsize=16)
def impulse_modes(sonar: Sonar, face: float, speed: float, absorption: tuple[float, ...]) -> PulseModes:
    """The modes of an impulse of 1 Pa s; absorption: dB/m at as many frequencies."""
    rate = sonar.sampling_frequency * grid_factor(sonar)
    passing, fine, nodes = _passing(sonar), rate * FRACTIONS, node_frequencies(sonar, FEWER)
    basis = shapes_of(nodes, sonar.band.centre, face, speed, np.array(absorption))
    samples = int(next_fast_len(int(4.0 * (filters.duration(passing) + GUARD) * fine), real=True))
    frequency = np.arange(int((passing.high + 0.5 * passing.transition) * samples / fine) + 1) * (fine / samples)
    bare = filters.response(frequency, passing) / rate
    return tabulated(bare.astype(complex), samples, fine, nodes, basis, turned=False)


def spare_times(
    elements: Elements, sonar: Sonar, sound_speed: float, snaps: tuple[Emission, ...]
) -> tuple[float, float]:
    """Times (s) before and after a window in which a path may reach the centre of the array and still be heard."""
    supports = [pulse_support(snap.waveform, sonar.antialias) for snap in snaps]
    before, after = (max((s[end] for s in supports), default=0.0) for end in (0, 1))
    spare = elements.aperture / sound_speed + GUARD
    return spare + after, spare + before


def reverberation_pressure(
    arrivals: PulseArrivals,
    emission: npt.NDArray[np.int64],
    snaps: tuple[Emission, ...],
    elements: Elements,
    sonar: Sonar,
    absorption: Callable[[Floats], Floats],
    start: float,
    samples: int,
) -> npt.NDArray[np.float32]:
    """Pressure (sensor, sample) in Pa from `start` (s) on, of arrivals of these emissions (path,), numbers of `snaps`.

    absorption: dB/m at frequencies (Hz). Each path errs by about 3 %.
    """
    rate, times, gains = sonar.sampling_frequency, grid_factor(sonar), snap_gains(snaps)
    before, after = spare_times(elements, sonar, arrivals.sound_speed, snaps)
    early = int(np.ceil(before * rate))
    count = fast_length(samples + early + int(np.ceil(after * rate)))
    order, _ = sensor_blocks(elements)
    lost = tuple(absorption(node_frequencies(sonar, FEWER)).tolist())
    modes = impulse_modes(sonar, elements.face, arrivals.sound_speed, lost)
    total = np.zeros((elements.count, count // 2 + 1), np.complex64)
    for number in np.unique(emission):
        length = times * count
        flat = np.zeros(elements.count * (length + 1), np.float32)
        group, louder = arrivals.select(emission == number), float(gains[number])
        origin = start - early / rate
        add_arrivals(
            flat, length, group, modes, louder=louder, elements=elements, rate=rate * times,
            absorption=np.array(lost), origin=origin, turn=FACES_TURN,
        )  # fmt: skip
        spectrum = rfft(flat.reshape(elements.count, -1)[:, :length], axis=1)[:, : count // 2 + 1]
        _, pulse = pulse_spectrum(snaps[number].waveform, sonar.antialias, rate, count)
        total += spectrum * (pulse * rate / _response(sonar, count)).astype(np.complex64)
    pressure = np.empty((elements.count, samples), np.float32)
    pressure[order] = irfft(total, count, axis=1)[:, early : early + samples]
    return pressure * elements.gain[:, None].astype(np.float32)


@lru_cache(maxsize=16)
def _response(sonar: Sonar, samples: int) -> Floats:
    """Of the gentle filter (bin,), where the sonar hears anything; 1 elsewhere."""
    frequency = np.arange(samples // 2 + 1) * (sonar.sampling_frequency / samples)
    response = filters.response(frequency, _passing(sonar))
    return np.where(response > 0.4, response, 1.0)
