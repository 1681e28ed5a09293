"""Directions from place to place, compiled: of straight rays, and to the places of an array from many points."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Ints


@compiled
def straight_rays(
    start: Floats, end: Floats, climb: Floats, mean: Floats, odd: Ints
) -> tuple[Ints, Floats, Floats, Floats, Floats, Floats, Floats]:
    """Ways from start to end (pair, xyz) m that climb (family, pair) m, at a mean slowness (family, pair) s/m, sorted
    by pair, then by travel time: family, travel times, lengths, unit vectors along them (ray, xyz) where they begin,
    NaN of none, and where they end, there upside down of odd (family,) ones, one over the lengths, and grazing
    angles."""
    families, count = climb.shape
    family, first = np.empty(families * count, np.int64), 0
    time, length, inverse, grazing = np.empty((4, families * count))
    departure, arrival = np.empty((2, families * count, 3))
    for i in range(count):
        x, y = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1]
        for n in range(families):
            far = math.sqrt(x * x + y * y + climb[n, i] * climb[n, i])
            late, k = far * mean[n, i], first + n
            while k > first and time[k - 1] > late:
                time[k], length[k], family[k] = time[k - 1], length[k - 1], family[k - 1]
                k -= 1
            time[k], length[k], family[k] = late, far, n
        for k in range(first, first + families):
            one, z = 1.0 / length[k], climb[family[k], i]
            inverse[k] = one
            departure[k, 0], departure[k, 1], departure[k, 2] = x * one, y * one, z * one
            arrival[k, 0], arrival[k, 1], arrival[k, 2] = x * one, y * one, -z * one if odd[family[k]] else z * one
            grazing[k] = math.asin(abs(z) / length[k]) if family[k] > 0 else math.nan
        first += families
    return family, time, length, departure, arrival, inverse, grazing


@compiled
def towards_sources(direction: Floats, curvature: Floats, points: Floats) -> tuple[Floats, Floats]:
    """Unit vectors (point, xyz, source) towards sources at direction/curvature (source, xyz) from points (point, xyz),
    and how far that is times the curvature (point, source)."""
    out, far = np.empty((len(points), 3, len(curvature))), np.empty((len(points), len(curvature)))
    for i in range(len(points)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        for j in range(len(curvature)):
            k = curvature[j]
            x, y, z = direction[j, 0] - k * px, direction[j, 1] - k * py, direction[j, 2] - k * pz
            far[i, j] = math.sqrt(x * x + y * y + z * z)
            out[i, 0, j], out[i, 1, j], out[i, 2, j] = x / far[i, j], y / far[i, j], z / far[i, j]
    return out, far


@compiled
def to_images(length: Floats, departure: Floats, mirrored: Bools, offset: Floats) -> Floats:
    """Unit vectors (leg, place, xyz) from where legs of some length (leg,) in directions (leg, xyz) start to places
    beside their ends (place, xyz), or beside what a level surface mirrors them to."""
    out = np.empty((len(length), len(offset), 3))
    for i in range(len(length)):
        for j in range(len(offset)):
            up = -offset[j, 2] if mirrored[i] else offset[j, 2]
            x = length[i] * departure[i, 0] + offset[j, 0]
            y = length[i] * departure[i, 1] + offset[j, 1]
            z = length[i] * departure[i, 2] + up
            one = 1.0 / math.sqrt(x * x + y * y + z * z)
            out[i, j, 0], out[i, j, 1], out[i, j, 2] = x * one, y * one, z * one
    return out


@compiled(forceinline=True)
def _put_turned(x: float, y: float, z: float, late: float, spin: Floats, rotation: Floats, out: Floats) -> None:
    """Put in out (axis,) the unit vector along x, y, z, turned back by small angles late spin (xyz,) rad, in axes with
    this rotation (xyz, axis)."""
    tx, ty, tz = late * spin[0], late * spin[1], late * spin[2]
    x, y, z = x - (ty * z - tz * y), y - (tz * x - tx * z), z - (tx * y - ty * x)
    one = 1.0 / math.sqrt(x * x + y * y + z * z)
    for n in range(3):
        out[n] = one * (rotation[0, n] * x + rotation[1, n] * y + rotation[2, n] * z)


@compiled
def moved(length: Floats, away: Floats, apart: Floats, late: Floats, spin: Floats, rotation: Floats) -> Floats:
    """Unit vectors (leg, place, xyz) of length (leg,) times away (leg, place, xyz) plus apart (leg, xyz), turned back
    by what a spin (leg, xyz) rad/s turns in late (leg,) s, in axes with this rotation (xyz, axis)."""
    out = np.empty(away.shape)
    for i in range(away.shape[0]):
        for j in range(away.shape[1]):
            x = length[i] * away[i, j, 0] + apart[i, 0]
            y = length[i] * away[i, j, 1] + apart[i, 1]
            z = length[i] * away[i, j, 2] + apart[i, 2]
            _put_turned(x, y, z, late[i], spin[i], rotation, out[i, j])
    return out


@compiled
def to_moved_images(
    length: Floats, departure: Floats, bounces: Ints, offset: Floats, rows: Ints, leg: Ints, apart: Floats,
    late: Floats, spin: Floats, rotation: Floats,
) -> Floats:  # fmt: skip
    """As `to_images`, (row, place, xyz) of the legs (path,) of some paths (row,): to places that are farther by apart
    (path, xyz), turned back and in axes as of `moved`; bounces (leg,): an odd number mirrors."""
    out = np.empty((len(rows), len(offset), 3))
    for k in range(len(rows)):
        n, i = rows[k], leg[rows[k]]
        for j in range(len(offset)):
            up = -offset[j, 2] if bounces[i] % 2 == 1 else offset[j, 2]
            x = length[i] * departure[i, 0] + offset[j, 0] + apart[n, 0]
            y = length[i] * departure[i, 1] + offset[j, 1] + apart[n, 1]
            z = length[i] * departure[i, 2] + up + apart[n, 2]
            _put_turned(x, y, z, late[n], spin[n], rotation, out[k, j])
    return out
