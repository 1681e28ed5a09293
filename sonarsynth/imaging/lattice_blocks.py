"""Equal square blocks of a lattice, shifted against each other: at each frequency a window gives a snapshot of each.

Sensor p of every block stands at q_p from the middle of its block, so a plane wave from u has the phases
a_p = exp(i k u.q_p) in all of them, and a^H M a = sum over lags of (the sum of M along that lag) times a phase.
Source: spatial smoothing, forward and backward: Shan, Wax & Kailath (1985), IEEE Trans. ASSP 33, 806; Pillai & Kwon
(1989), IEEE Trans. ASSP 37, 8.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from sonarsynth.conventions import Complexes, Floats, Ints
from sonarsynth.receiver import BeamGrid, Elements


@dataclass(frozen=True, eq=False)
class Subarrays:
    """The blocks of a lattice in which every sensor is live."""

    rows: int  # of a block
    columns: int
    pitch: float  # m
    members: Ints  # (block, sensor of a block) sensors, row by row
    centre: Floats  # (block, xyz) m
    offset: Floats  # (sensor of a block, xyz) m from the middle of its block

    @cached_property
    def lag(self) -> Ints:
        """Lag of each pair (p, q) of sensors of a block, flat: rows, then columns, each from minus its most."""
        row, column = np.divmod(np.arange(self.rows * self.columns), self.columns)
        along_z = row[:, None] - row + self.rows - 1
        return np.asarray(along_z * (2 * self.columns - 1) + column[:, None] - column + self.columns - 1).ravel()

    def covariance(self, spectrum: Complexes) -> Complexes:
        """Covariance (sensor, sensor) of a block, forward and backward, of a spectrum (all sensors,)."""
        snapshots = spectrum[self.members]
        forward = snapshots.T @ snapshots.conj() / len(snapshots)
        return np.asarray(0.5 * (forward + forward[::-1, ::-1].conj()))

    def forms(self, matrix: Complexes, wavenumber: float, beams: BeamGrid) -> Floats:
        """a^H M a (elevation, azimuth) of a Hermitian matrix M (sensor, sensor); wavenumber in rad/m."""
        shape = 2 * self.rows - 1, 2 * self.columns - 1
        flat = matrix.ravel()
        count = shape[0] * shape[1]
        sums = np.bincount(self.lag, flat.real, count) + 1j * np.bincount(self.lag, flat.imag, count)
        step = 1j * wavenumber * self.pitch
        up = np.exp(step * np.sin(beams.elevation)[:, None] * np.arange(1 - self.rows, self.rows))
        by_column = (up @ sums.reshape(shape))[:, self.columns - 1 :]
        turn = np.exp(step * np.cos(beams.elevation)[:, None] * np.sin(beams.azimuth))
        total = np.zeros(turn.shape, complex)
        for coefficient in by_column[:, :0:-1].T:  # a polynomial in the turn, by Horner's rule
            total = (total + coefficient[:, None]) * turn
        return np.asarray(by_column[:, :1].real + 2.0 * total.real)

    def snapshots(self, spectrum: Complexes, wavenumber: float, direction: Floats) -> Complexes:
        """Mean over blocks of their spectra (beam, sensor of a block), each delayed for `direction` (beam, xyz)."""
        shift = np.exp(-1j * wavenumber * (direction @ self.centre.T))
        return np.asarray(shift @ spectrum[self.members] / len(self.members))


@lru_cache(maxsize=16)
def subarrays(elements: Elements, limit: int) -> Subarrays | None:
    """The largest blocks of at most `limit` by `limit` sensors of which there are half as many as sensors in a block:
    as many snapshots, forward and backward, as they have sensors. None where there are none."""
    if not elements.on_lattice:
        return None
    sensor = np.full((elements.rows, elements.columns), -1)
    live = np.flatnonzero(elements.gain)
    sensor[elements.row[live], elements.column[live]] = live
    for n in range(limit, 1, -1):
        rows, columns = min(n, elements.rows), min(n, elements.columns)
        blocks = np.lib.stride_tricks.sliding_window_view(sensor, (rows, columns)).reshape(-1, rows * columns)
        members = blocks[(blocks >= 0).all(axis=1)]
        if rows * columns > 1 and 2 * len(members) >= rows * columns:
            centre = elements.position[members].mean(axis=1)
            return Subarrays(rows, columns, elements.pitch, members, centre, elements.position[members[0]] - centre[0])
    return None
