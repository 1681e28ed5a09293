"""Kirchhoff's integral over a smooth convex body with the field that is there, in light and shadow, compiled."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.convex_bodies import DARK, LIT, STEP, curvature_along, field_table
from sonarsynth.equations.scattering.kirchhoff_kernels import ROOM, half_means, spacing

FLATTEST = 1e-12  # 1/m: a curvature of less is as good as none


def convex_amplitude(
    corners: npt.ArrayLike,
    normal: npt.ArrayLike,
    shape: npt.ArrayLike,
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    wavenumber: npt.ArrayLike,
    reflection: complex = 1.0,
    roughness: float = 0.0,
) -> Complexes:
    """Far-field amplitude f (frequency,) (m) of a closed, smooth, convex body at wavenumbers (frequency,) (rad/m).

        f = (i k/4 pi) sum over all facets of [(1+V)/2 (G_i cos s + G_s cos i) - (1-V)/2 (C_i + C_s)] int exp(-i w.x) dS

    cos i = -n.ki and cos s = n.ks, of either sign, w = k (ki - ks), G and C/m the fields of
    `convex_bodies.surface_field` that a wave along ki and one along -ks would make on a rigid and on a soft surface:
    the mean of the two integrals over the one field and the other, and so reciprocal. Where a facet is far in the light
    of both waves it is `kirchhoff_integral.facet_amplitude`. It holds what creeps round the body, and what cancels the
    direct wave behind it.

    corners (facet, 3, xyz) m, counter-clockwise from outside, with normal (facet, xyz) and
    `convex_bodies.shape_operators` (facet, xyz, xyz); unit vectors of propagation (xyz), in and away; reflection V;
    roughness: rms height (m), as in `kirchhoff_kernels.mesh_amplitude`.

    Spheres of k a 26 to 230 against the exact series: within 0.1 dB at backscatter, 0.25 dB up to 120 degrees off it,
    0.4 (rigid) or 0.9 dB (soft) beyond. Of k a from 5 on a rigid one is within 1 dB, from 3 on a soft one.
    """
    x, n, operator = (np.ascontiguousarray(v, float) for v in (corners, normal, shape))
    going, away = (np.ascontiguousarray(v, float) for v in (incident, scattered))
    k = np.ascontiguousarray(np.atleast_1d(np.asarray(wavenumber, float)))
    bends = [np.maximum(curvature_along(v, n, operator), FLATTEST) for v in (going, away)]
    table = field_table()
    out = np.zeros(k.size, complex)
    mix = np.array([0.5 * (1.0 + reflection), -0.5 * (1.0 - reflection)])
    _add(out, x, n, bends[0], bends[1], going, away, k, mix, float(roughness), table)
    return out


@compiled
def _add(
    out: Complexes,
    corners: Floats,
    normal: Floats,
    bend_in: Floats,
    bend_out: Floats,
    going: Floats,
    away: Floats,
    k: Floats,
    mix: Complexes,
    height: float,
    table: Complexes,
) -> None:
    row, room, pace = np.empty(k.size, np.complex128), np.empty((2, ROOM)), spacing(k)
    root = np.cbrt(np.maximum(0.5 * k, 1e-90))
    ux, uy, uz = going[0] - away[0], going[1] - away[1], going[2] - away[2]
    for facet in range(len(corners)):
        n = normal[facet]
        cos_i = -(n[0] * going[0] + n[1] * going[1] + n[2] * going[2])
        cos_s = n[0] * away[0] + n[1] * away[1] + n[2] * away[2]
        nx, ny, nz = half_means(row, corners[facet], ux, uy, uz, k, room, pace)
        size = math.sqrt(nx * nx + ny * ny + nz * nz) / (4.0 * math.pi)
        decay = 0.5 * (height * (cos_i + cos_s)) ** 2
        m_in, m_out = bend_in[facet] ** (-1.0 / 3.0), bend_out[facet] ** (-1.0 / 3.0)
        for i in range(k.size):
            field, m_i, m_s = 0.0j, m_in * root[i], m_out * root[i]
            if mix[0] != 0.0:
                field += mix[0] * (
                    _field(cos_i, m_i, table[0], False) * cos_s + _field(cos_s, m_s, table[0], False) * cos_i
                )
            if mix[1] != 0.0:
                field += mix[1] * (_field(cos_i, m_i, table[1], True) / m_i + _field(cos_s, m_s, table[1], True) / m_s)
            out[i] += field * row[i] * complex(0.0, k[i] * math.exp(-decay * k[i] * k[i]) * size)


@compiled
def _field(cosine: float, m: float, table: Complexes, soft: bool) -> complex:
    """`convex_bodies.surface_field` where the incident wave meets a facet at that cosine, over that wave without a
    body."""
    if cosine > 0.0:
        xi, late = -m * cosine, 0.0
        if xi < LIT:
            cube = 1.0 / (xi * xi * xi)
            if soft:
                return -xi * complex(1.0 + 0.5 * cube * cube, 0.25 * cube)
            return complex(1.0 - cube * cube, -0.25 * cube)
    else:
        theta = math.asin(min(-cosine, 1.0))
        xi, late = m * theta, 2.0 * m**3 * (theta + cosine)  # k rho (theta - sin theta)
        if xi >= DARK:
            return 0.0j
    position = (xi - LIT) / STEP
    j = int(position)
    p = position - j
    w0, w1 = -p * (p - 1.0) * (p - 2.0) / 6.0, (p * p - 1.0) * (p - 2.0) / 2.0
    w2, w3 = -p * (p + 1.0) * (p - 2.0) / 2.0, p * (p * p - 1.0) / 6.0
    value: complex = w0 * table[j] + w1 * table[j + 1] + w2 * table[j + 2] + w3 * table[j + 3]
    return value * complex(math.cos(late), -math.sin(late)) if late > 0.0 else value
