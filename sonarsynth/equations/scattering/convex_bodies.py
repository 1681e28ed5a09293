"""The field on a smooth convex surface from light to shadow, and how the surface is curved.

Kirchhoff's integral takes the field on a surface for that on its tangent plane where it is lit, and for none where it
is not. On a convex surface large against the wavelength the true field goes from one to the other over a strip of
width rho/m about the edge of the shadow, m = (k rho/2)^(1/3), rho the radius of curvature along the wave, and creeps
on into the shadow as exp(-0.88 xi) (rigid) or exp(-2.02 xi) (soft): a function of one number xi alone (Fock 1946),

    xi = -m cos i where lit (cos i > 0),   xi = m asin(-cos i) in the shadow: m times the angle behind its edge.

A flat facet has m infinite: xi is -inf or inf, and Kirchhoff's field is the limit. Time dependence exp(+i 2 pi f t).
Sources: Fock (1946), J. Phys. USSR 10, 130; Logan (1959), LMSD-288087 (tables); Pathak (1979), Radio Science 14, 419.
"""

from __future__ import annotations

from functools import cache
from typing import Final, Literal

import numpy as np
import numpy.typing as npt
from scipy.special import airye

from sonarsynth.conventions import Complexes, Floats, Ints

LIT: Final = -6.0
"""xi up to which the field goes by its series, with an error of 1e-6."""
DARK: Final = 12.0
"""xi from which the field, under 3e-5 (rigid) or 1e-10 (soft), is left out by `convex_kernels`."""
STEP: Final = 1.0 / 8.0
"""Spacing of `field_table`; cubic interpolation has an error of 3e-5."""
REACH: Final = 20.0  # of the integrals over t
POINTS: Final = 201


def surface_field(distance: npt.ArrayLike, boundary: Literal["rigid", "soft"]) -> Complexes:
    """Field (...) over twice the incident, on a convex surface at distances xi (...) from the edge of the shadow.

    rigid: pressure, g(xi)/2; soft: m times the normal gradient over that of twice the incident wave at normal
    incidence, f(xi)/2i, with

        g(xi) = pi^(-1/2) int exp(-i xi t)/w2'(t) dt,   f(xi) = pi^(-1/2) int exp(-i xi t)/w2(t) dt,

    w2 = sqrt(pi) (Bi - i Ai). Where xi < 0 they are divided by exp(i xi^3/3), so that the phase is that of the incident
    wave at the place, and rigid is 1, soft -xi = m cos i far in the light; where xi > 0 it is that of the wave that
    creeps from the edge on, which is k rho (theta - sin theta) later than the incident, theta = xi/m. g(0) = 1.3994,
    f(0) = 0.7758 exp(i pi/3). Absolute error 1e-6 up to xi = 12.
    """
    xi = np.asarray(distance, float)
    lit, x = np.minimum(xi, 0.0)[..., None], np.maximum(xi, LIT)[..., None]
    at = np.linspace(-REACH, REACH, POINTS)
    bow = np.sqrt(at * at + 1.0)
    # Through the saddle at -xi^2 where lit, along the steepest way; through 0 and down on both sides where dark.
    dark = xi[..., None] > 0
    t = np.where(dark, at - 0.5j * (bow - 1.0), at * np.exp(1j * np.pi / 5.0) - np.maximum(lit, LIT) ** 2)
    pace = np.where(dark, 1.0 - 0.5j * at / bow, np.exp(1j * np.pi / 5.0))
    turn = np.exp(-2j * np.pi / 3.0)  # w2(t) = 2 sqrt(pi) exp(-i pi/6) Ai(t turn)
    z = t * turn
    airy, slope = airye(z)[:2]
    below = slope * turn if boundary == "rigid" else airy
    power = 2.0 / 3.0 * z * np.sqrt(z) - 1j * x * t - 1j * np.maximum(lit, LIT) ** 3 / 3.0
    total = np.sum(np.exp(power) * pace / below, axis=-1) * (2.0 * REACH / (POINTS - 1))
    near = total * np.exp(1j * np.pi / 6.0) / (2.0 * np.pi)
    far = np.minimum(xi, LIT)
    if boundary == "rigid":
        return np.asarray(np.where(xi > LIT, 0.5 * near, 1.0 - 0.25j / far**3 - 1.0 / far**6))
    return np.asarray(np.where(xi > LIT, -0.5j * near, -far * (1.0 + 0.25j / far**3 + 0.5 / far**6)))


@cache
def field_table() -> Complexes:
    """`surface_field` (boundary, distance) of rigid and soft surfaces from LIT to DARK, and one step beyond each."""
    xi = np.arange(round((DARK - LIT) / STEP) + 3) * STEP + (LIT - STEP)
    return np.stack([surface_field(xi, "rigid"), surface_field(xi, "soft")])


def shape_operators(vertices: npt.ArrayLike, faces: Ints) -> Floats:
    """Gradient (facet, xyz, xyz) in 1/m of the normal of the smooth surface that a mesh stands for.

    d.S d is the curvature along the unit tangent d: 1/radius on a sphere, negative where hollow. From the normals at
    the corners, which weigh those of the facets about them after Max (1999), J. Graphics Tools 4(2), 1: exact on a
    sphere. vertices (vertex, xyz) m, each place once; faces (facet, 3), counter-clockwise from outside. 0 for a needle.
    """
    points = np.asarray(vertices, float)
    corners = points[faces]
    onward, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    lengths = np.sum(onward**2, axis=2) * np.sum(back**2, axis=2)
    contributions = np.cross(onward, back) / np.where(lengths > 0.0, lengths, np.inf)[..., None]
    sums = [np.bincount(faces.ravel(), contributions[..., i].ravel(), len(points)) for i in range(3)]
    normal = np.stack(sums, axis=-1)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    turned = (normal / np.where(size > 0.0, size, 1.0))[faces]
    first, second = onward[:, 0], -onward[:, 2]
    across = np.cross(first, second)
    square = np.sum(across**2, axis=1)
    dual = np.stack([np.cross(second, across), np.cross(across, first)], axis=1)
    dual /= np.where(square > 0.0, square, np.inf)[:, None, None]
    return np.asarray(np.einsum("fei,fej->fij", turned[:, 1:] - turned[:, :1], dual))


def curvature_along(direction: Floats, normal: Floats, shape: Floats) -> Floats:
    """Curvature (facet,) in 1/m along what of a direction (xyz) is tangent to facets with normals (facet, xyz).

    shape: as `shape_operators`. 0 where hollow, and where the direction is square to the facet.
    """
    along = direction - (normal @ direction)[:, None] * normal
    square = np.sum(along**2, axis=1)
    bent = np.einsum("fi,fij,fj->f", along, shape, along)
    return np.asarray(np.maximum(bent, 0.0) / np.where(square > 1e-20, square, np.inf))
