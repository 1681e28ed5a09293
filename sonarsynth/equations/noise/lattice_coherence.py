"""Noise on a lattice of sensors: its covariance by lag, and the periodic field that has it.

The covariance of a field of independent plane waves is the Fourier sum of their powers at the lags of the lattice: a
non-uniform FFT. It is a smooth function of phases alone: worked out once on a grid of phases, it is interpolated to the
lags of each frequency, in a tenth of the time. Put on a torus and transformed, it is the power of each wave of a
periodic field, which is drawn by one FFT (circulant embedding). Sources: Dietrich and Newsam (1997), SIAM J. Sci.
Comput. 18, 1088; Barnett, Magland and af Klinteberg (2019), SIAM J. Sci. Comput. 41, C479, for the sum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import fft2, fftshift, ifft2, ifftshift, next_fast_len

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Complexes, Floats
from sonarsynth.equations.noise.filters import kaiser_bessel, kaiser_bessel_beta, kaiser_bessel_transform

WIDTH, OVERSAMPLING, TABLE = 8, 2.0, 2048
"""Of the kernel of the sum: grid points that a wave goes to, how much finer the grid is than the lags need, and values
of the kernel from one grid point to the next."""
STEP = math.pi / OVERSAMPLING
"""rad: of the grid of phases of a `CovarianceMap`; phases of plane waves turn by 1 at most in each."""
MARGIN = WIDTH * STEP
"""rad: so far beyond its reach the waves of a map must stand for all directions."""


@dataclass(frozen=True, eq=False)
class CovarianceMap:
    """Covariance of plane waves at any lag up to a phase: values on a grid of phases that a kernel interpolates."""

    values: Complexes  # (2 n, 2 n), every STEP rad along y and z, from -n on

    @classmethod
    def of(cls, toward: Floats, weight: Floats, reach: float) -> CovarianceMap:
        """Of waves as `lag_covariance` has them; reach: largest phase (rad) along either axis, faces included."""
        beta, steps = kaiser_bessel_beta(WIDTH, OVERSAMPLING), int(np.ceil(reach / STEP)) + WIDTH
        spread = kaiser_bessel_transform(0.5 * STEP / np.pi * toward[:, 1:], WIDTH, beta).prod(axis=1)
        return cls(fftshift(lag_covariance(toward, weight / spread, (STEP, STEP), (steps, steps))))

    def at_lags(self, turn: float, face: float, lags: tuple[int, int]) -> Complexes:
        """Covariance (2 ly, 2 lz) of square faces at lags (ly, lz) of a lattice, -l to l - 1 in the order of an FFT;
        zero beyond the map.

        turn: phase in rad that a wave along y, or z, gains from sensor to sensor; face: the phase that it gains over a
        face. The mean over two faces is that over a triangle of lags in each axis; error 1e-5 of the power at a point.
        """
        node, weight = np.polynomial.legendre.leggauss(int(np.ceil(0.25 * face)) + 8)
        late, share = 0.5 * face * (1.0 + node), 0.25 * weight * (1.0 - node)
        late, share = np.concatenate([-late, late]) / STEP, np.concatenate([share, share])
        middle = 0.5 * len(self.values)
        y, z = (middle + turn / STEP * np.arange(-lag, lag, dtype=np.float64) for lag in lags)
        return np.asarray(ifftshift(_interpolated(self.values, y, z, late, share, _kernel())))


def lag_covariance(toward: Floats, weight: Floats, turn: tuple[float, float], lags: tuple[int, int]) -> Complexes:
    """Covariance (2 ly, 2 lz) at lags (ly, lz) of a lattice, -l to l - 1 in the order of an FFT.

    toward (wave, xyz): where plane waves come from, sonar frame; weight (wave,): their power at a point; turn: phase in
    rad that a wave along y, and along z, gains from sensor to sensor. The sum over waves of weight exp(i (m turn_y u_y
    + n turn_z u_z)); error 1e-5.
    """
    size = tuple(next_fast_len(int(np.ceil(2.0 * OVERSAMPLING * max(lag, WIDTH)))) for lag in lags)
    wide = np.zeros((size[0] + WIDTH, size[1] + WIDTH))
    _deposit(wide, toward, weight, *turn, _kernel())
    wide[:WIDTH] += wide[size[0] :]
    wide[:, :WIDTH] += wide[:, size[1] :]
    grid = wide[: size[0], : size[1]]
    beta = kaiser_bessel_beta(WIDTH, OVERSAMPLING)
    covariance = ifft2(grid, norm="forward")
    for axis, lag in enumerate(lags):
        lag_index = np.fft.fftfreq(2 * lag, 1.0 / (2 * lag)).astype(int)
        shape = kaiser_bessel_transform(lag_index / size[axis], WIDTH, beta)
        back = np.exp(-1j * np.pi * WIDTH * lag_index / size[axis]) / shape  # the grid is ahead
        covariance = covariance.take(lag_index, axis) * np.expand_dims(back, 1 - axis)
    return np.asarray(covariance)


@lru_cache(maxsize=1)
def _kernel() -> Floats:
    """The kernel (TABLE WIDTH/2 + 2,) at distances from 0 on."""
    distance = np.arange(TABLE * WIDTH // 2 + 2) / TABLE
    return kaiser_bessel(np.minimum(distance, 0.5 * WIDTH), WIDTH, kaiser_bessel_beta(WIDTH, OVERSAMPLING))


@compiled(fastmath=True)
def _deposit(grid: Floats, toward: Floats, weight: Floats, turn_y: float, turn_z: float, kernel: Floats) -> None:
    """Adds the powers of waves to a grid of their phases from sensor to sensor, WIDTH wider each way than its period
    and that much ahead by half a kernel."""
    ny, nz = grid.shape[0] - WIDTH, grid.shape[1] - WIDTH
    along_y, along_z = np.empty(WIDTH), np.empty(WIDTH)
    for n in range(weight.size):
        y = _spread(along_y, _on_circle(turn_y * toward[n, 1], ny), kernel) + WIDTH // 2
        z = _spread(along_z, _on_circle(turn_z * toward[n, 2], nz), kernel) + WIDTH // 2
        for i in range(WIDTH):
            scaled, row = weight[n] * along_y[i], grid[y + i]
            for j in range(WIDTH):
                row[z + j] += scaled * along_z[j]


@compiled(inline="always")
def _on_circle(phase: float, count: int) -> float:
    """A phase (rad) in steps of a circle of so many."""
    cycles = phase / (2.0 * math.pi)
    return (cycles - math.floor(cycles)) * count


@compiled(inline="always")
def _spread(values: Floats, position: float, kernel: Floats) -> int:
    """Values of the kernel about a place of a grid, and the point of the grid that is the first of them."""
    first = math.ceil(position - 0.5 * WIDTH)
    for j in range(WIDTH):
        far = abs(first + j - position) * TABLE
        cell = int(far)
        values[j] = kernel[cell] + (far - cell) * (kernel[cell + 1] - kernel[cell])
    return first


@compiled(fastmath=True)
def _interpolated(values: Complexes, y: Floats, z: Floats, late: Floats, share: Floats, kernel: Floats) -> Complexes:
    """Means (y, z) of a grid over places about each y and z, by their shares: of the grid's steps, all."""
    reach = math.ceil(late[-1]) + WIDTH // 2 + 1
    rows, columns = _gathering(y, late, share, kernel, reach), _gathering(z, late, share, kernel, reach)
    out = np.zeros((y.size, z.size), values.dtype)
    across = np.empty(values.shape[1], values.dtype)
    low, high = max(round(z.min()) - reach, 0), min(round(z.max()) + reach + 1, across.size)
    for m in range(y.size):
        first = round(y[m]) - reach
        if first < 0 or first + rows.shape[1] > values.shape[0]:
            continue
        across[:] = 0.0
        for i in range(rows.shape[1]):
            for j in range(low, high):
                across[j] += rows[m, i] * values[first + i, j]
        for n in range(z.size):
            begin = round(z[n]) - reach
            if begin >= 0 and begin + columns.shape[1] <= across.size:
                for j in range(columns.shape[1]):
                    out[m, n] += columns[n, j] * across[begin + j]
    return out


@compiled(inline="always")
def _gathering(places: Floats, late: Floats, share: Floats, kernel: Floats, reach: int) -> Floats:
    """Weights (place, 2 reach + 1) of the points of a grid about places: of means over places about each."""
    weights, values = np.zeros((places.size, 2 * reach + 1)), np.empty(WIDTH)
    for m in range(places.size):
        for q in range(late.size):
            first = _spread(values, places[m] + late[q], kernel) - round(places[m]) + reach
            for j in range(WIDTH):
                weights[m, first + j] += share[q] * values[j]
    return weights


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
