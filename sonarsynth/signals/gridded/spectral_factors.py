"""What the spectra of a tile are multiplied by: kernels, pulses, absorption, directivity of faces."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.noise import filters
from sonarsynth.signals.array_paths import NEPER, Wavefronts, arrival_directions, delays, lost, towards
from sonarsynth.signals.gridded.bins import Bins
from sonarsynth.signals.gridded.low_rank import face_pairs, sinc_polynomials
from sonarsynth.signals.gridded.nodes import DEGREES, Axis, chebyshev, interpolation, nodes_for, polynomials_for
from sonarsynth.signals.gridded.tiles import Tile, TileSettings
from sonarsynth.signals.segments import Segment

RELAXING = np.log(4.0)
"""Chebyshev coefficients of absorption over the band fall by this (Np) from each degree to the next, or by more."""


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
    """What the reference of a tile has at its nodes; of several, each has all nodes, one reference after the other."""

    points: Floats  # (node, xyz)
    delay: Floats  # (node,) s after the array centre
    nearness: Floats  # (node,) gain of the sphere alone
    slowness: Floats  # (node, yz) of `arrival_directions`

    @staticmethod
    def at(points: Floats, reference: Wavefronts) -> Steering:
        """That of references."""
        u, n = towards(reference, points)
        slowness = np.ascontiguousarray(arrival_directions(reference, points, u)[:, :, 1:].reshape(-1, 2))
        return Steering(points, delays(reference, n, points).ravel(), 1.0 / n.ravel(), slowness)

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
    oversampling: float  # of that grid, at least
    wave: Kernel  # of time at twice the sampling rate, that hydrophones hear
    dtype: str
    tails: bool  # what absorption leaves, and leaks cut at half the sampling frequency, lasts beyond the pulses


def responses(weight: Floats, stage: Stage) -> npt.NDArray[Any]:
    """Spectra (mode, bin) of pulses: sums, by weight (mode, mode of all paths), or that of all paths where they have no
    modes."""
    bins = stage.bins
    value = weight @ bins.modes if len(bins.modes) else bins.spectrum[None]
    return np.asarray(value * (2.0 * stage.segment.samples * bins.step)).astype(
        np.result_type(stage.dtype, np.complex64)
    )


def power(tile: Tile, stage: Stage, spectrum: Floats) -> npt.NDArray[Any]:
    """Real factor (term, bin) of each term's spectrum: the polynomials of absorption, over the spectrum (bin,) of the
    kernels, from 0 Hz on."""
    decay = -NEPER * tile.deviation[2] * stage.bins.relative
    degree = np.array(tile.terms)[:, 2]
    factors = [absorbed(tile.reference, stage, spectrum), decay / np.arange(1, degree.max() + 1)[:, None]]
    return np.asarray(np.cumprod(np.concatenate(factors), axis=0).astype(stage.dtype)[degree])


def absorbed(reference: Wavefronts, stage: Stage, spectrum: Floats) -> Floats:
    """What absorption leaves of references (path, bin), over the spectrum (bin,) of kernels, from 0 Hz on."""
    relative, first = stage.bins.relative, stage.bins.first
    return np.asarray(lost(np.multiply.outer(reference.loss, relative)) / spectrum[first : first + relative.size])


def faces(tile: Tile, steering: Steering, stage: Stage) -> npt.NDArray[Any]:
    """Real factor (node, pair, bin) of the spectra of terms, by `face_pairs`: the polynomials of the face's
    directivity, and what the longer way of the reference loses at a frequency beside that at the band centre."""
    f, dtype, face, reference = stage.bins.frequency, stage.dtype, stage.aim.elements.face, tile.reference
    degrees, _ = face_pairs(tile.terms)
    if face == 0.0 and not reference.attenuation:
        return np.broadcast_to(np.ones(1, dtype), (len(steering.slowness), len(degrees), f.size))
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
    return np.asarray(factors @ _to_bins(f.size, axis, dtype)).reshape(len(u.T), len(degrees), f.size)


@lru_cache(maxsize=64)
def _to_bins(bins: int, axis: Axis, dtype: str) -> npt.NDArray[Any]:
    """Interpolation (node, bin) from nodes over the band to all bins."""
    return np.ascontiguousarray(interpolation(np.linspace(-1.0, 1.0, bins), axis).T.astype(dtype))
