"""The sum over paths at every frequency, in float64: delay, Doppler, losses and the face of the hydrophone."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numba import njit

from sonarsynth.conventions import Floats

NEPER = np.log(10.0) / 20.0
"""Of a dB."""
NODES = ((1e-9, 1), (1e-4, 3), (3e-3, 5), (1.0, 9))
"""Of spectra at so many Chebyshev nodes, where Doppler varies by as much."""


@dataclass(frozen=True, eq=False)
class Contributions:
    """What reaches one hydrophone, a row a path."""

    time: Floats  # (path,) s: when the collapse is heard
    size: np.ndarray  # (path,) complex: amplitude at 1 m over that of the snap, without absorption
    longer: Floats  # (path,) the pulse lasts 1 + longer times as long
    length: Floats  # (path, 3) m, m2, m3: integrals of 1, depth and depth squared along the path
    blur: Floats  # (path,) s2: variance of delays, by roughness
    face: Floats  # (path, 2) s: side of the face times the slowness along either side

    @staticmethod
    def join(some: list[Contributions]) -> Contributions:
        """All rows."""
        return Contributions(*(np.concatenate([getattr(one, f.name) for one in some]) for f in fields(Contributions)))

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


def transfer(some: Contributions, weight: Floats, origin: float, step: float, loss: Floats) -> np.ndarray:
    """Sum (node, bin) at frequencies bin * step (Hz), delays from `origin` (s) on; loss (bin, 3): absorption in dB/m
    and its first two powers of depth."""
    out = np.zeros((weight.shape[1], len(loss)), complex)
    delay = np.ascontiguousarray(some.time - origin)
    _sum(delay, some.size, weight, some.length * NEPER, some.blur, some.face, step, np.ascontiguousarray(loss), out)
    return out


@njit(cache=True, nogil=True)
def _sum(delay, size, weight, length, blur, face, step, loss, out):  # type: ignore[no-untyped-def] # pragma: no cover
    nodes, bins = out.shape
    for n in range(len(delay)):
        turn = np.exp(-2j * np.pi * step * delay[n])
        one, other = np.pi * step * face[n, 0], np.pi * step * face[n, 1]
        turn_y, turn_z = np.exp(1j * one), np.exp(1j * other)
        phasor, y, z = size[n], 1.0 + 0.0j, 1.0 + 0.0j
        spread = 0.5 * (2.0 * np.pi * step) ** 2 * blur[n]
        for k in range(bins):
            lost = length[n, 0] * loss[k, 0] + length[n, 1] * loss[k, 1] + length[n, 2] * loss[k, 2] + spread * k * k
            gain = np.exp(-lost)
            if k > 0 and abs(one * k) > 1e-9:
                gain *= y.imag / (one * k)
            if k > 0 and abs(other * k) > 1e-9:
                gain *= z.imag / (other * k)
            value = phasor * gain
            for m in range(nodes):
                out[m, k] += weight[n, m] * value
            phasor, y, z = phasor * turn, y * turn_y, z * turn_z
