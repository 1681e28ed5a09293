"""The pressure of reverberation at each hydrophone: a short impulse a scatterer and sensor, then the pulse for all.

What scatters repeats the pulse of its emission: impulses as short as the grid of samples allows are added, each exactly
delayed on its sphere with what water and the faces of the sensors leave of each frequency, and their spectrum at each
sensor is multiplied by that of the pulse behind the sonar's filter, over that of the impulse. So pulses may be of any
length. Impulses are tabulated by the angle to each side of the faces, and by the length of the path.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import Floats, Ints
from sonarsynth.equations.noise.filters import kaiser_bessel_beta, kaiser_bessel_transform
from sonarsynth.products.pulse_arrivals import ReverberationArrivals
from sonarsynth.receiver import Elements, Sonar, stop_frequency
from sonarsynth.signals.array_paths import NEPER
from sonarsynth.signals.filtered_pulse import pulse_spectrum, pulse_support, snap_gains
from sonarsynth.signals.pulse_sums.adding_pulses import CAVITY
from sonarsynth.signals.pulse_sums.gentle_filter import grid_factor
from sonarsynth.signals.segments import fast_length
from sonarsynth.state import Emission

WIDTH, FRACTIONS = 6, 8
"""Samples of an impulse; parts of a sample between which it is linear."""
FACES_TURN, ANGLES, PATH_ERROR = 0.08, 64, 0.03
"""rad: what the phase at the edge of a face may turn by from an angle to the nearest that is tabulated; most angles;
and what each path errs by then."""
ABSORPTION, LENGTHS = 0.01, 64
"""What absorption may change of an amplitude, at the edges of the band, from a length to the nearest that is tabulated;
and how many lengths are, at most."""
GUARD = 0.2e-3
"""s: either side of a window, beside aperture and pulse: an impulse is over."""
TOGETHER, ODD = 32, 1
"""Sensors at once: they stay in the cache; samples by which rows are longer, so that they share no cache lines."""


def spare_times(
    elements: Elements, sonar: Sonar, sound_speed: float, snaps: tuple[Emission, ...]
) -> tuple[float, float]:
    """Times (s) before and after a window in which a path may reach the centre of the array and still be heard."""
    supports = [pulse_support(snap.waveform, sonar.antialias) for snap in snaps]
    before, after = (max((s[end] for s in supports), default=0.0) for end in (0, 1))
    spare = elements.aperture / sound_speed + GUARD
    return spare + after, spare + before


def path_error(elements: Elements, sonar: Sonar, sound_speed: float) -> float:
    """What a path errs by, relative, root mean square: more by faces of over 3 wavelengths."""
    wide = stop_frequency(sonar.antialias) * elements.face / sound_speed
    return PATH_ERROR * max(0.5 * np.pi * wide / _angles(wide) / FACES_TURN, 1.0)


def _angles(wide: float) -> int:
    """How many are tabulated to each side of a face of so many wavelengths."""
    return int(np.clip(np.ceil(0.5 * np.pi * wide / FACES_TURN), 1, ANGLES))


@lru_cache(maxsize=LENGTHS)
def _impulses(
    rate: float, highest: float, face: float, angles: int, loss: tuple[float, ...], length: float
) -> npt.NDArray[np.float32]:
    """Impulses of 1 at the frequencies of a grid, (pair, fraction, tap): pairs i >= j of the middles of `angles` equal
    parts of |u_y| and |u_z|; face (s): the side of a sensor over the speed of sound; loss (dB/m) at frequencies from 0
    to `highest` (Hz) in equal steps, of a path of `length` (m)."""
    taps = _taps(face * rate)
    samples = int(next_fast_len(4 * taps * FRACTIONS, real=True))
    f = np.arange(samples // 2 + 1) * (rate * FRACTIONS / samples)
    spectrum = kaiser_bessel_transform(f / rate, WIDTH, _beta(rate, highest))
    spectrum *= 10.0 ** (-length / 20.0 * np.interp(f, np.linspace(0.0, highest, len(loss)), loss))
    side = np.sinc(f * face * (np.arange(angles)[:, None] + 0.5) / angles)
    i, j = np.tril_indices(angles)
    wave = irfft(spectrum * side[i] * side[j], samples, axis=1) * FRACTIONS
    at = (FRACTIONS * (np.arange(taps) - taps // 2) + np.arange(FRACTIONS + 1)[:, None]) % samples
    return np.ascontiguousarray(wave[:, at], np.float32)


def _beta(rate: float, highest: float) -> float:
    return kaiser_bessel_beta(WIDTH, 0.5 * rate / highest)


def _taps(face: float) -> int:
    """Of an impulse behind a square face of so many samples: multiples of eight, for the compiled loop."""
    return 8 * int(np.ceil((WIDTH + np.sqrt(2.0) * face + 1.0) / 8.0))


def reverberation_pressure(
    arrivals: ReverberationArrivals,
    snaps: tuple[Emission, ...],
    elements: Elements,
    sonar: Sonar,
    absorption: Callable[[Floats], Floats],
    start: float,
    samples: int,
) -> npt.NDArray[np.float32]:
    """Pressure (sensor, sample) in Pa from `start` (s) on, of arrivals of `snaps`.

    absorption: dB/m at frequencies (Hz). Each path errs by `path_error`, at random.
    """
    rate, times, gains = sonar.sampling_frequency, grid_factor(sonar), snap_gains(snaps)
    before, after = spare_times(elements, sonar, arrivals.sound_speed, snaps)
    early = int(np.ceil(before * rate))
    count = fast_length(samples + early + int(np.ceil(after * rate)))
    highest = stop_frequency(sonar.antialias)
    heard = slice(0, int(highest / rate * count) + 1)
    impulse = kaiser_bessel_transform(np.arange(heard.stop) / (times * count), WIDTH, _beta(times * rate, highest))
    heard_paths = []
    for number in np.unique(arrivals.emission):
        own = arrivals.select(np.flatnonzero(arrivals.emission == number))
        _, pulse = pulse_spectrum(snaps[number].waveform, sonar.antialias, rate, count)
        response = (pulse[heard] * (times * rate * gains[number]) / impulse).astype(np.complex64)
        heard_paths.append((response, _rows(own, elements, sonar, absorption, start - early / rate)))
    out = np.zeros((elements.count, samples), np.float32)  # parts of dead sensors are not among `parts`
    grid, spectrum = (
        np.empty((TOGETHER, times * count + ODD), np.float32),
        np.empty((TOGETHER, count // 2 + 1), np.complex64),
    )
    for number, sensors in _blocks(arrivals.parts):
        part, total = grid[: len(sensors)], spectrum[: len(sensors)]
        total[:] = 0.0
        for response, rows in heard_paths:
            part[:] = 0.0
            _add(part, rows, number, elements.position[sensors], times * rate / arrivals.sound_speed)
            own = rfft(part[:, : times * count], axis=1)[:, heard]
            own *= response
            total[:, heard] += own
        gain = elements.gain[sensors, None].astype(np.float32)
        out[sensors] = irfft(total, count, axis=1)[:, early : early + samples] * gain
    return out


def _blocks(parts: tuple[Ints, ...]) -> Iterator[tuple[int, Ints]]:
    """A few sensors of a part of the array at a time, and the number of the part."""
    for number, sensors in enumerate(parts):
        for first in range(0, len(sensors), TOGETHER):
            yield number, sensors[first : first + TOGETHER]


class _Rows(NamedTuple):
    """Paths that share a table of impulses."""

    table: npt.NDArray[np.float32]
    angles: int
    source: npt.NDArray[np.float32]  # (row, xyz) m
    length: npt.NDArray[np.float32]  # (row,) m
    gain: npt.NDArray[np.float32]  # (row,)
    start: Floats  # (row,) samples of the grid
    heard: npt.NDArray[np.float32]  # (part, row) 1, or 0 where a body hides it from a part of the array


def _rows(
    arrivals: ReverberationArrivals,
    elements: Elements,
    sonar: Sonar,
    absorption: Callable[[Floats], Floats],
    origin: float,
) -> list[_Rows]:
    """Paths of one emission by their lengths; origin (s): of the grid."""
    highest, rate = stop_frequency(sonar.antialias), sonar.sampling_frequency * grid_factor(sonar)
    face = elements.face / arrivals.sound_speed
    angles = _angles(highest * face)
    loss = absorption(np.linspace(0.0, highest, 33)[1:])
    inside = loss[max(int(32.0 * sonar.band.low / highest) - 1, 0) :]
    total = arrivals.length + arrivals.before
    step = max(2.0 * ABSORPTION / (0.5 * NEPER * max(np.ptp(inside), 1e-12)), float(np.ptp(total)) / LENGTHS)
    number = np.floor(total / step).astype(np.int64)
    rows = []
    for n in np.unique(number):
        own = arrivals.select(np.flatnonzero(number == n))
        own = own.select(np.argsort(own.delay, kind="stable"))  # neighbours in time are neighbours in memory
        table = _impulses(rate, highest, face, angles, (loss[0], *loss.tolist()), (n + 0.5) * step)
        source, length, gain = (
            x.astype(np.float32) for x in (own.direction * own.length[:, None], own.length, own.gain)
        )
        heard = np.ascontiguousarray(~own.hidden.T, np.float32)
        rows.append(_Rows(table, angles, source, length, gain, (own.delay - origin) * rate, heard))
    return rows


def _add(grid: npt.NDArray[np.float32], rows: list[_Rows], part: int, position: Floats, scale: float) -> None:
    """Add paths to grid (sensor, sample) of sensors of a part of the array at these positions (sensor, xyz) m; scale in
    samples/m."""
    from sonarsynth.signals.pulse_sums.impulse_kernels import add_impulses

    place = np.ascontiguousarray(position.T, np.float32)
    for own in rows:
        add_impulses(
            own.table.ravel(), own.angles, FRACTIONS, own.table.shape[2], own.source, own.length,
            own.gain * own.heard[part], own.start,
            place, np.float32(scale), np.float32(CAVITY), grid.shape[1] - ODD, grid.shape[1], grid.ravel(),
        )  # fmt: skip
