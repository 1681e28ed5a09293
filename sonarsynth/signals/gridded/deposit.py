"""One stretch of signals by kernel deposit: paths onto a fine grid, spectra, hydrophones, samples."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.conventions import Bools, Floats
from sonarsynth.equations.noise import filters
from sonarsynth.receiver import Elements
from sonarsynth.signals.array_paths import (
    NEPER,
    Wavefronts,
    arrival_directions,
    delay_and_gain,
    lost,
    tilt,
    towards,
)
from sonarsynth.signals.gridded.bins import Bins
from sonarsynth.signals.gridded.interpolation import to_sensors
from sonarsynth.signals.gridded.low_rank import face_pairs, sinc_polynomials, spectral_quantiles, term_products
from sonarsynth.signals.gridded.nodes import DEGREES, Axis, chebyshev, interpolation, nodes_for, polynomials_for
from sonarsynth.signals.gridded.tiles import Tile, TileSettings, tiles
from sonarsynth.signals.pulse_variation import PulseVariation, changed, shares
from sonarsynth.signals.segments import GUARD, Segment

RELAXING = np.log(4.0)
"""Chebyshev coefficients of absorption over the band fall by this (Np) from each degree to the next, or by more."""
LARGEST = 1 << 20
"""Most numbers in a deposit grid: nodes are taken in groups of so many."""


class Kernel(NamedTuple):
    """A Kaiser-Bessel kernel on the grid that the paths are deposited on."""

    width: int  # samples, even
    taps: npt.NDArray[Any]  # (row * 4 * lane,) a cubic in the fraction of a sample for each row and tap
    lanes: int  # taps, padded to a multiple of 8
    circle: int  # samples of the grid
    spectrum: Floats  # (bin,) of the kernel


@lru_cache(maxsize=64)
def kernel(width: int, oversampling: float, circle: int, dtype: str) -> Kernel:
    """The kernel for a grid of `circle` samples at `oversampling` times twice the highest frequency."""
    rows, lanes = (32 if dtype == "float32" else 512), 8 * ((width + 7) // 8)
    beta = filters.kaiser_bessel_beta(width, oversampling)
    x = 0.5 * chebyshev(4)
    fraction = (np.arange(rows)[:, None] + 0.5 + x) / rows  # (row, point)
    taps = np.zeros((rows, 4, lanes))
    value = filters.kaiser_bessel(fraction[:, :, None] + np.arange(width) - width / 2, width, beta)
    taps[:, :, :width] = np.linalg.inv(np.vander(x, increasing=True)) @ value
    spectrum = filters.kaiser_bessel_transform(np.arange(circle // 2 + 1) / circle, width, beta)
    return Kernel(width, taps.astype(dtype).ravel(), lanes, circle, spectrum)


class Steering(NamedTuple):
    """What the reference of a tile has at its nodes."""

    points: Floats  # (node, xyz)
    delay: Floats  # (node,) s after the array centre
    nearness: Floats  # (node,) gain of the sphere alone
    slowness: Floats  # (node, yz) of `arrival_directions`

    @staticmethod
    def at(points: Floats, reference: Wavefronts) -> Steering:
        """That of a reference."""
        delay, direction = delay_and_gain(reference, points)[0][0], arrival_directions(reference, points)[0]
        return Steering(points, delay, 1.0 / towards(reference, points)[1][0], np.ascontiguousarray(direction[:, 1:]))

    def rows(self, rows: slice) -> Steering:
        """At some of the nodes."""
        return Steering(*(column[rows] for column in self))


class Stage(NamedTuple):
    """What the tiles of a stretch have in common."""

    aim: TileSettings
    bins: Bins
    origin: float  # s
    segment: Segment
    grid: Kernel  # that paths are deposited on
    wave: Kernel  # of time at twice the sampling rate, that hydrophones hear
    dtype: str


def add_segment(
    out: npt.NDArray[Any],
    segment: Segment,
    front: Wavefronts,
    elements: Elements,
    bins: Bins,
    *,
    origin: float,
    highest: float,
    method: tuple[int, float, str, float],
) -> None:
    """Add to out (sensor, sample) the pressure of paths in a stretch, which begins at `origin` (s).

    highest (Hz) is the stop edge of the filter; method is width, oversampling, precision and tolerance of
    `GriddedSynthesis`.
    """
    samples = segment.samples
    width, oversampling, dtype, tolerance = method
    circle = 2 * int(next_fast_len(int(np.ceil(highest * oversampling / bins.step)) + width, real=True))
    used = min(bins.frequency.size, circle // 2 - bins.first)
    bins = bins.cut(used)
    grid = kernel(width, circle * bins.step / (2.0 * highest), circle, dtype)
    aim = TileSettings(
        elements=elements,
        highest=highest,
        weights=spectral_quantiles(bins.frequency, bins.spectrum, highest),
        steepest=float(np.abs(bins.relative[bins.frequency <= highest]).max(initial=0.0)),
        fading=float(np.abs(bins.relative) @ np.abs(bins.spectrum) / np.abs(bins.spectrum).sum()),
        tolerance=tolerance,
        changes=bins.changes,
        bins=used,
        circle=circle,
    )
    wave = kernel(-8 * (-width // 8), samples * bins.step / highest, 2 * samples, dtype)  # as wide as its lanes
    stage = Stage(aim, bins, origin, segment, grid, wave, dtype)
    front = front.without_faint_shadows(0.1 * tolerance, elements.count)
    for tile in tiles(front, aim) if front.count else ():
        _add_tile(out, tile, front.select(tile.paths), stage)


def _add_tile(out: npt.NDArray[Any], tile: Tile, paths: Wavefronts, stage: Stage) -> None:
    """Add the pressure of a tile at the hydrophones to out (sensor, sample)."""
    from sonarsynth.signals.gridded.deposit_kernels import hear

    elements, bins, dtype, samples = stage.aim.elements, stage.bins, stage.dtype, stage.segment.samples
    steering, alone = Steering.at(tile.nodes(elements), tile.reference), paths.count == 1
    field = np.zeros((len(steering.points), samples + 1), np.result_type(dtype, np.complex64))
    some = field[:, bins.first : bins.first + bins.frequency.size]
    if alone:  # everything is steered to it: the field is that of the snap, through its face
        power, response = _power(tile, stage, stage.wave.spectrum), _responses(paths.modes, stage)
        response = response * np.exp(-2j * np.pi * (paths.delay[0] - stage.origin) * bins.frequency)
        some[:] = (_faces(tile, steering, stage) * power * response)[:, 0]
    else:
        _deposit(field, tile, paths, steering, stage)
    if tile.reference.expansion.phase.any() or tile.reference.expansion.delay_variance.any():
        some *= changed(tile.reference, steering.points, bins.frequency)
    delay, gain = delay_and_gain(tile.reference, elements.position)
    gain = gain[0] * elements.gain * (paths.amplitude[0] if alone else 1.0)
    if alone and paths.occluded.any():
        gain = gain * ~paths.hidden(elements.count)[0]
    onto, column, weight = to_sensors(elements, tile.axes, dtype)
    rate, centre = samples * bins.step, paths.delay - stage.origin
    spare = GUARD if stage.aim.tolerance > 10.0 * filters.SUPPORT_TOLERANCE else samples  # tails that absorption leaves
    begin = max(int((centre.min() - stage.segment.before) * rate) - spare, 0)
    end = min(int((centre.max() + stage.segment.after) * rate) + spare + 1, samples)
    wave = irfft(field, 2 * samples, axis=1, overwrite_x=True)[:, 2 * begin : 2 * end]
    wave = np.stack([wave[:, ::2], wave[:, 1::2]], axis=1).reshape(-1, weight.shape[1] * 2 * (end - begin))
    wave = wave if onto is None else onto @ wave
    wave, kernel = wave.reshape(len(wave), weight.shape[1], 2, end - begin), stage.wave
    hear(wave, column, weight, 2.0 * rate * delay[0], gain, kernel.taps, kernel.lanes, stage.segment.first + begin, out)


def _deposit(field: npt.NDArray[Any], tile: Tile, paths: Wavefronts, steering: Steering, stage: Stage) -> None:
    """Add a tile, steered to its reference, to the field (node, bin) at its nodes."""
    from sonarsynth.signals.gridded.deposit_kernels import combine

    bins, grid = stage.bins, stage.grid
    power = _power(tile, stage, stage.wave.spectrum[: grid.spectrum.size] * grid.spectrum[: stage.wave.spectrum.size])
    mode = np.array(tile.terms)[:, 3]
    response = _responses(tile.modes.T[: mode.max() + 1], stage)
    _, pair = face_pairs(tile.terms)
    table = _packed(paths, tile, bins.changes, (paths.delay - stage.origin) * (grid.circle * bins.step))
    hidden, group = paths.hidden(stage.aim.elements.count), max(1, LARGEST // (len(tile.terms) * grid.circle))
    for first in range(0, len(field), group):
        rows = slice(first, first + group)
        some = steering.rows(rows)
        deposits = _deposits(table, paths, tile, some, hidden.T[rows], stage)
        spectra, faces = rfft(deposits[:, :, : grid.circle], axis=2), _faces(tile, some, stage)
        combine(spectra, bins.first, faces, pair, power, response, mode, field[rows])


def _deposits(
    table: Floats, paths: Wavefronts, tile: Tile, steering: Steering, occluded: Bools, stage: Stage
) -> npt.NDArray[Any]:
    """The grid (node, term, sample) of a tile at some of its nodes; occluded (node, path) from those, or (0, path)."""
    from sonarsynth.signals.gridded.deposit_kernels import deposit

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


def _responses(weight: Floats, stage: Stage) -> npt.NDArray[Any]:
    """Spectra (mode, bin) of pulses: sums, by weight (mode, mode of all paths), or that of all paths where they have no
    modes."""
    bins = stage.bins
    value = weight @ bins.modes if len(bins.modes) else bins.spectrum[None]
    return np.asarray(value * (2.0 * stage.segment.samples * bins.step)).astype(
        np.result_type(stage.dtype, np.complex64)
    )


def _power(tile: Tile, stage: Stage, spectrum: Floats) -> npt.NDArray[Any]:
    """Real factor (term, bin) of each term's spectrum: the polynomials of absorption, over the spectrum (bin,) of the
    kernels, from 0 Hz on."""
    relative, first = stage.bins.relative, stage.bins.first
    loss = lost(tile.reference.loss * relative) / spectrum[first : first + relative.size]
    decay = -NEPER * tile.deviation[2] * relative
    degree = np.array(tile.terms)[:, 2]
    power = np.cumprod(np.concatenate([[loss], decay / np.arange(1, degree.max() + 1)[:, None]]), axis=0)
    return np.asarray(power.astype(stage.dtype)[degree])


def _faces(tile: Tile, steering: Steering, stage: Stage) -> npt.NDArray[Any]:
    """Real factor (node, pair, bin) of the spectra of terms, by `face_pairs`: the polynomials of the face's
    directivity, and what the longer way of the reference loses at a frequency beside that at the band centre."""
    f, dtype, face, reference = stage.bins.frequency, stage.dtype, stage.aim.elements.face, tile.reference
    degrees, _ = face_pairs(tile.terms)
    if face == 0.0 and not reference.attenuation:
        return np.broadcast_to(np.ones(1, dtype), (len(steering.points), len(degrees), f.size))
    u = steering.slowness.T
    middle, half = 0.5 * (f[-1] + f[0]), 0.5 * (f[-1] - f[0])
    scale = face / reference.sound_speed
    deviation = np.array(tile.deviation[:2])[:, None]
    # smooth in frequency: a few Chebyshev frequencies do
    widest = float((np.abs(u) + deviation).max(axis=1).sum())
    farther = reference.attenuation * reference.sound_speed * steering.delay  # dB
    decay = NEPER * float(np.abs(farther).max()) * stage.aim.steepest
    allowed = 0.1 * stage.aim.tolerance
    turning, sizes = np.pi * scale * half * widest, (1.0, decay, decay, decay)
    axis = polynomials_for(turning, (1.0,), allowed, sizes) if decay else nodes_for(turning, (1.0,), allowed)
    if decay:
        axis = Axis(axis.nodes + max(int(np.ceil(np.log(decay / allowed) / RELAXING)) - DEGREES, 0))
    frequency = middle + half * chebyshev(axis.nodes)
    at = frequency * scale
    degree = int(degrees.max())
    y, z = sinc_polynomials(u[:, :, None] * at, (deviation * at)[:, None], degree).swapaxes(0, 1)
    factors = (y[degrees[:, 0]] * z[degrees[:, 1]]).swapaxes(0, 1)
    if decay:
        factors = factors * lost(np.multiply.outer(farther, np.interp(frequency, f, stage.bins.relative)))[:, None]
    factors = factors.reshape(-1, axis.nodes).astype(dtype)
    return np.asarray(factors @ _to_bins(f.size, axis, dtype)).reshape(len(steering.points), len(degrees), f.size)


@lru_cache(maxsize=64)
def _to_bins(bins: int, axis: Axis, dtype: str) -> npt.NDArray[Any]:
    """Interpolation (node, bin) from nodes over the band to all bins."""
    return np.ascontiguousarray(interpolation(np.linspace(-1.0, 1.0, bins), axis).T.astype(dtype))
