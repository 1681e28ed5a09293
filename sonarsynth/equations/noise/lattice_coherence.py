"""Noise on a lattice of sensors: its covariance by lag, and the periodic field that has it.

The covariance of a field of independent plane waves is the Fourier sum of their powers at the lags of the lattice: a
non-uniform FFT. Put on a torus and transformed, it is the power of each wave of a periodic field, which is drawn by one
FFT (circulant embedding). Sources: Dietrich and Newsam (1997), SIAM J. Sci. Comput. 18, 1088; Barnett, Magland and af
Klinteberg (2019), SIAM J. Sci. Comput. 41, C479, for the sum.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from scipy.fft import fft2, ifft2, next_fast_len

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Complexes, Floats
from sonarsynth.equations.noise.filters import kaiser_bessel, kaiser_bessel_beta, kaiser_bessel_transform

WIDTH, OVERSAMPLING, TABLE = 6, 2.0, 2048
"""Of the kernel of the sum: grid points that a wave goes to, how much finer the grid is than the lags need, and values
of the kernel from one grid point to the next."""


def lag_covariance(
    toward: Floats, weight: Floats, turn: tuple[float, float], face: float, lags: tuple[int, int]
) -> Complexes:
    """Covariance (2 ly, 2 lz) of square faces at lags (ly, lz) of the lattice, -l to l - 1 in the order of an FFT.

    toward (wave, xyz): where plane waves come from, sonar frame; weight (wave,): their power at a point; turn: phase in
    rad that a wave along y, and along z, gains from sensor to sensor; face: the phase that it gains over a face. The
    sum over waves of weight sinc^2 sinc^2 exp(i (m turn_y u_y + n turn_z u_z)); error 1e-5.
    """
    size = tuple(next_fast_len(int(np.ceil(2.0 * OVERSAMPLING * max(lag, WIDTH)))) for lag in lags)
    wide = np.zeros((size[0] + WIDTH, size[1] + WIDTH))
    _deposit(wide, toward, weight, *turn, face, _kernel())
    wide[:WIDTH] += wide[size[0] :]
    wide[:, :WIDTH] += wide[:, size[1] :]
    grid = wide[: size[0], : size[1]]
    beta = kaiser_bessel_beta(WIDTH, OVERSAMPLING)
    covariance = ifft2(grid) * grid.size
    for axis, lag in enumerate(lags):
        lag_index = np.fft.fftfreq(2 * lag, 1.0 / (2 * lag)).astype(int)
        shape = kaiser_bessel_transform(lag_index / size[axis], WIDTH, beta)
        back = np.exp(-1j * np.pi * WIDTH * lag_index / size[axis]) / shape  # the grid is ahead
        covariance = np.moveaxis(np.moveaxis(covariance, axis, -1)[..., lag_index] * back, -1, axis)
    return np.asarray(covariance)


@lru_cache(maxsize=1)
def _kernel() -> Floats:
    """The kernel (TABLE WIDTH/2 + 2,) at distances from 0 on."""
    distance = np.arange(TABLE * WIDTH // 2 + 2) / TABLE
    return kaiser_bessel(np.minimum(distance, 0.5 * WIDTH), WIDTH, kaiser_bessel_beta(WIDTH, OVERSAMPLING))


@compiled(fastmath=True)
def _deposit(
    grid: Floats, toward: Floats, weight: Floats, turn_y: float, turn_z: float, face: float, kernel: Floats
) -> None:
    """Adds the powers of waves, as faces hear them, to a grid of their phases from sensor to sensor, WIDTH wider each
    way than its period and that much ahead by half a kernel."""
    ny, nz = grid.shape[0] - WIDTH, grid.shape[1] - WIDTH
    along_y, along_z = np.empty(WIDTH), np.empty(WIDTH)
    for n in range(weight.size):
        uy, uz = toward[n, 1], toward[n, 2]
        power = weight[n] * _sinc(0.5 * face * uy) ** 2 * _sinc(0.5 * face * uz) ** 2
        y = _spread(along_y, turn_y * uy / (2.0 * math.pi), ny, kernel)
        z = _spread(along_z, turn_z * uz / (2.0 * math.pi), nz, kernel)
        for i in range(WIDTH):
            scaled, row = power * along_y[i], grid[y + i]
            for j in range(WIDTH):
                row[z + j] += scaled * along_z[j]


@compiled(inline="always")
def _sinc(x: float) -> float:
    return math.sin(x) / x if abs(x) > 1e-8 else 1.0


@compiled(inline="always")
def _spread(values: Floats, cycles: float, count: int, kernel: Floats) -> int:
    """Values of the kernel about a phase, and the point of the grid that is the first of them."""
    position = (cycles - math.floor(cycles)) * count
    first = math.ceil(position - 0.5 * WIDTH)
    for j in range(WIDTH):
        far = abs(first + j - position) * TABLE
        cell = int(far)
        values[j] = kernel[cell] + (far - cell) * (kernel[cell + 1] - kernel[cell])
    return first + WIDTH // 2


def periodic_powers(covariance: Complexes, used: Bools, rounds: int) -> tuple[Floats, float]:
    """Powers (..., ny, nz) of the waves of a periodic field of a covariance (..., ny, nz), in the order of an FFT; and
    the largest error of its covariance at the lags that are used (ny, nz), over that at lag 0.

    A wave of negative power there is none: it is left out, and what that changes at lags that are used is put right
    again by changing others, `rounds` times (projections on convex sets; Bregman 1965).
    """
    wanted, powers = covariance, np.maximum(fft2(covariance).real, 0.0)
    for _ in range(rounds):
        powers = np.maximum(fft2(np.where(used, wanted, ifft2(powers))).real, 0.0)
    error = np.abs(np.where(used, ifft2(powers) - wanted, 0.0)).max(axis=(-2, -1))
    return powers, float(np.max(error / wanted[..., 0, 0].real))
