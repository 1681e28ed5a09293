"""The Kirchhoff integral over many flat facets at many frequencies, compiled: `kirchhoff.facet_amplitude`, summed."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from sonarsynth.conventions import Floats

Complexes = npt.NDArray[np.complex128]

SPREAD = 2.0  # rad: phases closer together than this go by the series


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
    exp(-g^2/2), g = k height n.(ks - ki). Formulas and phases as in `kirchhoff`; facets of weight 0 cost nothing.
    """
    args = _prepared(corners, incident, scattered, wavenumber, weight, roughness)
    out = np.zeros(args[3].size, complex)
    _add(out, *args)
    return out


def facet_amplitudes(
    corners: npt.ArrayLike,
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    wavenumber: npt.ArrayLike,
    weight: npt.ArrayLike = 1.0,
    roughness: npt.ArrayLike = 0.0,
) -> Complexes:
    """Far-field amplitudes f (facet, frequency) (m) one by one; arguments as in `mesh_amplitude`.

    Where source or receiver are near, each facet has its own directions: give its corners from its own middle, and
    multiply by what spreading and delay make of the ways to that.
    """
    args = _prepared(corners, incident, scattered, wavenumber, weight, roughness)
    out = np.zeros((len(args[0]), args[3].size), complex)
    _each(out, *args)
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


@njit(cache=True, error_model="numpy", nogil=True)
def _add(
    out: Complexes, corners: Floats, incident: Floats, scattered: Floats, k: Floats, weight: Complexes, height: Floats
) -> None:
    row = np.empty(k.size, np.complex128)
    for facet in range(len(corners)):
        if weight[facet] != 0.0:
            _facet(row, corners[facet], incident[facet], scattered[facet], k, weight[facet], height[facet])
            out += row


@njit(cache=True, error_model="numpy", nogil=True)
def _each(
    out: Complexes, corners: Floats, incident: Floats, scattered: Floats, k: Floats, weight: Complexes, height: Floats
) -> None:
    for facet in range(len(corners)):
        if weight[facet] != 0.0:
            _facet(out[facet], corners[facet], incident[facet], scattered[facet], k, weight[facet], height[facet])


@njit(cache=True, error_model="numpy", nogil=True)
def _facet(
    out: Complexes, v: Floats, incident: Floats, scattered: Floats, k: Floats, weight: complex, height: float
) -> None:
    """Amplitudes (frequency,) of one facet: -(i/2 pi) V (N.u) k exp[-i k u.v], N its vector area, u = ki - ks."""
    ux, uy, uz = incident[0] - scattered[0], incident[1] - scattered[1], incident[2] - scattered[2]
    ax, ay, az = v[1, 0] - v[0, 0], v[1, 1] - v[0, 1], v[1, 2] - v[0, 2]
    bx, by, bz = v[2, 0] - v[0, 0], v[2, 1] - v[0, 1], v[2, 2] - v[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx  # twice the area
    across = nx * ux + ny * uy + nz * uz
    first, second = ax * ux + ay * uy + az * uz, bx * ux + by * uy + bz * uz  # m of path, from the first corner
    third = (first + second) / 3.0
    x, y, z = third, third - first, third - second  # minus the path about the middle: phases are -k of the path
    low, high = min(x, y), max(x, y)
    a, c = min(low, z), max(high, z)
    b = max(low, min(high, z))
    middle = v[0, 0] * ux + v[0, 1] * uy + v[0, 2] * uz + third
    size = math.sqrt(nx * nx + ny * ny + nz * nz)
    decay = 0.5 * (height * across / size) ** 2 if height > 0.0 and size > 0.0 else 0.0
    factor = weight * complex(0.0, -across / (4.0 * math.pi))
    for i in range(k.size):
        angle = -k[i] * middle
        value = _divided(k[i] * a, k[i] * b, k[i] * c)
        out[i] = factor * (k[i] * math.exp(-decay * k[i] * k[i])) * value * complex(math.cos(angle), math.sin(angle))


@njit(cache=True, error_model="numpy", nogil=True)
def _divided(a: float, b: float, c: float) -> complex:
    """`kirchhoff.divided_exponential` of phases a <= b <= c with mean 0."""
    gap = c - a
    if gap >= SPREAD:
        late, early = _sinc(0.5 * (c - b)), _sinc(0.5 * (b - a))
        p, q = -0.5 * a, -0.5 * c  # middles of b, c and of a, b
        re = late * math.cos(p) - early * math.cos(q)
        im = late * math.sin(p) - early * math.sin(q)
        return complex(im / gap, -re / gap)
    e2, e3 = a * (b + c) + b * c, a * b * c
    even, odd, before = 1.0, 0.0, 0.0  # s_j, s_(j+1), s_(j-1): h_j with the signs of i^j
    re, im = 0.5, 0.0
    weight, bound, j = 0.5, 0.5, 0.0
    while bound > 1e-17:
        j += 2.0
        even, odd, before = e2 * even + e3 * before, e2 * odd - e3 * even, odd
        weight /= (j + 1.0) * (j + 2.0)
        re += even * weight
        im += odd * weight / (j + 3.0)
        bound *= gap * gap / ((j - 1.0) * j)  # |h_j|/(j+2)! is at most (2 gap/3)^j/(2 j!)
    return complex(re, im)


@njit(cache=True, error_model="numpy", nogil=True)
def _sinc(x: float) -> float:
    return math.sin(x) / x if x > 1e-160 else 1.0
