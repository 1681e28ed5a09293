"""The sum over paths at every frequency, in float64: delay, Doppler, losses and the face of the hydrophone."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numba import njit

from sonarsynth.conventions import Floats

NEPER = np.log(10.0) / 20.0
"""Of a dB."""
NODES = ((1e-9, 1), (1e-5, 2), (1e-3, 3), (1e-2, 5), (1.0, 9))
"""Of spectra at so many Chebyshev nodes, where Doppler varies by as much."""

BLOCK = 8
"""Bins over which the exponent of absorption is linear: to 1e-8 of a neper at 100 Hz apart."""
FLAT = 1e-12
"""s: faces over which a wave is as late as this, or less, hear it as a point."""


@dataclass(frozen=True, eq=False)
class Contributions:
    """What reaches one hydrophone, a row a path."""

    time: Floats  # (path,) s: when the collapse is heard
    size: np.ndarray  # (path,) complex: amplitude at 1 m over that of the snap, without absorption
    longer: Floats  # (path,) the pulse lasts 1 + longer times as long
    length: Floats  # (path, 3) m, m2, m3: integrals of 1, depth and depth squared along the path
    delay_std: Floats  # (path,) s2: variance of delays, by roughness
    face: Floats  # (path, 2) s: side of the face times the slowness along either side

    @staticmethod
    def join(paths: list[Contributions]) -> Contributions:
        """All rows."""
        return Contributions(
            *(np.concatenate([getattr(block, f.name) for block in paths]) for f in fields(Contributions))
        )

    def select(self, rows: np.ndarray) -> Contributions:
        """Some rows."""
        return Contributions(*(np.ascontiguousarray(getattr(self, f.name)[rows]) for f in fields(self)))


def stretches(longer: Floats) -> tuple[Floats, Floats]:
    """Nodes (node,) for Doppler values (path,), and the weights (path, node) of Lagrange's interpolation."""
    low, high = float(longer.min()), float(longer.max())
    count = next(n for width, n in NODES if high - low <= width)
    angle = np.pi * (np.arange(count) + 0.5) / count
    node = 0.5 * (low + high) + 0.5 * max(high - low, 1e-9) * np.cos(angle)
    weight = np.ones((len(longer), count))
    for n in range(count):
        for m in range(count):
            if m != n:
                weight[:, n] *= (longer - node[m]) / (node[n] - node[m])
    return node, weight


def transfer(paths: Contributions, weight: Floats, origin: float, step: float, first: int, loss: Floats) -> np.ndarray:
    """Sum (node, bin) at frequencies (first + bin) * step (Hz), delays from `origin` (s) on; loss (bin, 3): absorption
    in dB/m and its first two powers of depth there."""
    out = np.zeros((weight.shape[1], len(loss), 2))
    delay, bins = np.ascontiguousarray(paths.time - origin), np.ascontiguousarray(loss * NEPER)
    with np.errstate(divide="ignore"):
        inverse = 1.0 / (np.pi * step * (first + np.arange(len(loss))))
    _sum(delay, paths.size, weight, paths.length, paths.delay_std, paths.face, step, first, bins, inverse, out)
    return out[..., 0] + 1j * out[..., 1]


def point_spectrum(time: Floats, strength: Floats, step: float, bins: int) -> np.ndarray:
    """sum_n strength_n exp(-i 2 pi f time_n) (bin,) at frequencies bin * step (Hz) of any pulse."""
    out = np.zeros((bins, 2))
    _points(np.ascontiguousarray(time), np.ascontiguousarray(strength), step, out)
    return out[:, 0] + 1j * out[:, 1]


@njit(cache=True, nogil=True)
def _points(time, strength, step, out):  # type: ignore[no-untyped-def] # pragma: no cover
    for n in range(len(time)):
        turn, phasor = np.exp(-2j * np.pi * step * time[n]), strength[n] + 0.0j
        for k in range(len(out)):
            out[k, 0] += phasor.real
            out[k, 1] += phasor.imag
            phasor *= turn


@njit(cache=True, nogil=True, error_model="numpy")
def _sum(delay, size, weight, length, delay_std, face, step, first, loss, inverse, out):  # type: ignore[no-untyped-def] # pragma: no cover
    nodes, bins = out.shape[:2]
    for n in range(len(delay)):
        phase_y, phase_z = np.pi * step * face[n, 0], np.pi * step * face[n, 1]
        turn, turn_y, turn_z = np.exp(-2j * np.pi * step * delay[n]), np.exp(1j * phase_y), np.exp(1j * phase_z)
        phasor = size[n] * np.exp(-2j * np.pi * step * first * delay[n])
        y, z = np.exp(1j * phase_y * first), np.exp(1j * phase_z * first)
        spread = 0.5 * (2.0 * np.pi * step) ** 2 * delay_std[n]
        falls = np.exp(-2.0 * spread)
        flat_y, flat_z = abs(face[n, 0]) < FLAT, abs(face[n, 1]) < FLAT
        for block in range(0, bins, BLOCK):
            end = min(block + BLOCK, bins)
            low, high = 0.0, 0.0
            for c in range(3):
                low += length[n, c] * loss[block, c]
                high += length[n, c] * loss[end - 1, c]
            gain, ratio = np.exp(-low), np.exp((low - high) / max(end - 1 - block, 1))
            blur = np.exp(-spread * (first + block) ** 2)
            fall = np.exp(-spread * (2 * (first + block) + 1))
            for k in range(block, end):
                value = gain * blur
                if not flat_y and first + k > 0:
                    value *= y.imag * inverse[k] / face[n, 0]
                if not flat_z and first + k > 0:
                    value *= z.imag * inverse[k] / face[n, 1]
                real, imaginary = phasor.real * value, phasor.imag * value
                for m in range(nodes):
                    out[m, k, 0] += weight[n, m] * real
                    out[m, k, 1] += weight[n, m] * imaginary
                phasor, y, z, gain = phasor * turn, y * turn_y, z * turn_z, gain * ratio
                blur, fall = blur * fall, fall * falls
