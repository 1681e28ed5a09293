"""Motion along a track in a file: a ship by GPS, a vehicle by its navigation."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
from annotated_types import Ge, Le

from sonarsynth.conventions import Floats, Latitude, NonNegativeMetres, Position, Radians, Seconds
from sonarsynth.description import description, named_files
from sonarsynth.geometry import Pose, quaternion
from sonarsynth.geometry.track_files import TrackError, TrackTable, read_track

EQUATOR: Final = 6_378_137.0
"""m: semi-major axis of WGS 84."""
ECCENTRICITY_SQUARED: Final = 6.694_379_990_14e-3
FARTHEST: Final = 100e3
"""m from the origin: there the plane is 4 m short, and the sea, which is level here, curves 785 m away from it."""


def east_north(latitude: Floats, longitude: Floats, origin: tuple[float, float]) -> Floats:
    """Metres (point, 2) east and north of an origin (latitude, longitude); all in rad, on the ellipsoid of WGS 84.

    Exact on the tangent plane; distances along the ground are longer by d^3/(6 R^2): 4 mm at 10 km. Source: Torge and
    Mueller (2012), Geodesy, 4th ed., sections 4.1 (ellipsoid) and 4.3 (local axes).
    """
    phi, lam = np.asarray(latitude, float), np.asarray(longitude, float)
    point, centre = (_from_centre(np.asarray(a), np.asarray(b)) for a, b in ((phi, lam), origin))
    away = point - centre
    (sp, cp), (sl, cl) = ((np.sin(angle), np.cos(angle)) for angle in origin)
    east = away @ np.array([-sl, cl, 0.0])
    north = away @ np.array([-sp * cl, -sp * sl, cp])
    return np.stack([east, north], axis=-1)


def _from_centre(phi: Floats, lam: Floats) -> Floats:
    """Places (..., 3) m from the centre of the Earth, on the ellipsoid."""
    across = EQUATOR / np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(phi) ** 2)  # radius of curvature, prime vertical
    flat = across * np.cos(phi)
    return np.stack(
        [flat * np.cos(lam), flat * np.sin(lam), (1.0 - ECCENTRICITY_SQUARED) * across * np.sin(phi)], axis=-1
    )


AT_REST = 1e-3
"""m/s: slower than this a body has no course, and keeps the one that it had."""

Longitude = Annotated[Radians, Ge(-2 * np.pi), Le(2 * np.pi)]


@description
class RecordedTrack:
    """Along the points of a file, CSV or GPX: a curve through them of continuous velocity (Akima's, modified), at rest
    from a point to the next where that is the same place.

    Columns: time, and x and y (with z or depth) or latitude and longitude (with depth). Heading, pitch and roll as the
    file has them; a heading that it lacks is along the velocity.
    """

    kind: Literal["track"] = "track"
    path: str
    """Path of the file, relative to the recipe."""
    start: Literal["first"] | Seconds = "first"
    """Time of the file that is time 0 of the motions; `first`: that of its first point. Dates are s since 1970."""
    origin: tuple[Latitude, Longitude] | None = None
    """Latitude and longitude ("1.3 deg") of x = y = 0; left out: of the first point."""
    offset: Position = (0.0, 0.0, 0.0)
    """Added to every place: where in the world the file's own origin is."""
    depth: NonNegativeMetres | None = None
    """Depth of the whole track, in place of what the file says; a file without depths needs it."""
    heading: Radians | None = None
    """Heading of the whole track, in place of what the file says."""
    pitch: Radians = 0.0
    """Constant angle where the file has none."""
    roll: Radians = 0.0
    """Constant angle where the file has none."""


@dataclass(frozen=True, eq=False)
class _Curve:
    """A track between its points: x, y, z (m), heading, pitch and roll (rad), cubics of the time."""

    times: list[float]  # (point,) s of the motions
    cubic: Floats  # (4, point - 1, column): coefficients, highest power first, of the time after the point

    def at(self, time: float) -> Floats:
        """x, y, z, heading, pitch, roll; beyond the ends straight on, without turning."""
        inside, (a, b, c, d), late = self._piece(time)
        values = ((a * late + b) * late + c) * late + d
        if inside != time:
            values[:3] += (time - inside) * self.rates(inside)[:3]
        return np.asarray(values)

    def rates(self, time: float) -> Floats:
        """Their derivatives."""
        inside, (a, b, c, _), late = self._piece(time)
        values = (3.0 * a * late + 2.0 * b) * late + c
        if inside != time:
            values[3:] = 0.0
        return np.asarray(values)

    def _piece(self, time: float) -> tuple[float, Floats, float]:
        """The time, no farther than an end; the cubic there, and the time after its beginning."""
        inside = min(max(time, self.times[0]), self.times[-1])
        piece = min(bisect_right(self.times, inside), len(self.times) - 1) - 1
        return inside, self.cubic[:, piece], inside - self.times[piece]


def track_pose(track: RecordedTrack, time: float) -> Pose:
    """Where a body on a track is at a time (s) of the motions. Raises TrackError where the file cannot be used."""
    values = _of(track).at(time)
    return Pose(values[:3], quaternion(*values[3:].tolist()))


def track_velocity(track: RecordedTrack, time: float) -> Floats:
    """Velocity (xyz) in m/s. Raises TrackError."""
    return _of(track).rates(time)[:3]


def track_spin(track: RecordedTrack, time: float) -> Floats:
    """Angular velocity (xyz) in the world, rad/s: of heading, pitch and roll together. Raises TrackError."""
    curve = _of(track)
    (heading, pitch, _), (turning, pitching, rolling) = curve.at(time)[3:], curve.rates(time)[3:]
    ahead = np.array([np.cos(pitch) * np.sin(heading), np.cos(pitch) * np.cos(heading), np.sin(pitch)])
    starboard = np.array([np.cos(heading), -np.sin(heading), 0.0])
    return np.asarray(rolling * ahead + pitching * starboard - turning * np.array([0.0, 0.0, 1.0]))


def track_span(track: RecordedTrack) -> tuple[float, float]:
    """Times (s) of the motions of the first and the last point. Raises TrackError where the file cannot be used."""
    curve = _of(track)
    return curve.times[0], curve.times[-1]


def _of(track: RecordedTrack) -> _Curve:
    with named_files.errors_as(TrackError, track.path):
        return _curve(track, named_files.stamp(track.path))


@lru_cache(maxsize=16)
def _curve(track: RecordedTrack, changed: tuple[int, int]) -> _Curve:
    from scipy.interpolate import CubicHermiteSpline

    table = read_track(Path(track.path))
    clock = table.columns["time"]
    time = clock - (clock[0] if track.start == "first" else track.start)
    position = _places(track, table)
    angles = [np.full(len(time), angle) for angle in (track.pitch, track.roll)]
    angles = [np.unwrap(table.columns.get(name, a)) for name, a in zip(("pitch", "roll"), angles, strict=True)]
    velocity, way = _velocities(time, position)
    if track.heading is not None:
        heading = np.full(len(time), track.heading)
    else:
        heading = np.unwrap(table.columns["heading"]) if "heading" in table.columns else _courses(way)
    turned = np.column_stack([heading, *angles])
    curve = CubicHermiteSpline(
        time, np.column_stack([position, turned]), np.column_stack([velocity, _rates(time, turned)])
    )
    return _Curve(time.tolist(), np.asarray(curve.c, float))


def _rates(time: Floats, values: Floats) -> Floats:
    """Derivatives (point, column) at points of the curve through values (point, column)."""
    from scipy.interpolate import Akima1DInterpolator

    return np.asarray(Akima1DInterpolator(time, values, method="makima").derivative()(time))


def _velocities(time: Floats, position: Floats) -> tuple[Floats, Floats]:
    """Velocities (point, xyz) m/s at positions (point, xyz) m, 0 where a rest begins or ends: else the curve would
    swing away from it, and back. And those that headings are along, there of the way to the rest or from it."""
    velocity, chord = _rates(time, position), np.diff(position, axis=0) / np.diff(time)[:, None]
    rest = ~chord.any(axis=1)
    at_rest, none = np.append(rest, False) | np.append(False, rest), np.zeros((1, 3))
    beside = np.concatenate([chord, none]) + np.concatenate([none, chord])
    return np.where(at_rest[:, None], 0.0, velocity), np.where(at_rest[:, None], beside, velocity)


def _places(track: RecordedTrack, table: TrackTable) -> Floats:
    """Places (point, xyz) m in the world. Raises TrackError."""
    columns = table.columns
    if track.depth is not None:
        up = np.full(len(columns["time"]), -track.depth)
    elif "depth" in columns or "z" in columns:
        up = -columns["depth"] if "depth" in columns else columns["z"]
    else:
        raise TrackError(f"{table.path}: has no column of depth or z: give the `depth`")
    if "x" in columns and "y" in columns:
        if track.origin is not None:
            raise TrackError(f"{table.path}: has x and y, which no `origin` in latitude and longitude places")
        flat = np.column_stack([columns["x"], columns["y"]])
    else:
        latitude, longitude = columns["latitude"], columns["longitude"]
        origin = (float(latitude[0]), float(longitude[0])) if track.origin is None else track.origin
        flat = east_north(latitude, longitude, origin)
        if (far := float(np.hypot(*flat.T).max())) > FARTHEST:
            raise TrackError(
                f"{table.path}: goes {1e-3 * far:.0f} km from its origin, where the plane of east and north ends "
                f"({1e-3 * FARTHEST:g} km)"
            )
    return np.asarray(np.column_stack([flat, up]) + np.array(track.offset))


def _courses(velocity: Floats) -> Floats:
    """Headings (point,) along velocities (point, xyz), rad without jumps; where it stands, that of the point before."""
    moving = np.flatnonzero(np.hypot(velocity[:, 0], velocity[:, 1]) > AT_REST)
    if not len(moving):
        return np.zeros(len(velocity))
    last = moving[np.maximum(np.searchsorted(moving, np.arange(len(velocity)), side="right") - 1, 0)]
    return np.unwrap(np.arctan2(velocity[last, 0], velocity[last, 1]))
