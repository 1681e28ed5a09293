"""The Kirchhoff integral over many flat facets at many frequencies, compiled; `kirchhoff_integral` has the formulas."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Complexes, Floats

SPREAD = 2.0  # rad: phases closer together than this go by the series
WIDER = 6.0  # rad: the same for MANY wavenumbers, which share its terms; errors stay under 1e-15 of the area
MANY = 4
ROOM = 24  # pairs of terms, of which it takes 17 at most


def mesh_amplitude(
    corners: npt.ArrayLike,
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    wavenumber: npt.ArrayLike,
    weight: npt.ArrayLike = 1.0,
    roughness: npt.ArrayLike = 0.0,
) -> Complexes:
    """Sum over facets of their far-field amplitudes f (frequency,) (m) at wavenumbers (frequency,) (rad/m).

    corners (facet, 3, xyz) (m), counter-clockwise from outside; incident, scattered: unit vectors of propagation
    (facet, xyz) or (xyz,), in and away; weight (facet,): reflection coefficient, complex if need be, and 0 where a
    facet is not lit or not seen; roughness (facet,): rms height (m) of the surface, which leaves the coherent part
    exp(-g^2/2), g = k height n.(ks - ki). Formulas as in `kirchhoff_integral`; the phase of a facet is that of its
    place, so that amplitudes add. Facets of weight 0 cost nothing.
    """
    args = _prepared(corners, incident, scattered, wavenumber, weight, roughness)
    out = np.zeros(args[3].size, complex)
    _add(out, *args)
    return out


def _prepared(
    corners: npt.ArrayLike,
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    wavenumber: npt.ArrayLike,
    weight: npt.ArrayLike,
    roughness: npt.ArrayLike,
) -> tuple[Floats, Floats, Floats, Floats, Complexes, Floats]:
    x = np.ascontiguousarray(corners, float)
    if x.ndim != 3 or x.shape[1:] != (3, 3):
        raise ValueError(f"corners of facets have the shape (facet, 3, xyz), not {x.shape}")
    facets = len(x)
    along = [np.ascontiguousarray(np.broadcast_to(np.asarray(v, float), (facets, 3))) for v in (incident, scattered)]
    factor = np.ascontiguousarray(np.broadcast_to(np.asarray(weight, complex), facets))
    height = np.ascontiguousarray(np.broadcast_to(np.asarray(roughness, float), facets))
    return x, along[0], along[1], np.ascontiguousarray(np.atleast_1d(np.asarray(wavenumber, float))), factor, height


@compiled
def _add(
    out: Complexes, corners: Floats, incident: Floats, scattered: Floats, k: Floats, weight: Complexes, height: Floats
) -> None:
    row, room, pace = np.empty(k.size, np.complex128), np.empty((2, ROOM)), spacing(k)
    for facet in range(len(corners)):
        if weight[facet] != 0.0:
            _facet(row, corners[facet], incident[facet], scattered[facet], k, weight[facet], height[facet], room, pace)
            out += row


@compiled
def _facet(
    out: Complexes,
    v: Floats,
    incident: Floats,
    scattered: Floats,
    k: Floats,
    weight: complex,
    height: float,
    room: Floats,
    pace: float,
) -> None:
    """Amplitudes (frequency,) of one facet: -(i/2 pi) V (N.u) k exp[-i k u.v], N its vector area, u = ki - ks."""
    ux, uy, uz = incident[0] - scattered[0], incident[1] - scattered[1], incident[2] - scattered[2]
    nx, ny, nz = half_means(out, v, ux, uy, uz, k, room, pace)
    across = nx * ux + ny * uy + nz * uz
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    decay = 0.5 * (height * across / size) ** 2 if height > 0.0 and size > 0.0 else 0.0
    factor = weight * complex(0.0, -across / (4.0 * math.pi))
    for i in range(k.size):
        out[i] *= factor * (k[i] * math.exp(-decay * k[i] * k[i]) if decay > 0.0 else k[i])


@compiled
def spacing(k: Floats) -> float:
    """Step of equally spaced wavenumbers, within rounding errors; NaN of others."""
    if k.size < 3:
        return math.nan
    step: float = (k[-1] - k[0]) / (k.size - 1)
    for i in range(k.size):
        if abs(k[i] - (k[0] + i * step)) > 1e-15 * abs(k[-1]):
            return math.nan
    return step


@compiled
def half_means(
    out: Complexes, v: Floats, ux: float, uy: float, uz: float, k: Floats, room: Floats, pace: float
) -> tuple[float, float, float]:
    """Half the mean (frequency,) of exp(-i k u.x) over one facet into `out`; returns twice its vector area.

    Many wavenumbers share the terms of a power series (in `room`) as far as phases are within WIDER. Equally spaced
    ones (`pace`, else NaN) turn the phase of the middle by one rotation each, and every 16th anew.
    """
    ax, ay, az = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    bx, by, bz = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    first, second = ax * ux + ay * uy + az * uz, bx * ux + by * uy + bz * uz  # m of path, from the first corner
    third = (first + second) / 3.0
    x, y, z = third, third - first, third - second  # minus the path about the middle: phases are -k of the path
    low, high = min(x, y), max(x, y)
    a, c = min(low, z), max(high, z)
    b = max(low, min(high, z))
    limit = WIDER / max(c - a, 1e-300)  # rad/m: of the series
    if k.size < MANY or limit < k[0]:
        for i in range(k.size):
            out[i] = divided(k[i] * a, k[i] * b, k[i] * c)
    else:
        _powers(out, a, b, c, limit, k, room)
    _turned(out, v[0, 0] * ux + v[0, 1] * uy + v[0, 2] * uz + third, k, pace)
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@compiled
def _turned(out: Complexes, path: float, k: Floats, pace: float) -> None:
    """Multiplies `out` (frequency,) by exp(-i k path)."""
    even = not math.isnan(pace)
    turn = complex(math.cos(pace * path), -math.sin(pace * path)) if even else 0.0j
    phase = 0.0j
    for i in range(k.size):
        if even and i % 16 != 0:
            phase *= turn
        else:
            phase = complex(math.cos(k[i] * path), -math.sin(k[i] * path))
        out[i] *= phase


@compiled
def _powers(out: Complexes, a: float, b: float, c: float, limit: float, k: Floats, room: Floats) -> None:
    """`divided` of k times paths a <= b <= c (m): one series in k up to the `limit`."""
    scale = min(k.max(), limit)
    x, y, z = scale * a, scale * b, scale * c
    terms = series(room, x * (y + z) + y * z, x * y * z, z - x, 1e-17)
    for i in range(k.size):
        if k[i] <= scale:
            q = k[i] / scale if scale > 0.0 else 0.0
            square = q * q
            re, im = room[0, terms], room[1, terms]
            for j in range(terms - 1, -1, -1):
                re = re * square + room[0, j]
                im = im * square + room[1, j]
            out[i] = complex(re, im * q)
        else:
            out[i] = divided(k[i] * a, k[i] * b, k[i] * c)


@compiled
def series(room: Floats, e2: float, e3: float, gap: float, tolerance: float) -> int:
    """Terms (even or odd, j) of `divided` of q times phases with mean 0: sum_j of q^(2j) (even + i q odd).

    e2, e3: elementary symmetric polynomials of the phases; `gap` (rad) between the outer ones of the largest q times
    them. Returns the last j, or the last that there is room for: |h_j|/(j+2)! is at most (2 gap/3)^j/(2 j!).
    """
    largest = 2.0 / 3.0 * gap
    even, odd, before = 1.0, 0.0, 0.0  # s_j, s_(j+1), s_(j-1): h_j with the signs of i^j
    room[0, 0], room[1, 0] = 0.5, 0.0
    weight, bound, j, order = 0.5, 0.5, 0, 0.0
    while bound > tolerance and j < room.shape[1] - 1:
        j += 1
        order += 2.0
        even, odd, before = e2 * even + e3 * before, e2 * odd - e3 * even, odd
        weight /= (order + 1.0) * (order + 2.0)
        room[0, j], room[1, j] = even * weight, odd * weight / (order + 3.0)
        bound *= largest * largest / ((order - 1.0) * order)
    return j


@compiled
def divided(a: float, b: float, c: float) -> complex:
    """`kirchhoff_integral.divided_exponential` of phases a <= b <= c with mean 0."""
    gap = c - a
    if gap >= SPREAD:
        late, early = _sinc(0.5 * (c - b)), _sinc(0.5 * (b - a))
        p, q = -0.5 * a, -0.5 * c  # middles of b, c and of a, b
        re = late * math.cos(p) - early * math.cos(q)
        im = late * math.sin(p) - early * math.sin(q)
        return complex(im / gap, -re / gap)
    e2, e3 = a * (b + c) + b * c, a * b * c
    even, odd, before = 1.0, 0.0, 0.0  # as in `_series`
    re, im = 0.5, 0.0
    weight, bound, j = 0.5, 0.5, 0.0
    while bound > 1e-17:
        j += 2.0
        even, odd, before = e2 * even + e3 * before, e2 * odd - e3 * even, odd
        weight /= (j + 1.0) * (j + 2.0)
        re += even * weight
        im += odd * weight / (j + 3.0)
        bound *= gap * gap / ((j - 1.0) * j)
    return complex(re, im)


@compiled
def _sinc(x: float) -> float:
    return math.sin(x) / x if x > 1e-160 else 1.0
