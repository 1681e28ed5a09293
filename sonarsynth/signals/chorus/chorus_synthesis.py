"""The pressure of a chorus at each hydrophone: a short pulse a snap and sensor, then one filter for all.

The pulse of a path is what its snap is behind a gentle filter, which rings for a tenth of the time of the sonar's own,
with what the water, the roughness and the faces of the sensors leave of each frequency. These are smooth functions of
frequency: a few modes make all of them. Each path adds its pulse at every sensor, exactly delayed on its sphere; the
rest of the sonar's filter follows on each sensor once. So a path costs what its pulse costs, whatever the others do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats, Ints
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.equations.bubble import pulses
from sonarsynth.equations.bubble.pulses import reach
from sonarsynth.equations.noise import filters
from sonarsynth.equations.noise.filters import Fir
from sonarsynth.randomness import stream
from sonarsynth.receiver import Elements, Filter, Sonar, stop_frequency
from sonarsynth.signals.array_paths import NEPER
from sonarsynth.signals.chorus.chorus_arrivals import CAVITY, ChorusArrivals
from sonarsynth.signals.filtered_pulse import fir
from sonarsynth.signals.gridded.nodes import analysis, chebyshev
from sonarsynth.signals.segments import fast_length
from sonarsynth.sources.pulse_model import PulseModel

TOLERANCE = 2e-3
"""Of the peak of a snap: where its pulse is cut, and what modes leave out."""
FRACTIONS = 32
"""Parts of a sample between which pulses are linear."""
NODES = 32
"""Frequencies that modes are made at."""
SAMPLED = 800
"""Directions and lengths of paths that modes are made of."""
GENTLE = 66.0
"""dB: attenuation of the gentle filter."""
TURN = 0.1
"""rad: what the phase at the edge of a face may turn by, from the middle of a block of sensors to its edge."""
SHORT, LONGEST = 0.3e-3, 1e-3
"""s: of a snap behind the gentle filter; and of one that keeps its low frequencies."""
FARTHEST = 3e3
"""m: of the paths that modes are made of."""


@dataclass(frozen=True, eq=False)
class PulseModes:
    """The pulses of one waveform."""

    table: npt.NDArray[np.float32]  # (mode, fraction * tap): modes, then their Hilbert transforms
    before: int  # samples: the first tap is so many before time 0
    shapes: Floats  # (mode, node) of which the spectra of paths are sums
    frequency: Floats  # (node,) Hz


def _rate(sonar: Sonar) -> int:
    """Samples of the grid that pulses are added on, for one of the sonar: room for a gentle filter over its band."""
    return 1 if 2.0 * stop_frequency(sonar.antialias) < 0.92 * sonar.sampling_frequency else 2


def _gentle(chosen: Filter, rate: float) -> Fir:
    """A filter that passes what the sonar's does, and stops what would fold into that on a grid of that rate (Hz)."""
    own = fir(chosen)
    low, stop = max(own.low - own.transition, 0.0), stop_frequency(chosen)
    width = min(rate - 2.0 * stop, *([2.0 * low] if low else []))
    return Fir(max(low - 0.5 * width, 0.0), stop + 0.5 * width, width, GENTLE)


def shape_of(
    frequency: Floats,
    direction: Floats,
    length: Floats,
    delay_std: Floats,
    absorption: Floats,
    face: float,
    speed: float,
) -> Floats:
    """What is left (path, bin) of each frequency: absorption (bin,) in dB/m, roughness, and the face of a sensor."""
    left = np.exp(-NEPER * np.multiply.outer(length, absorption))
    if delay_std.any():
        left *= np.exp(-0.5 * (2.0 * np.pi * np.multiply.outer(delay_std, frequency)) ** 2)
    if face > 0.0:
        left *= element_directivity(frequency, direction[:, None, :], face, speed)
    return np.asarray(left, float)


def node_frequencies(sonar: Sonar) -> Floats:
    """Frequencies (node,) in Hz that modes are made at: Chebyshev nodes over all that the gentle filter passes."""
    gentle = _gentle(sonar.antialias, sonar.sampling_frequency * _rate(sonar))
    low = max(gentle.low - 0.5 * gentle.transition, 0.0)
    high = gentle.high + 0.5 * gentle.transition
    return 0.5 * (low + high) + 0.5 * (high - low) * chebyshev(NODES)


def _at_frequencies(frequency: Floats, nodes: Floats, values: Floats) -> Floats:
    """Values (mode, node) between their nodes, at frequencies (bin,); at those of the ends beyond."""
    middle, half = 0.5 * (nodes[0] + nodes[-1]), 0.5 * (nodes[0] - nodes[-1]) / chebyshev(len(nodes))[0]
    x = np.clip((frequency - middle) / half, -1.0, 1.0)
    return np.asarray(values @ analysis(len(nodes)).T @ np.polynomial.chebyshev.chebvander(x, len(nodes) - 1).T)


def _shapes(nodes: Floats, band: float, face: float, speed: float, absorption: Floats) -> tuple[Floats, Floats]:
    """Orthonormal shapes (mode, node) that paths of any length and direction are sums of, and their largest weights."""
    random = stream(0, "chorus shapes")
    towards = random.standard_normal((SAMPLED, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    length = FARTHEST ** random.random(SAMPLED)
    delay_std = np.maximum(random.random(SAMPLED) - 0.5, 0.0) / (np.pi * band)
    some = shape_of(nodes, towards, length, delay_std, absorption, face, speed)
    _, size, shapes = np.linalg.svd(some, full_matrices=False)
    left = np.sqrt(np.cumsum((size**2)[::-1])[::-1] / np.sum(size**2))
    shapes = shapes[: int(np.sum(left > TOLERANCE))]
    return shapes, np.abs(some @ shapes.T).max(axis=0)


@lru_cache(maxsize=32)
def pulse_modes(
    model: PulseModel, width: float, sonar: Sonar, face: float, speed: float, absorption: tuple[float, ...]
) -> PulseModes:
    """The modes of a snap that lasts `width` times as long; absorption: dB/m at `node_frequencies`."""
    rate = sonar.sampling_frequency * _rate(sonar)
    gentle, fine, nodes = _gentle(sonar.antialias, rate), rate * FRACTIONS, node_frequencies(sonar)
    shapes, weight = _shapes(nodes, sonar.band.centre, face, speed, np.array(absorption))
    pulse = model.pulse(0.0, 1.2 * width * reach(gentle))
    lasts = width * (pulse.end - pulse.start) + filters.duration(gentle)
    samples = int(next_fast_len(int(2.0 * lasts * fine), real=True))
    frequency = np.arange(samples // 2 + 1) * (fine / samples)
    some = frequency <= nodes[0]
    bare = pulses.spectrum(frequency[some], pulses.scaled(pulse, 1.0, width)) * filters.response(
        frequency[some], gentle
    )
    spectrum = np.zeros((1 + 2 * len(shapes), frequency.size), complex)
    spectrum[0, some] = bare
    spectrum[1 : 1 + len(shapes), some] = bare * _at_frequencies(frequency[some], nodes, shapes)
    spectrum[1 + len(shapes) :] = 1j * spectrum[1 : 1 + len(shapes)]
    wave = np.roll(irfft(spectrum, samples, axis=1) * fine, samples // 2, axis=1)
    cut = TOLERANCE * np.abs(wave[0]).max()
    loud = np.flatnonzero((np.abs(wave[1:]) * np.tile(weight, 2)[:, None] > cut).any(axis=0)) - samples // 2
    before = int(np.ceil(-loud[0] / FRACTIONS)) + 1
    taps = 8 * int(np.ceil((before + loud[-1] / FRACTIONS + 2) / 8))
    at = samples // 2 + FRACTIONS * (np.arange(taps) - before) + np.arange(FRACTIONS + 1)[:, None]
    table = wave[1:, at].reshape(2, len(shapes), -1)
    if len(shapes) % 2:  # the compiled loop takes two at a time
        table, shapes = np.pad(table, ((0, 0), (0, 1), (0, 0))), np.pad(shapes, ((0, 1), (0, 0)))
    return PulseModes(table.reshape(-1, table.shape[2]).astype(np.float32), before, shapes, nodes)


@lru_cache(maxsize=16)
def sensor_blocks(elements: Elements) -> tuple[Ints, tuple[tuple[Ints, Floats, float], ...]]:
    """Sensors in an order, (sensor,), in which each half, quarter, ... is a block; and, of each level of blocks, where
    they begin (block + 1,), their middles (block, xyz) in m and the largest radius (m)."""
    order, bounds = np.arange(elements.count), [0, elements.count]
    levels = []
    while True:
        blocks = [elements.position[order[a:b]] for a, b in pairwise(bounds)]
        middle = np.array([block.mean(axis=0) for block in blocks])
        radius = max(float(np.linalg.norm(b - m, axis=1).max()) for b, m in zip(blocks, middle, strict=True))
        levels.append((np.array(bounds), middle, radius))
        if len(blocks) == elements.count:
            return order, tuple(levels)
        finer = [0]
        for a, b in pairwise(bounds):
            some = elements.position[order[a:b]]
            axis = int(np.argmax(np.ptp(some, axis=0)))
            order[a:b] = order[a:b][np.argsort(some[:, axis], kind="stable")]
            finer += [(a + b) // 2, b] if b - a > 1 else [b]
        bounds = finer


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
    rate, times, sound_speed = sonar.sampling_frequency, _rate(sonar), arrivals.sound_speed
    spare = spare_time(elements, sonar, sound_speed)
    early = int(np.ceil(spare * rate))
    length = times * fast_length(samples + 2 * early)
    flat = np.zeros(elements.count * (length + 1), np.float32)  # rows apart by an odd number: they share no cache lines
    out = flat.reshape(elements.count, -1)[:, :length]
    order, _ = sensor_blocks(elements)
    lost = tuple(absorption(node_frequencies(sonar)).tolist())
    for number, width in enumerate(widths.tolist()):
        some = arrivals.select(arrivals.width == number)
        if not len(some.delay):
            continue
        modes = pulse_modes(model, width, sonar, elements.face, sound_speed, lost)
        _check_length(modes, spare - elements.aperture / sound_speed, rate * times)
        _add(
            flat,
            length,
            some,
            modes,
            model=model,
            elements=elements,
            sonar=sonar,
            absorption=np.array(lost),
            speed=sound_speed,
            origin=start - early / rate,
        )
    spectrum = rfft(out, axis=1)[:, : length // times // 2 + 1]
    spectrum *= _rest(sonar, length // times) / np.float32(times)
    heard = irfft(spectrum, length // times, axis=1)[:, early : early + samples]
    pressure = np.empty((elements.count, samples), np.float32)
    pressure[order] = heard
    return pressure * elements.gain[:, None].astype(np.float32)


def _check_length(modes: PulseModes, longest: float, rate: float) -> None:
    """Refuses pulses of more than `longest` (s): those at the ends of the record would not be heard whole."""
    length = modes.table.shape[1] // (FRACTIONS + 1) / rate
    if length > longest:
        raise ValueError(f"a snap of the chorus lasts {1e3 * length:.3g} ms; {1e3 * longest:.3g} ms is the most")


def spare_time(elements: Elements, sonar: Sonar, sound_speed: float) -> float:
    """Time (s) before and after a window in which a path may reach the centre of the array and still be heard."""
    chosen = fir(sonar.antialias)
    pulse = SHORT if chosen.low > 0.0 else LONGEST
    return elements.aperture / sound_speed + 0.5 * filters.duration(chosen) + pulse


@lru_cache(maxsize=16)
def _rest(sonar: Sonar, length: int) -> npt.NDArray[np.float32]:
    """What is left (bin,) of the sonar's filter behind the gentle one, of a transform of so many of its samples."""
    frequency = np.arange(length // 2 + 1) * (sonar.sampling_frequency / length)
    gentle = filters.response(frequency, _gentle(sonar.antialias, sonar.sampling_frequency * _rate(sonar)))
    own = filters.response(frequency, fir(sonar.antialias))
    own[2.0 * frequency >= sonar.sampling_frequency] = 0.0
    return np.divide(own, gentle, out=np.zeros_like(own), where=gentle > 0.5).astype(np.float32)


def _add(
    flat: npt.NDArray[np.float32],
    length: int,
    some: ChorusArrivals,
    modes: PulseModes,
    *,
    model: PulseModel,
    elements: Elements,
    sonar: Sonar,
    absorption: Floats,
    speed: float,
    origin: float,
) -> None:
    """Add the pulses of one width to flat (sensor in the order of blocks, `length` and one more), from `origin` (s)."""
    from sonarsynth.signals.chorus.chorus_kernels import add_pulses

    rate = sonar.sampling_frequency * _rate(sonar)
    order, levels = sensor_blocks(elements)
    louder = REFERENCE_PRESSURE / model.pulse(0.0, 0.0).peak * 10.0 ** (some.level / 20.0)
    place = some.direction * some.length[:, None]
    turns = np.pi * node_frequencies(sonar)[0] * elements.face / speed
    level = np.zeros(len(some.delay), int)
    for number, (_, _, radius) in enumerate(levels[:-1]):
        level[turns * radius > TURN * some.length] = number + 1
    position = elements.position[order].T.ravel()
    for number, (bounds, middle, _) in enumerate(levels):
        rows = np.flatnonzero(level == number)
        if not rows.size:
            continue
        rows = rows[np.argsort(some.delay[rows], kind="stable")]  # neighbours in time are neighbours in memory
        row, block = np.repeat(rows, len(middle)), np.tile(np.arange(len(middle)), rows.size)
        towards = place[row] - middle[block]
        away = np.maximum(np.linalg.norm(towards, axis=1), CAVITY)
        shape = shape_of(
            modes.frequency, towards / away[:, None], away, some.delay_std[row], absorption, elements.face, speed
        )
        weight = (louder * some.gain)[row, None] * (shape @ modes.shapes.T)
        phase = some.phase[row, None]
        turned = bool(some.phase.any())
        weight = np.hstack([weight * np.cos(phase), weight * np.sin(phase)]) if turned else weight
        table = modes.table if turned else modes.table[: len(modes.shapes)]
        start = (some.delay[row] - origin) * rate - modes.before
        taps = table.shape[1] // (FRACTIONS + 1)
        add_pulses(
            table.ravel(), taps, FRACTIONS, weight.astype(np.float32), bounds[:-1][block], bounds[1:][block],
            place[row], some.length[row], start, position, float(rate), 1.0 / speed, CAVITY, length, length + 1, flat,
        )  # fmt: skip
