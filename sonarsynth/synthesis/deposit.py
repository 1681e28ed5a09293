"""One stretch of signals by kernel deposit: paths onto a fine grid, spectra, hydrophones, samples."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft

from sonarsynth.acoustics.arrays import aperture_terms
from sonarsynth.acoustics.snap import ComplexArray
from sonarsynth.acoustics.spectra import kaiser_bessel, kaiser_bessel_beta, kaiser_bessel_transform
from sonarsynth.conventions import Floats
from sonarsynth.sonar import Elements
from sonarsynth.synthesis.expansion import chebyshev, colour, interpolation, nodes_for, recipe, sinc_polynomials
from sonarsynth.synthesis.tiles import Aim, Tile, tiles
from sonarsynth.synthesis.wavefront import Fronts, delay_and_gain, towards

LARGEST = 1 << 22
"""Most numbers in a deposit grid: nodes are taken in groups of so many."""


class Kernel(NamedTuple):
    """A Kaiser-Bessel kernel on the grid that the paths are deposited on."""

    width: int  # samples, even
    beta: float
    taps: npt.NDArray[Any]  # (row * 4 * lane,) a cubic in the fraction of a sample for each row and tap
    lanes: int  # taps, padded to a multiple of 8
    circle: int  # samples of the grid


@lru_cache(maxsize=64)
def kernel(width: int, oversampling: float, circle: int, dtype: str) -> Kernel:
    """The kernel for a grid of `circle` samples at `oversampling` times twice the highest frequency."""
    rows, lanes = (32 if dtype == "float32" else 512), 8 * ((width + 7) // 8)
    beta = kaiser_bessel_beta(width, oversampling)
    x = 0.5 * chebyshev(4)
    fraction = (np.arange(rows)[:, None] + 0.5 + x) / rows  # (row, point)
    taps = np.zeros((rows, 4, lanes))
    value = kaiser_bessel(fraction[:, :, None] + np.arange(width) - width / 2, width, beta)
    taps[:, :, :width] = np.linalg.inv(np.vander(x, increasing=True)) @ value
    return Kernel(width, beta, taps.astype(dtype).ravel(), lanes, circle)


class Bins(NamedTuple):
    """Frequencies of a stretch."""

    frequency: Floats  # (bin,) Hz
    spectrum: ComplexArray  # (bin,) of the filtered snap at 1 m
    relative: Floats  # (bin,) absorption over that at the band centre, less one
    step: float  # Hz


def stretch_pressure(
    front: Fronts,
    elements: Elements,
    bins: Bins,
    origin: float,
    samples: int,
    highest: float,
    method: tuple[int, float, str, float],
) -> npt.NDArray[Any]:
    """Pressure (sensor, sample) of paths in a stretch that begins at `origin` (s) and holds the whole of their pulses.

    highest (Hz) is the stop edge of the filter; method is width, oversampling, precision and tolerance of
    `KernelDeposit`.
    """
    width, oversampling, dtype, tolerance = method
    circle = 2 * int(next_fast_len(int(np.ceil(highest * oversampling / bins.step)) + width, real=True))
    used = min(bins.frequency.size, circle // 2)
    bins = Bins(bins.frequency[:used], bins.spectrum[:used], bins.relative[:used], bins.step)
    grid = kernel(width, circle * bins.step / (2.0 * highest), circle, dtype)
    aim = Aim(
        elements=elements,
        highest=highest,
        weights=colour(bins.frequency, bins.spectrum, highest),
        steepest=float(np.abs(bins.relative[bins.frequency <= highest]).max(initial=0.0)),
        tolerance=tolerance,
        bins=used,
        circle=circle,
    )
    total = np.zeros((elements.count, 2 * used), dtype)
    for tile in tiles(front, aim):
        _add_tile(total, tile, front, aim, bins, origin, grid)
    response = bins.spectrum / kaiser_bessel_transform(np.arange(used) / circle, width, grid.beta)
    spectra = total.view(np.result_type(dtype, np.complex64))
    spectra *= (response * (samples * bins.step)).astype(spectra.dtype)
    return np.asarray(irfft(spectra, samples, axis=1, overwrite_x=True))


def _add_tile(
    total: npt.NDArray[Any], tile: Tile, front: Fronts, aim: Aim, bins: Bins, origin: float, grid: Kernel
) -> None:
    """Add the spectra of a tile at the hydrophones to total (sensor, re and im of bins)."""
    from sonarsynth.synthesis.kernels import combine, steer_back

    points = tile.nodes(aim.elements)
    part = front.select(tile.paths)
    field = np.empty((len(points), bins.frequency.size), np.result_type(total.dtype, np.complex64))
    group = max(1, LARGEST // (len(tile.terms) * grid.circle))
    for first in range(0, len(points), group):
        some = points[first : first + group]
        deposits = _deposits(part, tile, some, bins.step, origin, grid, total.dtype, aim)
        spectra = rfft(deposits[:, :, : grid.circle], axis=2)
        combine(spectra, _factors(tile, some, aim, bins, total.dtype), field[first : first + group])
    pairs = field.view(total.dtype)
    if tile.shape[0]:
        pairs = to_sensors(aim.elements, tile.shape, total.dtype.name) @ pairs
    delay, gain = delay_and_gain(tile.reference, aim.elements.position)
    steer_back(pairs, delay[0] * bins.step, gain[0] * aim.elements.gain, total)


@lru_cache(maxsize=64)
def to_sensors(elements: Elements, shape: tuple[int, int, int], dtype: str) -> npt.NDArray[Any]:
    """Interpolation (sensor, node) from the nodes of a tile."""
    low, high = elements.position.min(axis=0), elements.position.max(axis=0)
    centred = (elements.position - 0.5 * (low + high)) / np.where(high > low, 0.5 * (high - low), 1.0)
    x, y, z = (interpolation(centred[:, i], n).astype(dtype) for i, n in enumerate(shape))
    yz = y[:, :, None] * z[:, None, :]
    return np.asarray((yz if shape[0] == 1 else x[:, :, None, None] * yz[:, None]).reshape(elements.count, -1))


def _deposits(
    part: Fronts, tile: Tile, points: Floats, step: float, origin: float, grid: Kernel, dtype: npt.DTypeLike, aim: Aim
) -> npt.NDArray[Any]:
    """The grid (node, term, sample) of a tile at some points."""
    from sonarsynth.synthesis.kernels import deposit

    rate = grid.circle * step
    reference = tile.reference
    steer, level = delay_and_gain(reference, points)
    middle, _ = towards(reference, points)
    loss = tile.deviation[2] or 1.0
    table = _packed(part, (part.delay - origin) * rate, (part.loss - reference.loss) / loss)
    late = louder = np.zeros((0, 0))
    if part.delay_terms.shape[1]:
        late = (aperture_terms(points, part.aperture) @ part.delay_terms.T) * rate
    if part.gain_terms.shape[1]:
        louder = aperture_terms(points, part.aperture) @ part.gain_terms.T
    out = np.zeros((len(points), len(tile.terms), grid.circle + grid.lanes), dtype)
    deposit(
        table,
        part.count,
        points,
        steer[0] * rate,
        level[0],
        np.ascontiguousarray(middle[0, :, 1:]),
        np.array([1.0 / d if d > 0 else 0.0 for d in tile.deviation[:2]]),
        late,
        louder,
        recipe(tile.terms),
        grid.taps,
        0.5 * grid.width,
        grid.lanes,
        rate / part.sound_speed,
        grid.circle,
        out.ravel(),
    )
    return out


def _packed(part: Fronts, position: Floats, loss: Floats) -> Floats:
    """Paths in blocks of rows, padded with silent ones: the layout that `deposit` reads."""
    from sonarsynth.synthesis.kernels import BLOCK, ROWS

    blocks = -(-part.count // BLOCK)
    rows = np.zeros((ROWS, blocks * BLOCK))
    rows[0] = 1.0
    values = (*part.direction.T, part.curvature, position, part.amplitude, loss)
    for row, value in zip(rows, values, strict=True):
        row[: part.count] = value
    return np.ascontiguousarray(rows.reshape(ROWS, blocks, BLOCK).swapaxes(0, 1)).ravel()


def _factors(tile: Tile, points: Floats, aim: Aim, bins: Bins, dtype: npt.DTypeLike) -> npt.NDArray[Any]:
    """Real factor (node, term, bin) of each term's spectrum: polynomials of the face's directivity, times those of
    absorption."""
    u, _ = towards(tile.reference, points)
    loss = 10.0 ** (-tile.reference.loss * bins.relative / 20.0)
    decay = -np.log(10.0) / 20.0 * tile.deviation[2] * bins.relative
    degrees = np.array(tile.terms)
    power = np.cumprod(np.concatenate([[loss], decay / np.arange(1, degrees[:, 2].max() + 1)[:, None]]), axis=0)
    power = power.astype(dtype)[degrees[:, 2]]
    if aim.elements.face == 0.0:
        return np.broadcast_to(power, (len(points), *power.shape))
    scale = aim.elements.face / tile.reference.sound_speed
    top = bins.frequency[-1]
    widest = np.abs(u[0, :, 1:]).max(axis=0) + tile.deviation[:2]
    # smooth in frequency: a few Chebyshev frequencies do; half the range of phase is half of the largest
    count = nodes_for(0.5 * np.pi * scale * top * float(widest.sum()), (1.0,), 0.1 * aim.tolerance)
    f = 0.5 * top * (1.0 + chebyshev(count)) * scale
    y, z = (
        sinc_polynomials(u[0, :, 1 + i, None] * f, tile.deviation[i] * f, int(degrees[:, i].max())) for i in range(2)
    )
    face = (y[degrees[:, 0]] * z[degrees[:, 1]]).swapaxes(0, 1).reshape(-1, count).astype(dtype)
    out = (face @ _to_bins(bins.frequency.size, count, np.dtype(dtype).name)).reshape(len(points), *power.shape)
    out *= power
    return np.asarray(out)


@lru_cache(maxsize=64)
def _to_bins(bins: int, count: int, dtype: str) -> npt.NDArray[Any]:
    """Interpolation (node, bin) from Chebyshev frequencies to all bins."""
    return np.ascontiguousarray(interpolation(np.linspace(-1.0, 1.0, bins), count).T.astype(dtype))
