"""The Kirchhoff integral over flat facets and plates, exact for each of them, with no special case at the mirror angle
(`kirchhoff_kernels.mesh_amplitude` sums it over facets).

Of a plane wave of unit pressure at the origin, travelling along ki, a facet sends f exp(-ikr)/r along ks:

    f = -(i/4 pi) V (n.w) int exp(-i w.x) dS,   w = k (ki - ks),

n its outward normal, V its plane-wave reflection coefficient (1 rigid, -1 soft, or local). Time dependence
exp(+i 2 pi f t): a point x echoes with the delay (ki - ks).x/c. The textbook's factor (1+V) n.ks + (1-V) n.ki is
replaced by its mean with source and receiver exchanged, V n.(ks - ki): the same at backscatter and at the mirror
angle, and reciprocal at all others. Whether a facet is lit and seen is for the caller to say: `lobes.lit_and_seen` for
flat bodies, `shadow_taper` for curved ones.
Vectors of propagation are unit vectors (..., xyz), in and away.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.special import j1, spherical_jn

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.scattering.lobes import dot

SPREAD = 2.0  # rad: phases closer together than this go by the series
TERMS = 23  # of the series: the rest is under 1e-17


def divided_exponential(phases: npt.ArrayLike) -> Complexes:
    """Second divided difference (...) of the exponential at i times the `phases` (..., 3) (rad).

    The mean of exp(i phase) over a triangle whose corners have these phases is twice this (Hermite and Genocchi). With
    phases a <= b <= c about their mean and E(x, y) = exp(i(x+y)/2) sinc((x-y)/2),

        (E(b, c) - E(a, b))/(i (c-a)),   or   sum_j i^j h_j/(j+2)!,  h_j = -e2 h_(j-2) + e3 h_(j-3),  where c-a < 2,

    h_j the complete, e_j the elementary symmetric polynomials (e1 = 0). Either is good to 3e-16 from the mirror angle
    on; phases of 1e4 rad are known to 1e-12 only, and their integral has fallen to 1e-4 or less.
    """
    p = np.asarray(phases, float)
    first = p[..., 0]
    second, third = p[..., 1] - first, p[..., 2] - first
    mean = (second + third) / 3.0
    x, y, z = -mean, second - mean, third - mean
    low, high = np.minimum(x, y), np.maximum(x, y)
    a, c = np.minimum(low, z), np.maximum(high, z)
    b = np.maximum(low, np.minimum(high, z))
    near = c - a < SPREAD
    far = ~near
    out = np.empty(near.shape, complex)
    out[near] = _series(a[near], b[near], c[near])
    a, b, c = a[far], b[far], c[far]
    out[far] = (_mean_exponential(b, c) - _mean_exponential(a, b)) * (-1j * (1.0 / (c - a)))
    return np.asarray(np.exp(1j * first) * np.asarray(out * np.exp(1j * mean)))


def _mean_exponential(x: Floats, y: Floats) -> Complexes:
    """Mean of exp(i t) for t from x to y."""
    return np.asarray(np.exp(0.5j * (x + y)) * np.sinc((y - x) / (2.0 * np.pi)))


def _series(a: Floats, b: Floats, c: Floats) -> Complexes:
    e2, e3 = a * (b + c) + b * c, a * b * c
    s3, s2, s1 = np.zeros_like(a), np.zeros_like(a), np.ones_like(a)  # s_(j-3), s_(j-2), s_(j-1): h_j, signs of i^j
    sums = [np.full_like(a, 0.5), np.zeros_like(a)]  # of even and odd orders: real and imaginary part
    factorial = 2.0
    for j in range(1, TERMS):
        s3, s2, s1 = s2, s1, e2 * s2 + (-1.0) ** j * e3 * s3
        factorial *= j + 2
        sums[j % 2] += s1 / factorial
    return np.asarray(sums[0] + 1j * sums[1])


def local_grazing(incident: npt.ArrayLike, scattered: npt.ArrayLike) -> Floats:
    """Grazing angle (rad) (...) at which a facet would mirror one way into the other: sin q = |ki - ks|/2.

    Where a facet's `reflection` depends on the angle: `boundary_reflection.rayleigh` there keeps its amplitude
    reciprocal.
    """
    across = np.asarray(incident, float) - np.asarray(scattered, float)
    along = np.asarray(incident, float) + np.asarray(scattered, float)
    return np.asarray(np.arctan2(np.linalg.norm(across, axis=-1), np.linalg.norm(along, axis=-1)))


def shadow_taper(incident: Floats, scattered: Floats, normal: Floats) -> Floats:
    """Factor (...) on the amplitude of facets of a curved body, 4 cos i cos s/(cos i + cos s)^2; 0 if not lit and seen.

    The integral over what is lit and seen ends at an edge that the body does not have, whose echo spoils the bistatic
    one. With this factor the mean of cos i and cos s becomes their harmonic mean, which falls to 0 at that edge; it is
    1 at backscatter and in the mirror direction, and reciprocal. Rigid spheres of k a 26 to 230 against the exact
    series, largest error in dB with and without it: at 60 degrees from backscatter 0.2 and 0.8, at 90 0.7 and 1.5, at
    120 (k a > 52) 0.7 and 2.1. Of a flat plate it would change the side lobes.
    """
    inward, outward = np.maximum(-dot(incident, normal), 0.0), np.maximum(dot(scattered, normal), 0.0)
    both = inward + outward
    share = inward / np.where(both > 0.0, both, 1.0)
    return np.where((inward > 0.0) & (outward > 0.0), 4.0 * share * (1.0 - share), 0.0)


def rectangular_plate(
    sides: tuple[float, float],
    incident: npt.ArrayLike,
    scattered: npt.ArrayLike,
    wavenumber: npt.ArrayLike,
    reflection: npt.ArrayLike = 1.0,
) -> Complexes:
    """Far-field amplitude f (...) (m) of a rectangle with `sides` (m) along x and y, its middle at 0, its normal z.

    |f| = A/lambda in the mirror direction, sinc lobes off it; nulls where side x (change of the sine) is a wavelength.
    """
    wave = _wave(incident, scattered, wavenumber)
    length, width = sides
    mean = np.sinc(wave[..., 0] * (length / (2.0 * np.pi))) * np.sinc(wave[..., 1] * (width / (2.0 * np.pi)))
    return _amplitude(wave[..., 2], np.asarray(length * width * mean), reflection)


def circular_plate(
    radius: float, incident: npt.ArrayLike, scattered: npt.ArrayLike, wavenumber: npt.ArrayLike
) -> Complexes:
    """Far-field amplitude f (...) (m) of a disc of that radius (m), its middle at 0, its normal z: 2 J1(x)/x lobes."""
    wave = _wave(incident, scattered, wavenumber)
    x = np.maximum(radius * np.hypot(wave[..., 0], wave[..., 1]), 1e-150)
    return _amplitude(wave[..., 2], np.asarray(np.pi * radius**2 * (2.0 * j1(x) / x)), 1.0)


def lit_sphere(radius: npt.ArrayLike, wavenumber: npt.ArrayLike) -> Complexes:
    """Far-field amplitude f (...) (m) of the Kirchhoff integral over the lit half of a sphere, at backscatter.

    i k a^2 int_0^1 u exp(2 i k a u) du = (i/2) k a^2 exp(i k a) (j0(ka) + i j1(ka)), spherical Bessel functions:
    what ever finer flat facets approach. (a/2) exp(2 i k a) for large k a, as the exact echo (`modal`), from which it
    differs by the edge that it has where the shadow begins.
    """
    a, k = np.asarray(radius, float), np.asarray(wavenumber, float)
    integral = 0.5 * np.exp(1j * k * a) * (spherical_jn(0, k * a) + 1j * spherical_jn(1, k * a))
    return np.asarray(1j * k * a * a * integral)


def _wave(incident: npt.ArrayLike, scattered: npt.ArrayLike, wavenumber: npt.ArrayLike) -> Floats:
    across = np.asarray(incident, float) - np.asarray(scattered, float)
    return np.asarray(np.asarray(wavenumber, float)[..., None] * across)


def _amplitude(normal_wave: Floats, integral: Floats | Complexes, reflection: npt.ArrayLike) -> Complexes:
    return np.asarray(-0.25j / np.pi * np.asarray(reflection) * normal_wave * integral)
