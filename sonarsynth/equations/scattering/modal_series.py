"""Exact scattering by spheres, and by rigid finite cylinders but for their ends: sums over modes.

Far-field amplitude f (m): a wave of unit pressure at the middle of the body gives the pressure f exp(-ikr)/r far away,
so that the target strength is 20 log10|f| (dB re 1 m2). Time dependence exp(+i 2 pi f t): the phase of f is that of an
echo whose delay counts from the middle of the body, exp(+2 i k a) for its nearest point.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import jv, spherical_jn, spherical_yn, yv

from sonarsynth.conventions import Complexes, Floats

TINY = 1e-90  # ka of a wave of no frequency: its scattering is the limit, without a case of its own


class Fluid(NamedTuple):
    """A fluid filling, over the water around it."""

    density_ratio: float
    speed_ratio: float


Boundary = Literal["rigid", "soft"] | Fluid


def sphere_amplitude(
    frequency: npt.ArrayLike,
    angle: npt.ArrayLike,
    *,
    radius: npt.ArrayLike,
    sound_speed: npt.ArrayLike = 1500.0,
    boundary: Boundary = "rigid",
) -> Complexes:
    """Far-field amplitude f (m) of a sphere at frequencies (Hz), scattered by an angle (rad) off the incident way.

    f = (i/k) sum_n (2n+1) A_n P_n(cos angle): 0 is forward, pi backscatter. Frequency, radius (m) and sound speed (m/s)
    are broadcast together, and then with the angle. Sources: Faran (1951), JASA 23, 405; Anderson (1950), JASA 22, 426
    (fluid); Bowman, Senior and Uslenghi (1969), chapter 10. Error against 60 digits: 1e-13 of the largest |f| of that
    frequency for ka from 1e-6 to 230 (4e-13 at 1e3), and 2e-12 (1e-10) of |f| itself at backscatter, where large terms
    cancel. Raises ValueError for a size, speed or frequency that is none, or an unknown boundary.
    """
    a = np.asarray(radius, float)
    ka = np.asarray(_wavenumber(frequency, sound_speed) * _positive(a, "radius (m)"))
    coefficient = sphere_coefficients(ka, boundary)
    cosine = np.cos(np.asarray(angle, float))
    total = np.zeros(np.broadcast_shapes(ka.shape, cosine.shape), complex)
    before, legendre = np.zeros_like(cosine), np.ones_like(cosine)
    for n, term in enumerate(coefficient):
        total += (2 * n + 1) * (term * legendre)
        before, legendre = legendre, ((2 * n + 1) * cosine * legendre - n * before) / (n + 1)
    return np.asarray(1j * a / np.maximum(ka, TINY) * total)


def sphere_coefficients(ka: npt.ArrayLike, boundary: Boundary = "rigid") -> Complexes:
    """Modal coefficients A_n (order, ...) of a sphere at products ka (...) of wavenumber and radius.

    A_n = -U/(U - iW): U = j_n', W = y_n' (rigid) or j_n, y_n (soft); through a fluid U = j_n' - Q B j_n and W likewise,
    with Q = 1/(density ratio x speed ratio) and B = j_n'/j_n inside. |1 + 2 A_n| = 1: no mode loses energy. Orders go
    up to x + 4.05 x^(1/3) + 12 for the largest x = ka, after Wiscombe (1980), Applied Optics 19, 1505.
    """
    products = np.asarray(ka, float)
    x = np.maximum(products.ravel(), TINY)
    count = _terms(x)
    j, j1, y, y1 = _spherical(count, x)
    with np.errstate(over="ignore", invalid="ignore"):
        if isinstance(boundary, Fluid):
            value, slope = _interior(count, x, boundary)
            u, w = slope * j - value * j1, slope * y - value * y1
        elif boundary in ("rigid", "soft"):
            u, w = (j1, y1) if boundary == "rigid" else (j, y)
        else:
            raise ValueError(f"boundary of a sphere is 'rigid', 'soft' or Fluid(...), not {boundary!r}")
    return _coefficient(u, w).reshape(count, *products.shape)


def cylinder_amplitude(
    frequency: npt.ArrayLike,
    aspect: npt.ArrayLike,
    *,
    radius: npt.ArrayLike,
    length: npt.ArrayLike,
    sound_speed: npt.ArrayLike = 1500.0,
) -> Complexes:
    """Backscattered far-field amplitude f (m) of a rigid cylinder at frequencies (Hz), seen at an angle off its axis.

    f = -(iL/pi) sinc(k L cos aspect) sum_m eps_m (-1)^m J_m'(Ka)/H_m'(Ka), K = k sin aspect (rad), radius a and length
    L (m), all broadcast together. Its curved surface alone: good near broadside, 0 end-on, where the flat ends would
    return the echo of a plate. Source: Stanton (1988), JASA 83, 55. Raises ValueError as `sphere_amplitude`.
    """
    a, span = _positive(radius, "radius (m)"), _positive(length, "length (m)")
    k, theta = _wavenumber(frequency, sound_speed), np.asarray(aspect, float)
    around, cosine, span = np.broadcast_arrays(k * a * np.abs(np.sin(theta)), k * span * np.cos(theta), span)
    x = np.maximum(around.ravel(), TINY)
    order = np.arange(_terms(x) + 4)[:, None]
    with np.errstate(over="ignore", invalid="ignore"):
        u = order / x * jv(order, x) - jv(order + 1, x)
        w = order / x * yv(order, x) - yv(order + 1, x)
    sign = np.where(order == 0, 1.0, np.where(order % 2 == 0, 2.0, -2.0))
    modes = -np.sum(sign * _coefficient(u, w), axis=0).reshape(around.shape)
    return np.asarray(-1j / np.pi * span * np.sinc(cosine / np.pi) * modes)


def _coefficient(u: Floats, w: Floats) -> Complexes:
    """-u/(u - iw), (order, x), and 0 where w has overflowed: such an order is far beyond what scatters."""
    with np.errstate(invalid="ignore"):
        scattered = -u / (u - 1j * w)
    return np.asarray(np.where(np.isfinite(w), scattered, 0.0))


def _terms(x: Floats) -> int:
    largest = float(np.max(x, initial=0.0))
    return int(largest + 4.05 * largest ** (1.0 / 3.0) + 12.0) + 1


def _spherical(count: int, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """j_n, j_n', y_n, y_n' of orders under `count`, (order, x)."""
    order = np.arange(count + 1)[:, None]
    with np.errstate(over="ignore", invalid="ignore"):
        j, y = spherical_jn(order, x), spherical_yn(order, x)
        over = order[:-1] / x
        return j[:-1], over * j[:-1] - j[1:], y[:-1], over * y[:-1] - y[1:]


def _interior(count: int, x: Floats, fluid: Fluid) -> tuple[Floats, Floats]:
    """Pressure and Q times its slope of each mode just inside a fluid sphere, (order, x), on a common scale of its own.

    The ratio r = j_(n+1)/j_n by recurrence from high orders down, which is stable and never underflows.
    """
    g, h = (float(_positive(v, "ratio of a fluid sphere")) for v in fluid)
    inside = x / h
    largest = float(np.max(inside, initial=0.0))
    ratio = np.zeros_like(x)
    pressure, slope = np.empty((2, count, x.size))
    with np.errstate(divide="ignore", over="ignore"):
        for n in range(int(max(count, largest + 8.0 * largest ** (1.0 / 3.0))) + 24, -1, -1):
            if n < count:
                rate = (n / inside - ratio) / (g * h)  # infinite where the pressure is 0
                size = np.maximum(1.0, np.abs(rate))
                pressure[n] = 1.0 / size
                slope[n] = np.where(np.isinf(rate), np.sign(rate), rate / size)
            ratio = 1.0 / ((2 * n + 1) / inside - ratio)
    return pressure, slope


def _wavenumber(frequency: npt.ArrayLike, sound_speed: npt.ArrayLike) -> Floats:
    f = np.asarray(frequency, float)
    if not np.all((f >= 0) & np.isfinite(f)):
        raise ValueError("frequency (Hz) must be a number, 0 or more")
    return np.asarray(2.0 * np.pi * f / _positive(sound_speed, "sound speed (m/s)"))


def _positive(value: npt.ArrayLike, name: str) -> Floats:
    number = np.asarray(value, float)
    if not np.all((number > 0) & np.isfinite(number)):
        raise ValueError(f"{name} must be a number above 0")
    return number
