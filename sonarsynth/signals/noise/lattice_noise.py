"""Noise of given directions on a lattice of hydrophones: a periodic field, drawn bin by bin by one FFT."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
from scipy.fft import fft2, ifft2, next_fast_len

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.environment.noise.directions import NoiseDirections
from sonarsynth.equations.noise.complex_normals import complex_normals
from sonarsynth.equations.noise.lattice_coherence import MARGIN, CovarianceMap, periodic_powers
from sonarsynth.equations.noise.wave_directions import quadrature
from sonarsynth.receiver import Elements

TORUS = (1.0, 1.15, 1.4)
"""Sizes of the torus that are tried, over twice that of the lattice: the first that errs little enough is taken."""
GOOD, FAIR = 5e-3, 0.05
"""Error of coherence that is little enough; and the largest that is put up with."""
ROUNDS = 10
STEP = 0.75
"""rad: how much the phase over the lattice may change from one frequency that is worked out to the next."""
POWERS = 1 << 28
"""Largest number of powers that are kept."""
BLOCK = 1 << 16
"""Waves that are drawn at once."""
Complexes64 = npt.NDArray[np.complex64]


@dataclass(frozen=True)
class Lattice:
    """A lattice as noise hears it."""

    places: tuple[tuple[int, int], ...]  # of sensors along y and z
    pitch: float  # m
    face: float  # m
    up: tuple[float, float, float]  # of the world, sonar frame
    sound_speed: float  # m/s
    behind: float  # what is left of the pressure of waves from behind

    @cached_property
    def size(self) -> tuple[int, int]:
        """Places along y and z."""
        y, z = np.max(self.places, axis=0).tolist()
        return y + 1, z + 1

    def used(self, lags: tuple[int, int]) -> Bools:
        """Which lags (2 ly, 2 lz), in the order of an FFT, there are between its sensors."""
        occupied = np.zeros((2 * lags[0], 2 * lags[1]))
        occupied[tuple(np.transpose(self.places))] = 1.0
        return np.asarray(ifft2(np.abs(fft2(occupied)) ** 2).real > 0.5)

    @cached_property
    def extent(self) -> float:
        """Longest distance of two sensors (m)."""
        ly, lz = self.size
        y, z = np.nonzero(self.used(self.size))
        return self.pitch * float(np.hypot(np.minimum(y, 2 * ly - y), np.minimum(z, 2 * lz - z)).max())


@dataclass(frozen=True, eq=False)
class PeriodicField:
    """Powers of the waves of a periodic field, and what its coherence errs by on the lattice."""

    frequency: Floats  # (knot,) Hz, evenly spaced
    powers: npt.NDArray[np.float32]  # (knot, ny, nz), of noise of 1 Pa2/Hz at a point
    error: float


def lattice_of(elements: Elements, up: Floats, sound_speed: float, behind: float = 1.0) -> Lattice:
    """The lattice of elements that are on one; up (xyz): unit vector of the world's z, sonar frame."""
    y, z = elements.columns - 1 - elements.column, elements.rows - 1 - elements.row  # rise with y and z
    places = tuple(zip(y.tolist(), z.tolist(), strict=True))
    ux, uy, uz = np.round(up, 9).tolist()
    return Lattice(places, elements.pitch, elements.face, (ux, uy, uz), sound_speed, behind)


@lru_cache(maxsize=4)
def periodic_field(directions: NoiseDirections, lattice: Lattice, low: float, high: float) -> PeriodicField | None:
    """The field over a band (Hz); None where no periodic field is near enough, or it takes too much memory."""
    step = STEP * lattice.sound_speed / (2.0 * np.pi * max(lattice.extent, lattice.pitch))
    knots = np.linspace(low, high, 2 + int((high - low) / step))
    sampled = knots[:: max(1, (knots.size - 1) // 3)]
    for more in TORUS:
        lags = _lags(lattice, more)
        error = _powers(directions, lattice, sampled, lags)[1]
        if error < GOOD:
            break
    if knots.size * 4 * lags[0] * lags[1] > POWERS or error > FAIR:
        return None
    powers, error = _powers(directions, lattice, knots, lags)
    return PeriodicField(knots, powers, error) if error <= FAIR else None


def _lags(lattice: Lattice, more: float) -> tuple[int, int]:
    ny, nz = (next_fast_len(int(np.ceil(more * max(n, 2)))) for n in lattice.size)
    return ny, nz


def _powers(
    directions: NoiseDirections, lattice: Lattice, frequency: Floats, lags: tuple[int, int]
) -> tuple[npt.NDArray[np.float32], float]:
    """Powers (bin, 2 ly, 2 lz) of a periodic field, and the largest error of its coherence."""
    used = lattice.used(lags)
    away = np.hypot(*np.meshgrid(*(np.fft.fftfreq(2 * lag, 0.5 / lag) for lag in lags), indexing="ij")) * lattice.pitch
    powers, worst = np.empty((frequency.size, *used.shape), np.float32), 0.0
    reach = max(lattice.extent, lattice.pitch * min(lags))
    wave_numbers = 2.0 * np.pi * frequency / lattice.sound_speed
    covariances = _covariances(directions, lattice, float(wave_numbers.max() * (reach + lattice.face)))
    for n, k in enumerate(wave_numbers.tolist()):
        covariance = covariances.at_lags(k * lattice.pitch, k * lattice.face, lags)
        spectrum, error = periodic_powers(np.where(away <= reach, covariance, 0.0), used, ROUNDS)
        powers[n], worst = spectrum, max(worst, error)
    return powers, worst


@lru_cache(maxsize=2)
def _covariances(directions: NoiseDirections, lattice: Lattice, reach: float) -> CovarianceMap:
    """Covariances of noise as the sonar hears it, up to a phase of `reach` (rad) from sensor to sensor."""
    half = abs(lattice.up[0]) < 1e-9  # what comes from behind is as what comes from before
    toward, weight = quadrature(directions.intensity, directions.edges, reach + MARGIN, half)
    toward = toward @ _turn(np.array(lattice.up))
    back = 0.5 if half else toward[:, 0] < 0.0
    return CovarianceMap.of(toward, weight * (1.0 - back * (1.0 - lattice.behind**2)), reach)


def _turn(up: Floats) -> Floats:
    """Matrix (3, 3): row vectors of a world without north, times it, are those of the sonar frame."""
    across = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(up, across), up])


def draw(field: PeriodicField, elements: Elements, frequency: Floats, random: np.random.Generator) -> Complexes64:
    """Spectra (sensor, bin) at frequencies (bin,) Hz: of noise of 1 Pa2/Hz at a point, the power of the real part and
    that of the imaginary part are the sensor's own share, 1 at most."""
    knots, powers = field.frequency, field.powers
    position = np.clip((frequency - knots[0]) / (knots[1] - knots[0]), 0.0, knots.size - 1.000001)
    low = position.astype(int)
    fraction = (position - low).astype(np.float32)[:, None, None]
    out = np.empty((elements.count, frequency.size), np.complex64)
    y, z = elements.columns - 1 - elements.column, elements.rows - 1 - elements.row  # y and z rise with them
    along_y, along_z = (_fourier(n, size) for n, size in zip(powers.shape[1:], (y, z), strict=True))
    many = max(1, BLOCK // powers[0].size)
    for first in range(0, frequency.size, many):
        bins = slice(first, first + many)
        below = powers[low[bins]]
        power = below + fraction[bins] * (powers[low[bins] + 1] - below)
        near = along_y @ (complex_normals(power, random).reshape(-1, power.shape[2]) @ along_z.T).reshape(
            power.shape[:2] + along_z.shape[:1]
        )
        out[:, bins] = near[:, y, z].T
    return out


def _fourier(waves: int, places: Ints) -> Complexes64:
    """Matrix (place, wave) of the sum of waves, of unit columns over all places that an FFT would make."""
    turns = np.outer(np.arange(places.max() + 1), np.arange(waves)) % waves
    return np.exp(2j * np.pi / waves * turns).astype(np.complex64) / np.float32(np.sqrt(waves))
