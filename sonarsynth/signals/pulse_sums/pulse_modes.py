"""Pulses of any path as sums of a few modes, tabulated on a fine grid of time.

What water, roughness and the faces of sensors leave of each frequency are smooth functions of frequency: a few modes
make all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.arrays.apertures import element_directivity
from sonarsynth.randomness import stream
from sonarsynth.signals.array_paths import NEPER
from sonarsynth.signals.gridded.nodes import analysis, chebyshev

TOLERANCE = 2e-3
"""Of the peak of a pulse: where it is cut, and what modes leave out."""
FRACTIONS = 32
"""Parts of a sample between which pulses are linear."""
NODES = 32
"""Frequencies that modes are made at."""
SAMPLED = 800
"""Directions and lengths of paths that modes are made of."""
FARTHEST = 3e3
"""m: of the paths that modes are made of."""


@dataclass(frozen=True, eq=False)
class PulseModes:
    """The pulses of one waveform."""

    table: npt.NDArray[np.float32]  # (mode, fraction * tap): modes, then their Hilbert transforms
    before: int  # samples: the first tap is so many before time 0
    shapes: Floats  # (mode, node) of which the spectra of paths are sums
    frequency: Floats  # (node,) Hz


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
    factor = np.exp(-NEPER * np.multiply.outer(length, absorption))
    if delay_std.any():
        factor *= np.exp(-0.5 * (2.0 * np.pi * np.multiply.outer(delay_std, frequency)) ** 2)
    if face > 0.0:
        factor *= element_directivity(frequency, direction[:, None, :], face, speed)
    return np.asarray(factor, float)


def at_frequencies(frequency: Floats, nodes: Floats, values: Floats) -> Floats:
    """Values (mode, node) between their nodes, at frequencies (bin,); at those of the ends beyond."""
    middle, half = 0.5 * (nodes[0] + nodes[-1]), 0.5 * (nodes[0] - nodes[-1]) / chebyshev(len(nodes))[0]
    x = np.clip((frequency - middle) / half, -1.0, 1.0)
    return np.asarray(values @ analysis(len(nodes)).T @ np.polynomial.chebyshev.chebvander(x, len(nodes) - 1).T)


def shapes_of(nodes: Floats, band: float, face: float, speed: float, absorption: Floats) -> tuple[Floats, Floats]:
    """Orthonormal shapes (mode, node) that paths of any length and direction are sums of, and their largest weights."""
    random = stream(0, "chorus shapes")
    towards = random.standard_normal((SAMPLED, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    length = FARTHEST ** random.random(SAMPLED)
    delay_std = np.maximum(random.random(SAMPLED) - 0.5, 0.0) / (np.pi * band)
    sampled = shape_of(nodes, towards, length, delay_std, absorption, face, speed)
    _, size, shapes = np.linalg.svd(sampled, full_matrices=False)
    remainder = np.sqrt(np.cumsum((size**2)[::-1])[::-1] / np.sum(size**2))
    shapes = shapes[: int(np.sum(remainder > TOLERANCE))]
    return shapes, np.abs(sampled @ shapes.T).max(axis=0)


def tabulated(bare: Complexes, samples: int, fine: float, nodes: Floats, basis: tuple[Floats, Floats]) -> PulseModes:
    """The modes of a pulse of this spectrum (bin,), up to where that ends, on `samples` of a grid of `fine` (Hz).

    basis: of `shapes_of`, at frequencies `nodes` (Hz).
    """
    shapes, weight = basis
    frequency = np.asarray(np.arange(len(bare)) * (fine / samples), float)
    spectrum = np.zeros((1 + 2 * len(shapes), samples // 2 + 1), complex)
    spectrum[0, : len(bare)] = bare
    spectrum[1 : 1 + len(shapes), : len(bare)] = bare * at_frequencies(frequency, nodes, shapes)
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
