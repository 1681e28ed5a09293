"""One stretch of signals by kernel deposit: paths onto a fine grid, spectra, hydrophones, samples."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.equations.kernels.fourier_sums import waves
from sonarsynth.equations.noise import filters
from sonarsynth.receiver import Elements
from sonarsynth.signals.array_paths import NEPER, Wavefronts, delay_and_gain, tilt
from sonarsynth.signals.gridded.bins import Bins, highest_heard
from sonarsynth.signals.gridded.interpolation import Axes, to_sensors
from sonarsynth.signals.gridded.low_rank import face_pairs, spectral_quantiles, term_products
from sonarsynth.signals.gridded.spectral_factors import (
    Kernel,
    Stage,
    Steering,
    absorbed,
    faces,
    kernel,
    power,
    responses,
)
from sonarsynth.signals.gridded.tiles import Tile, TileSettings, tiles
from sonarsynth.signals.pulse_variation import PulseVariation, changed, shares
from sonarsynth.signals.segments import GUARD, Segment

LARGEST = 1 << 20
"""Most numbers in a deposit grid or a field: nodes, or paths by themselves, are taken in groups of so many."""
HELD = 1 << 17
"""Most numbers of a field that waves are made of before they are asked for."""


class Wave(NamedTuple):
    """What sounds at the nodes of a tile."""

    pressure: npt.NDArray[Any]  # (reference, node, sample) at twice the sampling rate
    begin: Ints  # (reference,) its first sample of the window
    late: Floats  # (reference, sensor) samples at twice the sampling rate
    gain: Floats  # (reference, sensor)
    axes: Axes | None
    stage: Stage


Waves = Callable[[], Iterable[Wave]]


def prepared(
    segment: Segment,
    front: Wavefronts,
    elements: Elements,
    bins: Bins,
    *,
    origin: float,
    stop: float,
    method: tuple[int, float, str, float],
) -> Waves:
    """What gives the waves of paths in a stretch, which begins at `origin` (s); few are made at once.

    stop (Hz) is the stop edge of the filter; method is width, oversampling, precision and tolerance of
    `GriddedSynthesis`.
    """
    samples, (width, oversampling, dtype, tolerance) = segment.samples, method
    highest = highest_heard(bins, stop, tolerance, oversampling)
    bins, grid = _on_grid(bins, highest, width, oversampling, dtype)
    weights = spectral_quantiles(bins.frequency, bins.spectrum, highest)
    aim = TileSettings(
        elements=elements,
        highest=highest,
        weights=weights if highest == stop else (*weights[:-1], 1.0),  # what leaks is little, but at all frequencies
        steepest=float(np.abs(bins.relative[bins.frequency <= highest]).max(initial=0.0)),
        fading=float(np.abs(bins.relative) @ np.abs(bins.spectrum) / np.abs(bins.spectrum).sum()),
        tolerance=tolerance,
        changes=bins.changes,
        bins=bins.frequency.size,
        circle=grid.circle,
        lasting=(segment.before + segment.after) * samples * bins.step,
    )
    wave = kernel(-8 * (-width // 8), samples * bins.step / highest, 2 * samples, dtype)  # as wide as its lanes
    tails = highest > stop or tolerance <= 10.0 * filters.SUPPORT_TOLERANCE
    stage = Stage(aim, bins, origin, segment, grid, oversampling, wave, dtype, tails)
    front = Wavefronts(**{name: getattr(front, name) for name in Wavefronts.__dataclass_fields__})  # no more is needed
    front = _in_parts(front.without_faint_shadows(0.1 * tolerance, elements), elements.count)
    chosen = tiles(front, aim) if front.count else []
    later = partial(_waves, front, chosen, stage)
    if sum(len(tile.nodes(elements)) * tile.reference.count for tile in chosen) * samples > HELD:
        return later
    made = tuple(later())
    return lambda: made


def add(out: npt.NDArray[Any], sample: int, some: Waves) -> None:
    """Add waves to the pressure in out (sensor, sample), whose sample 0 is sample `sample` of the window."""
    from sonarsynth.signals.gridded.deposit_kernels import hear

    for wave, begin, late, gain, axes, stage in some():
        length, first = wave.shape[2] // 2, begin - sample
        onto, column, weight = to_sensors(stage.aim.elements, axes, stage.dtype)
        for n, whole in enumerate(wave):
            halves = whole.reshape(-1, length, 2).swapaxes(1, 2).reshape(-1, weight.shape[1] * 2 * length)
            field = (halves if onto is None else onto @ halves).reshape(-1, weight.shape[1], 2, length)
            hear(field, column, weight, late[n], gain[n], stage.wave.taps, stage.wave.lanes, int(first[n]), out)


def _waves(front: Wavefronts, chosen: list[Tile], stage: Stage) -> Iterator[Wave]:
    """The waves of all tiles, one by one."""
    shorter = cache(partial(_shorter, stage))
    for tile in chosen:
        if not tile.alone:
            yield _wave(tile, front.select(_neighbours_apart(tile.paths)), stage, shorter)
            continue
        most = max(1, LARGEST // (len(tile.nodes(stage.aim.elements)) * stage.segment.samples))
        for first in range(0, tile.paths.size, most):
            some = tile.reference.select(slice(first, first + most))
            yield _wave(replace(tile, paths=tile.paths[first : first + most], reference=some), some, stage, shorter)


def _neighbours_apart(paths: Ints) -> Ints:
    """The paths in an order that puts neighbours, which arrive at nearly one time, apart: a sum that was just written
    cannot be read at once, and deposits take a third more."""
    places = np.arange(-(-paths.size // 8) * 8).reshape(8, -1).T.ravel()
    return paths[places[places < paths.size]]


def _in_parts(front: Wavefronts, sensors: int) -> Wavefronts:
    """Paths of which none misses less than half of the hydrophones: those that do reach all, and after all paths there
    is one for each that takes away what the few hear of it."""
    some = np.flatnonzero(front.occluded.any(axis=1))
    most = some[2 * np.bitwise_count(front.occluded[some]).sum(axis=1) < sensors]
    if not most.size:
        return front
    occluded = front.occluded.copy()
    occluded[most] = 0
    parts = front.but(occluded=occluded).select(np.append(np.arange(front.count), most))
    parts.occluded[front.count :] = ~front.occluded[most] & np.packbits(np.arange(1 + sensors) > 0)
    parts.amplitude[front.count :] *= -1.0
    return parts


def _on_grid(bins: Bins, highest: float, width: int, oversampling: float, dtype: str) -> tuple[Bins, Kernel]:
    """Bins, and the kernel on the grid that paths are deposited on for them; without those that the grid lacks."""
    circle = 2 * int(next_fast_len(int(np.ceil(highest * oversampling / bins.step)) + width, real=True))
    grid = kernel(width, circle * bins.step / (2.0 * highest), circle, dtype)
    return bins.cut(min(bins.frequency.size, circle // 2 - bins.first)), grid


def _wave(tile: Tile, paths: Wavefronts, stage: Stage, shorter: Callable[[int], Stage]) -> Wave:
    """What sounds at the nodes of a tile; shorter: `_shorter` of the stage."""
    reference, points = tile.reference, tile.nodes(stage.aim.elements)
    begin, length = _lasting(tile, paths, stage)
    stage = shorter(2 * int(next_fast_len(-(-length // 2), real=True)))
    since = begin / (stage.segment.samples * stage.bins.step)
    field = (_alone if tile.alone else _deposit)(tile, paths, points, since, stage)
    if reference.expansion.phase.any() or reference.expansion.delay_variance.any():
        some = field[:, :, stage.bins.first : stage.bins.first + stage.bins.frequency.size]
        some *= changed(reference, points, stage.bins.frequency)
    wave = irfft(field, 2 * stage.segment.samples, axis=2, overwrite_x=True)[:, :, : 2 * length]
    elements, rate = stage.aim.elements, stage.segment.samples * stage.bins.step
    delay, gain = delay_and_gain(reference, elements.position)
    gain *= elements.gain
    if tile.alone:
        gain *= paths.amplitude[:, None]
        if paths.occluded.any():
            gain *= ~paths.hidden(elements.count)
    return Wave(wave, stage.segment.first + begin, 2.0 * rate * delay, gain, tile.axes, stage)


def _lasting(tile: Tile, paths: Wavefronts, stage: Stage) -> tuple[Ints, int]:
    """Samples of the stretch where the paths of a tile begin (1,), or each (path,) where it is its own reference; and
    how many they last."""
    segment, rate = stage.segment, stage.segment.samples * stage.bins.step
    centre, spread = paths.delay - stage.origin, tile.spread
    early, wide = (centre, 0.0) if tile.alone else (centre.min(keepdims=True), float(np.ptp(centre)))
    spare = segment.samples if stage.tails else GUARD
    begin = np.maximum(((early - segment.before - spread) * rate).astype(int) - spare, 0)
    length = int((segment.before + segment.after + 2.0 * spread + wide) * rate) + 2 * spare + 2
    return begin, min(length, segment.samples)


def _shorter(stage: Stage, length: int) -> Stage:
    """A stage of a stretch of no more than `length` samples, where that is a part of it: of fewer bins."""
    bins, segment, rate = stage.bins, stage.segment, stage.segment.samples * stage.bins.step
    if 8 * length > 7 * segment.samples:
        return stage
    wave = kernel(stage.wave.width, rate / stage.aim.highest, 2 * length, stage.dtype)
    bins = bins.shorter(segment.samples, length, segment.before / (segment.before + segment.after))
    bins, grid = _on_grid(bins, stage.aim.highest, stage.grid.width, stage.oversampling, stage.dtype)
    return stage._replace(bins=bins, segment=replace(segment, samples=length), grid=grid, wave=wave)


def _alone(tile: Tile, paths: Wavefronts, points: Floats, begin: Floats, stage: Stage) -> npt.NDArray[Any]:
    """Fields (path, node, bin) of paths that are each steered to itself, from the instants `begin` (path,) on, s: that
    of the snap, through its face."""
    bins, steering = stage.bins, Steering.at(points, tile.reference)
    field = np.zeros((paths.count, len(points), stage.segment.samples + 1), np.result_type(stage.dtype, np.complex64))
    pulse = responses(paths.modes, stage) * absorbed(tile.reference, stage, stage.wave.spectrum)
    response = pulse * waves(bins.frequency, paths.delay - stage.origin - begin)
    directed = faces(tile, steering, stage).reshape(paths.count, len(points), -1)
    field[:, :, bins.first : bins.first + bins.frequency.size] = directed * response[:, None]
    return field


def _deposit(tile: Tile, paths: Wavefronts, points: Floats, begin: Floats, stage: Stage) -> npt.NDArray[Any]:
    """Field (1, node, bin) of a tile at its nodes, steered to its reference, from the instant `begin` (1,) on, s."""
    from sonarsynth.signals.gridded.deposit_kernels import combine

    bins, grid, steering = stage.bins, stage.grid, Steering.at(points, tile.reference)
    field = np.zeros((1, len(points), stage.segment.samples + 1), np.result_type(stage.dtype, np.complex64))
    factor = power(tile, stage, stage.wave.spectrum[: grid.spectrum.size] * grid.spectrum[: stage.wave.spectrum.size])
    mode = np.array(tile.terms)[:, 3]
    response = responses(tile.modes.T[: mode.max() + 1], stage)
    _, pair = face_pairs(tile.terms)
    table = _packed(paths, tile, bins.changes, (paths.delay - stage.origin - begin) * (grid.circle * bins.step))
    hidden, group = paths.hidden(stage.aim.elements.count), max(1, LARGEST // (len(tile.terms) * grid.circle))
    for first in range(0, len(points), group):
        rows = slice(first, first + group)
        some = steering.rows(rows)
        deposits = _deposits(table, paths, tile, some, hidden.T[rows], stage)
        spectra, directed = rfft(deposits[:, :, : grid.circle], axis=2), faces(tile, some, stage)
        combine(spectra, bins.first, directed, pair, factor, response, mode, field[0, rows])
    return field


def _deposits(
    table: Floats, paths: Wavefronts, tile: Tile, steering: Steering, occluded: Bools, stage: Stage
) -> npt.NDArray[Any]:
    """The grid (node, term, sample) of a tile at some of its nodes; occluded (node, path) from those, or (0, path)."""
    from sonarsynth.signals.gridded.deposit_kernels import BLOCK, deposit

    points, grid = steering.points, stage.grid
    rate = grid.circle * stage.bins.step
    late, louder, lean = np.zeros((0, 0)), np.zeros((0, 0)), np.zeros((0, 0, 0))
    share = shares(paths, tile.reference, tile.changes, stage.bins.changes, points, stage.dtype)
    if paths.expansion.delay.shape[1]:
        late = paths.expansion.over("delay", points).T * rate
        if stage.aim.elements.face > 0.0:
            lean = np.ascontiguousarray(tilt(paths, paths.expansion.gradient(points, "delay")[1:]))
    if paths.expansion.amplitude.shape[1]:
        louder = np.ascontiguousarray(paths.expansion.over("amplitude", points).T)
    if occluded.any():
        louder = np.where(occluded, -1.0, louder if louder.size else 0.0)
    farther = paths.attenuation * paths.sound_speed / rate  # dB a sample
    out = np.zeros((len(points), len(tile.terms), grid.circle + grid.lanes), stage.dtype)
    deposit(
        table.ravel(),
        table.shape[1],
        paths.count,
        points,
        steering.delay * rate,
        steering.nearness,
        steering.slowness,
        np.array([1.0 / d if d > 0 else 0.0 for d in tile.deviation[:2]]),
        np.array([NEPER * farther, farther / (tile.deviation[2] or 1.0)]),
        late,
        louder,
        lean,
        share,
        term_products(tile.terms),
        grid.taps,
        0.5 * grid.width,
        grid.lanes,
        rate / paths.sound_speed,
        grid.circle,
        out.ravel(),
        np.zeros((2, BLOCK)),
        np.zeros((2, BLOCK), np.int64),
        np.zeros((5 + len(tile.terms) + table.shape[1]) * BLOCK, stage.dtype),
    )
    return out


def _packed(paths: Wavefronts, tile: Tile, variation: PulseVariation, position: Floats) -> Floats:
    """Paths in blocks of rows (block, row, path), padded with silent ones: what `deposit` reads."""
    from sonarsynth.signals.gridded.deposit_kernels import BLOCK

    loss = (paths.loss - tile.reference.loss) / (tile.deviation[2] or 1.0)
    onto = tile.modes[:, : max(term[3] for term in tile.terms) + 1]
    modes = np.concatenate([onto, *(variation.onto[change] @ onto for change in tile.changes)], axis=1)
    values = (*paths.direction.T, paths.curvature, position, paths.amplitude, loss, *(paths.modes @ modes).T)
    blocks = -(-paths.count // BLOCK)
    rows = np.zeros((len(values), blocks * BLOCK))
    rows[0] = 1.0
    for row, value in zip(rows, values, strict=True):
        row[: paths.count] = value
    return np.ascontiguousarray(rows.reshape(len(values), blocks, BLOCK).swapaxes(0, 1))
