"""What delay of focusing a lattice takes in which beams, and what of it is left out.

A lattice is fast where the delay of focusing is a property of the sensor, not of the beam. W(u), the delay of a sphere
less that of the plane wave from the same direction u, changes with u. A zone of the picture takes it from its own
centre, and from there to each beam keeps what separates: the slope of W along z in each column, and its slope along y.
What is left falls as the square of the array, so a large one is cut into subarrays, each with slopes of its own about
its own middle.

A zone and its three mirror images share all sums if the delay is the same for the four mirrored sensors; it is that
part of W which is even in y and in z. What it leaves out, odd in both, grows with u_y u_z: near the axes of the picture
nothing else is needed. There a zone is `shared`, as wide as it is no worse than the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.receiver import Band, BeamGrid, Elements

COUNTS = (1, 2, 3, 4, 6, 8, 12, 16)
"""Numbers of subarrays along each axis that are tried."""

REACH = 0.6
"""Slopes are taken between this part of the half width of a subarray and its mirror image."""

Subarrays = tuple[int, int] | Literal["axis"]
"""How many across and up; `axis`: one, with the delay of the acoustic axis in all directions."""

EVEN, ODD = 20.0, 10.0
"""dB by which a phase of 1 rad2, and of 1 rad, changes beams 20 dB under the peak, about."""

WORTH = 3
"""A shared zone is taken if the picture is not more than so many times as wide: it is that much faster."""

CELLS = 14
"""Cells in each direction into which a larger array is gathered for estimates."""


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

    def even(self, y: Floats, z: Floats, u: Floats) -> Floats:
        """The part of W that is even in y and in z."""
        return 0.25 * (self.bulge(y, z, u) + self.bulge(-y, z, u) + self.bulge(y, -z, u) + self.bulge(-y, -z, u))

    def slope_along_z(self, y: Floats, z: Floats, u: Floats, centre: Floats) -> Floats:
        """Slope along z (s/m) of W(u) - W(centre) at y, about z (...) m."""
        upper, lower = (self.bulge(y, z + h, u) - self.bulge(y, z + h, centre) for h in _both(self.half_height))
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
class ArrayMoments:
    """An array and a band, as far as estimates need them."""

    y: Floats  # (cell,) m
    z: Floats  # (cell,) m
    weight: Floats  # (cell,) of sum one
    angular: float  # rad/s: root mean square over the band of 2 pi f


@dataclass(frozen=True, eq=False)
class Zone:
    """Columns of the quadrant of a beam grid above and to port; their mirror images go with them."""

    near: int  # first of its columns, counted from the middle of the grid
    far: int  # the column after its last
    centre: Floats  # (yz): direction that it is focused on
    shared: bool  # whether it and its mirror images take the same delays
    axial: bool = False  # whether it takes those of the acoustic axis, and no slopes

    def sines(self, glass: Lens, elevation: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
        """Of a shared zone: sines of elevation (...) and azimuth (...) whose plane wave has the slopes of W as well."""
        if self.axial:
            return np.sin(elevation), np.sin(azimuth)
        middle = np.sqrt(1.0 - self.centre[1] ** 2)
        on_axis = np.zeros(2)

        def raised(sine: Floats) -> Floats:
            u = np.stack(np.broadcast_arrays(self.centre[0], sine), axis=-1)
            y, z = np.asarray(glass.half_width), np.zeros(())
            slope = glass.slope_along_z(y, z, u, on_axis) + glass.slope_along_z(-y, z, u, on_axis)
            return np.asarray(sine - 0.5 * glass.sound_speed * slope)

        u = np.stack(np.broadcast_arrays(middle * np.sin(azimuth), self.centre[1]), axis=-1)
        across = u[..., 0] - glass.sound_speed * glass.slope_along_y(np.zeros(()), np.zeros(()), u, on_axis)
        return raised(np.sin(elevation)), across / np.sqrt(1.0 - raised(self.centre[1]) ** 2)

    def left_out(self, glass: Lens, y: Floats, z: Floats, u: Floats) -> Floats:
        """Delay (beam, sensor) in s left out at y, z (sensor,) m of beams of directions u (beam, yz) of the zone."""
        exact = glass.bulge(y, z, u[:, None, :])
        if self.axial:
            return exact - glass.bulge(y, z, self.centre)
        if self.shared:
            elevation = np.arcsin(u[:, 1])
            up, port = self.sines(glass, elevation, np.arcsin(u[:, 0] / np.cos(elevation)))
            modelled = y * (u[:, 0] - np.sqrt(1.0 - up * up) * port)[:, None] + z * (u[:, 1] - up)[:, None]
            return exact - glass.even(y, z, self.centre) - modelled / glass.sound_speed
        u = u[:, None, :]
        level = np.stack(np.broadcast_arrays(self.centre[0], u[..., 1]), axis=-1)
        middle_y, middle_z = glass.middle(y, z)
        middle = glass.bulge(middle_y, middle_z, u) - glass.bulge(middle_y, middle_z, self.centre)
        rise = (z - middle_z) * glass.slope_along_z(y, middle_z, level, self.centre)
        across = (y - middle_y) * glass.slope_along_y(middle_y, middle_z, u, self.centre)
        return np.asarray(exact - glass.bulge(y, z, self.centre) - middle - rise - across)

    def estimate(self, glass: Lens, moments: ArrayMoments, u: Floats) -> float:
        """About how much (dB) what is left out changes beams u (beam, yz) of the zone within 20 dB of the peak.

        A phase that is even over the array changes energy by its square, an odd one, which shifts beams, in proportion.
        """
        y, z = (np.concatenate([q, -q]) for q in (moments.y, moments.z))
        direct, mirrored = np.split(self.left_out(glass, y, z, u), 2, axis=1)
        even, odd = 0.5 * moments.angular * (direct + mirrored), 0.5 * moments.angular * (direct - mirrored)
        variance = np.square(even) @ moments.weight - np.square(even @ moments.weight)
        return float(np.max(EVEN * variance + ODD * np.sqrt(np.square(odd) @ moments.weight)))


def lens(elements: Elements, focus: float | None, sound_speed: float, subarrays: Subarrays) -> Lens:
    """The lens of a lattice that is cut into subarrays; focus in m, None for plane waves."""
    across, up = (1, 1) if subarrays == "axis" else subarrays
    focus = np.inf if focus is None else focus
    return Lens(focus, sound_speed, elements.pitch, elements.columns, elements.rows, across, up)


def cuts(elements: Elements, focus: float | None) -> list[Subarrays]:
    """Ways to cut a lattice that are tried, the fewest subarrays first; one for plane waves."""
    if focus is None:
        return ["axis"]
    square = ((min(n, elements.columns), min(n, elements.rows)) for n in COUNTS)
    return ["axis", *dict.fromkeys(square)]


def for_sensors(elements: Elements, weight: Floats, band: Band) -> ArrayMoments:
    """The array with its weights (sensor,), neighbours on the lattice gathered into cells, and the band."""
    places = [elements.row // -(-elements.rows // CELLS), elements.column // -(-elements.columns // CELLS)]
    cell = np.unique(np.stack(places)[:, weight > 0], axis=1, return_inverse=True)[1].ravel()
    live, position = weight[weight > 0], elements.position[weight > 0]
    total = np.asarray(np.bincount(cell, live), float)
    y, z = (np.bincount(cell, live * position[:, axis]) / total for axis in (1, 2))
    squares = (band.low**2 + band.low * band.high + band.high**2) / 3.0
    return ArrayMoments(y, z, total, 2.0 * np.pi * float(np.sqrt(squares)))


def quadrant(beams: BeamGrid) -> Floats:
    """Directions (row, column, yz) of the beams above and to port, from the middle outwards."""
    elevation, azimuth = beams.elevation[beams.elevations // 2 :], beams.azimuth[beams.azimuths // 2 :]
    across = np.cos(elevation)[:, None] * np.sin(azimuth)
    return np.stack(np.broadcast_arrays(across, np.sin(elevation)[:, None]), axis=-1)


def zones_of(glass: Lens, moments: ArrayMoments, beams: BeamGrid, subarrays: Subarrays) -> list[Zone]:
    """The zones of a beam grid for an array cut into subarrays.

    By the axis: one. One subarray: a shared zone in the middle, all rows high and as wide as may be for what it leaves
    out (as `Zone.estimate` has it) not to be more than at the edges of the picture; and the rest. More: all of the
    picture.
    """
    u = quadrant(beams)
    wide = u.shape[1]
    if subarrays == "axis":
        return [Zone(0, wide, np.zeros(2), True, True)]
    whole = _zone(u, 0, wide, False)
    if subarrays != (1, 1):
        return [whole]

    def estimate(zone: Zone) -> float:
        ends = u[[0, -1]][:, [zone.near, zone.far - 1]]
        return zone.estimate(glass, moments, ends.reshape(-1, 2))

    worst = max(estimate(whole), estimate(_zone(u, wide - 1, wide, False)))
    good, bad = 0, wide + 1
    while bad - good > 1:
        far = (good + bad) // 2
        good, bad = (far, bad) if estimate(_zone(u, 0, far, True)) <= worst else (good, far)
    if WORTH * good < wide:
        return [whole]
    return [_zone(u, 0, good, True), *([_zone(u, good, wide, False)] if good < wide else [])]


def _zone(u: Floats, near: int, far: int, shared: bool) -> Zone:
    directions = u[:, near:far].reshape(-1, 2)
    centre = 0.5 * (directions.min(axis=0) + directions.max(axis=0))
    return Zone(near, far, centre, shared)
