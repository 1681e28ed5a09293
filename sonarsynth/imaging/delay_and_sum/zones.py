"""Zones of a picture that are focused each on its own centre: where they lie, and what delay is left out in each.

A lattice is fast where the delay of focusing is a property of the sensor, not of the beam. W(u), the delay of a sphere
less that of the plane wave from the same direction u, changes with u; a zone takes it from its own centre, and from
there to each beam keeps what separates: the slope of W along z in each column, and its slope along y.

A zone and its three mirror images share all sums if the delay is the same for the four mirrored sensors; it is that
part of W which is even in y and in z. What it leaves out, odd in both, grows with u_y u_z: near the axes of the picture
nothing else is needed. A zone is `shared` where this is no worse than the worst zone of the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.receiver import Band, BeamGrid, Elements

REACH = 0.6
"""Slopes are taken between this part of the half width of the array and its mirror image."""

EVEN, ODD = 20.0, 10.0
"""dB by which a phase of 1 rad2, and of 1 rad, changes beams 20 dB under the peak, about."""

BANDS = 2.0 / 3.0
"""Bands of rows are cut at this power of 0 to 1: with u_z^2 more is left out, and less may be near the middle."""

WORTH = 3
"""A shared zone is taken if another would not be more than so many times as wide: it is that much faster."""

CELLS = 14
"""Cells in each direction into which a larger array is gathered for estimates."""


@dataclass(frozen=True, eq=False)
class Lens:
    """What focuses an array: where, at what sound speed, and at which heights slopes are taken."""

    focus: float  # m
    sound_speed: float  # m/s
    half_width: float  # m
    half_height: float  # m

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

    def slope_along_z(self, y: Floats, u: Floats, centre: Floats) -> Floats:
        """Slope along z (s/m) at y of W(u) - W(centre)."""
        z = np.asarray(self.half_height)
        rise = self.bulge(y, z, u) - self.bulge(y, z, centre) - self.bulge(y, -z, u) + self.bulge(y, -z, centre)
        return 0.5 * rise / self.half_height

    def slope_along_y(self, u: Floats, centre: Floats) -> Floats:
        """Slope along y (s/m) of W(u) - W(centre), the mean of those above and below the middle."""
        y, slope = np.asarray(self.half_width), np.zeros(())
        for z in (np.asarray(self.half_height), np.asarray(-self.half_height)):
            rise = self.bulge(y, z, u) - self.bulge(y, z, centre) - self.bulge(-y, z, u) + self.bulge(-y, z, centre)
            slope = slope + 0.25 * rise / self.half_width
        return slope


@dataclass(frozen=True, eq=False)
class ArrayMoments:
    """An array and a band, as far as estimates need them."""

    y: Floats  # (cell,) m
    z: Floats  # (cell,) m
    weight: Floats  # (cell,) of sum one
    angular: float  # rad/s: root mean square over the band of 2 pi f


@dataclass(frozen=True, eq=False)
class Zone:
    """A rectangle of the quadrant of a beam grid above and to port; its mirror images go with it."""

    low: int  # first of its rows, counted from the middle of the grid
    high: int  # the row after its last
    near: int  # first of its columns, likewise
    far: int
    centre: Floats  # (yz): direction that it is focused on
    shared: bool  # whether it and its mirror images take the same delays
    axial: bool = False  # whether it takes those of the acoustic axis, and no slopes

    def sines(self, glass: Lens, elevation: Floats, azimuth: Floats) -> tuple[Floats, Floats]:
        """Of a shared zone: sines of elevation (...) and azimuth (...) whose plane wave has the slopes of W as well."""
        middle = np.sqrt(1.0 - self.centre[1] ** 2)
        on_axis = np.zeros(2)

        def raised(sine: Floats) -> Floats:
            u = np.stack(np.broadcast_arrays(self.centre[0], sine), axis=-1)
            y = np.asarray(glass.half_width)
            slope = glass.slope_along_z(y, u, on_axis) + glass.slope_along_z(-y, u, on_axis)
            return np.asarray(sine - 0.5 * glass.sound_speed * slope)

        u = np.stack(np.broadcast_arrays(middle * np.sin(azimuth), self.centre[1]), axis=-1)
        across = u[..., 0] - glass.sound_speed * glass.slope_along_y(u, on_axis)
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
        modelled = glass.bulge(y, z, self.centre) + z * glass.slope_along_z(y, level, self.centre)
        return exact - modelled - y * glass.slope_along_y(u, level)

    def variances(self, glass: Lens, moments: ArrayMoments, u: Floats) -> tuple[Floats, Floats]:
        """Variance over the array (beam,) in rad2 of what is left out in beams u (beam, yz): even and odd part."""
        y, z = (np.concatenate([q, -q]) for q in (moments.y, moments.z))
        direct, mirrored = np.split(self.left_out(glass, y, z, u), 2, axis=1)
        even, odd = 0.5 * moments.angular * (direct + mirrored), 0.5 * moments.angular * (direct - mirrored)
        return np.square(even) @ moments.weight - np.square(even @ moments.weight), np.square(odd) @ moments.weight

    def estimate(self, glass: Lens, moments: ArrayMoments, u: Floats) -> float:
        """About how much (dB) what is left out changes beams u (beam, yz) of the zone within 20 dB of the peak.

        A phase that is even over the array changes energy by its square, an odd one, which shifts beams, in proportion.
        """
        even, odd = self.variances(glass, moments, u)
        return float(np.max(EVEN * even + ODD * np.sqrt(odd)))


def corners(zone: Zone) -> list[tuple[int, int]]:
    """Row and column of the beams in the corners of a zone, from the middle outwards."""
    return [(row, column) for row in {zone.low, zone.high - 1} for column in {zone.near, zone.far - 1}]


def lens(elements: Elements, focus: float, sound_speed: float) -> Lens:
    """The lens of a lattice."""
    reach = 0.5 * REACH * elements.pitch
    return Lens(focus, sound_speed, reach * elements.columns, reach * elements.rows)


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


def zones_of(glass: Lens, moments: ArrayMoments, beams: BeamGrid, zones: int) -> list[Zone]:
    """The zones of a beam grid: `zones` across where most is left out, at its upper and lower edge.

    There are half as many bands of rows, narrower away from the middle. From the middle outwards each zone of a band is
    as wide as may be for what it leaves out (as `Zone.estimate` has it) not to be more than in the worst of that many
    zones in the band at the edge. One zone: that of the acoustic axis.
    """
    u = quadrant(beams)
    if zones == 1:
        return [Zone(0, u.shape[0], 0, u.shape[1], np.zeros(2), True, True)]
    count = zones // 2
    bands = _parts(beams.elevation[beams.elevations // 2 :], (np.arange(1, count) / count) ** BANDS)
    azimuths = _parts(beams.azimuth[beams.azimuths // 2 :], np.arange(2 - zones % 2, zones, 2) / zones)

    def estimate(zone: Zone) -> float:
        rows, columns = zip(*corners(zone), strict=True)
        return zone.estimate(glass, moments, u[list(rows), list(columns)])

    def widest(low: int, high: int, near: int, shared: bool) -> Zone | None:
        chosen, stop = None, u.shape[1] + 1
        far = u.shape[1]
        while far > (chosen.far if chosen else near):
            zone = _zone(u, low, high, near, far, shared)
            if estimate(zone) <= worst:
                chosen = zone
            else:
                stop = far
            far = ((chosen.far if chosen else near) + stop) // 2
        return chosen

    edge = [_zone(u, *bands[-1], *span, False) for span in azimuths]
    columns = [_zone(u, *band, u.shape[1] - 1, u.shape[1], False) for band in bands]
    worst = max(estimate(zone) for zone in edge + columns)
    tiling: list[Zone] = []
    for low, high in bands:
        near = 0
        while near < u.shape[1]:
            shared, zone = widest(low, high, near, True), widest(low, high, near, False)
            if shared is not None and (zone is None or WORTH * (shared.far - near) >= zone.far - near):
                zone = shared
            tiling.append(zone or _zone(u, low, high, near, near + 1, False))
            near = tiling[-1].far
    return tiling


def _zone(u: Floats, low: int, high: int, near: int, far: int, shared: bool) -> Zone:
    directions = u[low:high, near:far].reshape(-1, 2)
    return Zone(low, high, near, far, 0.5 * (directions.min(axis=0) + directions.max(axis=0)), shared)


def _parts(angles: Floats, edges: Floats) -> list[tuple[int, int]]:
    """Parts of `angles` (count,) >= 0, cut at `edges` (...) 0 to 1 of the largest: first, and one after the last."""
    cut = sorted({0, *(int(i) for i in np.searchsorted(angles, edges * angles[-1])), len(angles)})
    return list(pairwise(cut))
