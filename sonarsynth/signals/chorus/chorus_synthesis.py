"""The pressure of a chorus at each hydrophone: a short pulse a snap and sensor, then one filter for all.

The pulse of a path is what its snap is behind a gentle filter, which rings for a tenth of the time of the sonar's own,
with what the water, the roughness and the faces of the sensors leave of each frequency. These are smooth functions of
frequency: a few modes make all of them. Each path adds its pulse at every sensor, exactly delayed on its sphere; the
rest of the sonar's filter follows on each sensor once. So a path costs what its pulse costs, whatever the others do.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.bubble.pulses import reach
from sonarsynth.equations.noise import filters
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.signals.chorus.chorus_arrivals import ChorusArrivals
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.pulse_sums.adding_pulses import add_arrivals, sensor_blocks
from sonarsynth.signals.pulse_sums.gentle_filter import gentle, grid_factor, node_frequencies
from sonarsynth.signals.pulse_sums.pulse_modes import FRACTIONS, PulseModes, shapes_of, tabulated
from sonarsynth.signals.segments import fast_length
from sonarsynth.sources.pulse_model import PulseModel

SHORT, LONGEST = 0.3e-3, 4e-3
"""s: of a snap behind the gentle filter; and of one that keeps frequencies under `SLOW` (1.1 to 2.1 ms were met)."""
SLOW = 25e3
"""Hz."""


@lru_cache(maxsize=32)
def pulse_modes(
    model: PulseModel, width: float, sonar: Sonar, face: float, speed: float, absorption: tuple[float, ...]
) -> PulseModes:
    """The modes of a snap that lasts `width` times as long; absorption: dB/m at `node_frequencies`."""
    rate = sonar.sampling_frequency * grid_factor(sonar)
    passing, fine, nodes = gentle(sonar.antialias, rate), rate * FRACTIONS, node_frequencies(sonar)
    shapes, weight = shapes_of(nodes, sonar.band.centre, face, speed, np.array(absorption))
    pulse = model.pulse(0.0, 1.2 * width * reach(passing))
    lasts = width * (pulse.end - pulse.start) + filters.duration(passing)
    samples = int(next_fast_len(int(2.0 * lasts * fine), real=True))
    frequency = np.arange(samples // 2 + 1) * (fine / samples)
    low = frequency <= nodes[0]
    bare = pulses.spectrum(frequency[low], pulses.scaled(pulse, 1.0, width)) * filters.response(frequency[low], passing)
    return tabulated(bare, samples, fine, nodes, (shapes, weight))


def chorus_pressure(
    arrivals: ChorusArrivals,
    model: PulseModel,
    widths: Floats,
    elements: Elements,
    sonar: Sonar,
    absorption: Callable[[Floats], Floats],
    start: float,
    samples: int,
) -> npt.NDArray[np.float32]:
    """Pressure (sensor, sample) in Pa from `start` (s) on.

    model: of a snap, at its depth; widths (width,) of snaps over the model's. absorption: dB/m at frequencies (Hz).
    Errs by about 1 % of the peak of each snap: by what modes leave out, and as the face of a sensor in a block sees the
    snap where the middle of the block does.
    """
    rate, times, sound_speed = sonar.sampling_frequency, grid_factor(sonar), arrivals.sound_speed
    spare = spare_time(elements, sonar, sound_speed)
    early = int(np.ceil(spare * rate))
    length = times * fast_length(samples + 2 * early)
    flat = np.zeros(elements.count * (length + 1), np.float32)  # rows apart by an odd number: they share no cache lines
    out = flat.reshape(elements.count, -1)[:, :length]
    order, _ = sensor_blocks(elements)
    lost = tuple(absorption(node_frequencies(sonar)).tolist())
    for number, width in enumerate(widths.tolist()):
        group = arrivals.select(arrivals.width == number)
        if not len(group.delay):
            continue
        modes = pulse_modes(model, width, sonar, elements.face, sound_speed, lost)
        louder = REFERENCE_PRESSURE / model.pulse(0.0, 0.0).peak * 10.0 ** (group.level / 20.0)
        add_arrivals(
            flat,
            length,
            group,
            modes,
            louder=louder,
            elements=elements,
            rate=rate * times,
            absorption=np.array(lost),
            origin=start - early / rate,
        )
    spectrum = rfft(out, axis=1)[:, : length // times // 2 + 1]
    spectrum *= _rest(sonar, length // times) / np.float32(times)
    sound = irfft(spectrum, length // times, axis=1)[:, early : early + samples]
    pressure = np.empty((elements.count, samples), np.float32)
    pressure[order] = sound
    return pressure * elements.gain[:, None].astype(np.float32)


def check_length(
    model: PulseModel,
    width: float,
    elements: Elements,
    sonar: Sonar,
    speed: float,
    absorption: Callable[[Floats], Floats],
) -> None:
    """Raises ValueError for a snap, `width` times as long as its model, that is too long for `spare_time`: at the ends
    of the record it would not be heard whole. speed (m/s) and absorption: as of `chorus_pressure`."""
    lost = tuple(absorption(node_frequencies(sonar)).tolist())
    modes, longest = pulse_modes(model, width, sonar, elements.face, speed, lost), spare_time(elements, sonar, speed)
    longest -= elements.aperture / speed
    length = modes.table.shape[1] // (FRACTIONS + 1) / (sonar.sampling_frequency * grid_factor(sonar))
    if length > longest:
        raise ValueError(f"lasts {1e3 * length:.3g} ms behind the filter; {1e3 * longest:.3g} ms is the most")


def spare_time(elements: Elements, sonar: Sonar, sound_speed: float) -> float:
    """Time (s) before and after a window in which a path may reach the centre of the array and still be heard."""
    chosen = fir(sonar.antialias)
    pulse = SHORT if chosen.low >= SLOW else LONGEST
    return elements.aperture / sound_speed + 0.5 * filters.duration(chosen) + pulse


@lru_cache(maxsize=16)
def _rest(sonar: Sonar, length: int) -> npt.NDArray[np.float32]:
    """What is left (bin,) of the sonar's filter behind the gentle one, of a transform of so many of its samples."""
    frequency = np.arange(length // 2 + 1) * (sonar.sampling_frequency / length)
    passed = filters.response(frequency, gentle(sonar.antialias, sonar.sampling_frequency * grid_factor(sonar)))
    own = filters.response(frequency, fir(sonar.antialias))
    own[2.0 * frequency >= sonar.sampling_frequency] = 0.0
    return np.divide(own, passed, out=np.zeros_like(own), where=passed > 0.5).astype(np.float32)
