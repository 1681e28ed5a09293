"""What delay of focusing a lattice takes in which beams.

A lattice is fast where the delay of focusing is a property of the sensor, not of the beam. W(u), the delay of a sphere
less that of the plane wave from the same direction u, changes with u. A zone, half of what is to port and its mirror
images, takes of its own centre what is as much above as below the middle of the array, and of each beam what separates:
the slope of W along z in each column, and from the centre on its slope along y. What is left falls as the square of the
array, so a large one is cut into subarrays, each with slopes of its own about its own middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.receiver import BeamGrid, Elements

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16)
"""Numbers of subarrays along each axis that are tried."""

REACH = 0.6
"""Slopes are taken between this part of the half width of a subarray and its mirror image."""

Subarrays = tuple[int, int]
"""How many across and up."""


@dataclass(frozen=True, eq=False)
class Lens:
    """What focuses a lattice: where, at what sound speed, and in which subarrays."""

    focus: float  # m, infinite for plane waves
    sound_speed: float  # m/s
    pitch: float  # m
    columns: int  # of the lattice
    rows: int
    across: int  # subarrays along y
    up: int  # and along z

    @property
    def subarray_columns(self) -> int:
        """Columns of a subarray; the last may lack some."""
        return -(-self.columns // self.across)

    @property
    def subarray_rows(self) -> int:
        """Rows of a subarray."""
        return -(-self.rows // self.up)

    @property
    def half_width(self) -> float:
        """Distance (m) along y from the middle of a subarray at which slopes are taken."""
        return 0.5 * REACH * self.pitch * self.subarray_columns

    @property
    def half_height(self) -> float:
        """The same along z."""
        return 0.5 * REACH * self.pitch * self.subarray_rows

    def middle(self, y: Floats, z: Floats) -> tuple[Floats, Floats]:
        """y and z (...) in m of the middle of the subarray of sensors at y, z (...) m."""

        def middle(place: Floats, count: int, step: int, last: int) -> Floats:
            part = np.floor((0.5 * count - place / self.pitch) / step)  # counted as columns and rows are: from above
            return np.asarray(0.5 * self.pitch * (count - step - 2 * step * np.clip(part, 0, last)))

        across = middle(y, self.columns, self.subarray_columns, self.across - 1)
        return across, middle(z, self.rows, self.subarray_rows, self.up - 1)

    def bulge(self, y: Floats, z: Floats, u: Floats) -> Floats:
        """W (...) in s at y, z (...) m for directions u (..., yz): the delay of a sphere less that of a plane wave.

        c W = (q^2 - s^2)/(sqrt(R^2 - 2 R s + q^2) + R - s), s = u.q: no difference of two large numbers.
        """
        along = u[..., 0] * y + u[..., 1] * z
        square = y * y + z * z
        distance = np.sqrt(np.maximum(self.focus * (self.focus - 2.0 * along) + square, 0.0))
        return np.asarray((square - along * along) / ((distance + self.focus - along) * self.sound_speed))

    def even_bulge(self, y: Floats, z: Floats, off: Floats, u: Floats) -> Floats:
        """The mean of W (...) in s for u (..., yz) at y, at `off` (...) m above and below z."""
        return np.asarray(0.5 * (self.bulge(y, z + off, u) + self.bulge(y, z - off, u)))

    def slope_along_z(self, y: Floats, z: Floats, u: Floats) -> Floats:
        """Slope along z (s/m) of W(u) at y, about z (...) m."""
        upper, lower = (self.bulge(y, z + h, u) for h in _both(self.half_height))
        return np.asarray(0.5 * (upper - lower) / self.half_height)

    def slope_along_y(self, y: Floats, z: Floats, u: Floats, centre: Floats) -> Floats:
        """Slope along y (s/m) of W(u) - W(centre) about y, the mean of those above and below z (...) m."""
        slope = np.zeros(())
        for h in _both(self.half_height):
            port, starboard = (
                self.bulge(y + w, z + h, u) - self.bulge(y + w, z + h, centre) for w in _both(self.half_width)
            )
            slope = slope + 0.25 * (port - starboard) / self.half_width
        return slope


def _both(distance: float) -> tuple[float, float]:
    return distance, -distance


@dataclass(frozen=True, eq=False)
class Zone:
    """Columns of the quadrant of a beam grid above and to port; their mirror images go with them."""

    columns: slice  # counted from the middle of the grid
    centre: Floats  # (yz): direction that it is focused on


def lens(elements: Elements, focus: float | None, sound_speed: float, subarrays: Subarrays) -> Lens:
    """The lens of a lattice that is cut into subarrays; focus in m, None for plane waves."""
    focus = np.inf if focus is None else focus
    return Lens(focus, sound_speed, elements.pitch, elements.columns, elements.rows, *subarrays)


def cuts(elements: Elements, focus: float | None) -> list[Subarrays]:
    """Ways to cut a lattice that are tried, the fewest subarrays first; one for plane waves."""
    counts = COUNTS if focus is not None else COUNTS[:1]
    return list(dict.fromkeys((min(n, elements.columns), min(n, elements.rows)) for n in counts))


def quadrant(beams: BeamGrid) -> Floats:
    """Directions (row, column, yz) of the beams above and to port, from the middle outwards."""
    elevation, azimuth = beams.elevation[beams.elevations // 2 :], beams.azimuth[beams.azimuths // 2 :]
    across = np.cos(elevation)[:, None] * np.sin(azimuth)
    return np.stack(np.broadcast_arrays(across, np.sin(elevation)[:, None]), axis=-1)


def zones_of(beams: BeamGrid) -> list[Zone]:
    """The two zones of a beam grid; one where it has a single column to port."""
    u = quadrant(beams)
    ends = sorted({0, u.shape[1] // 2, u.shape[1]})
    return [_zone(u, slice(near, far)) for near, far in pairwise(ends)]


def _zone(u: Floats, columns: slice) -> Zone:
    directions = u[:, columns].reshape(-1, 2)
    return Zone(columns, 0.5 * (directions.min(axis=0) + directions.max(axis=0)))
