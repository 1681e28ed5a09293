"""A ray through one layer in which the sound speed is linear in depth: stable sums without a special case.

A ray keeps p = cos(grazing angle)/c. Sines of grazing angles are never taken from p: with c_m the largest speed that
the ray meets and s_m its sine there, s = sqrt(s_m^2 + p^2 (c_m - c)(c_m + c)) is a sum of positive terms. Nothing
divides by the gradient, takes the logarithm of a ratio near 1 or an arc cosine, so g = 0, vertical and horizontal rays
need no case of their own. Everything follows from Snell's law and dz = ds sin: e.g. Jensen, Kuperman, Porter and
Schmidt (2011), Computational Ocean Acoustics, section 3.3, brought to a form that does not cancel.
"""

from __future__ import annotations

import math

from sonarsynth.compiling import compiled


@compiled(borrows=True)
def atanhc(x: float) -> float:
    """artanh(x)/x, 1 at 0."""
    if abs(x) < 0.02:
        y = x * x
        return 1.0 + y * (1 / 3 + y * (1 / 5 + y * (1 / 7 + y * (1 / 9 + y / 11))))
    return math.atanh(x) / x


@compiled(borrows=True)
def atanc(x: float) -> float:
    """arctan(x)/x, 1 at 0."""
    if abs(x) < 0.02:
        y = x * x
        return 1.0 - y * (1 / 3 - y * (1 / 5 - y * (1 / 7 - y * (1 / 9 - y / 11))))
    return math.atan(x) / x


@compiled(borrows=True)
def asinhc(x: float) -> float:
    """arsinh(x)/x, 1 at 0."""
    if abs(x) < 0.02:
        y = x * x
        return 1.0 - y * (1 / 6 - y * (3 / 40 - y * (5 / 112 - y * (35 / 1152 - y * 63 / 2816))))
    return math.asinh(x) / x


@compiled(borrows=True)
def layer_time(p: float, c1: float, c2: float, s1: float, s2: float, thickness: float) -> float:
    """Travel time (s) through a layer with end speeds c1, c2 and sines s1, s2 (artanh((s1-s2)/(1-s1 s2))/g)."""
    k = (c1 + c2) * (1.0 + s1 * s2) / ((s1 + s2) * (c1 * c1 + c2 * c2 - (p * c1 * c2) ** 2))
    return thickness * k * atanhc((c2 - c1) * k)


@compiled(borrows=True)
def layer_length(p: float, c1: float, c2: float, s1: float, s2: float, thickness: float) -> float:
    """Arc length (m) through a layer: radius 1/(p g) times the turn, whose half has the tangent p (c2-c1)/(s1+s2)."""
    return 2.0 * thickness / (s1 + s2) * atanc(p * (c2 - c1) / (s1 + s2))


@compiled(borrows=True)
def turn_time(tangent: float, inverse_gradient: float) -> float:
    """Travel time (s) from where the grazing angle has this tangent down to the turning point: artanh(sin)/g."""
    return math.asinh(tangent) * inverse_gradient


@compiled(borrows=True)
def turn_length(p: float, tangent: float, inverse_gradient: float) -> float:
    """Arc length (m) from where the grazing angle has this tangent to the turning point: angle/(p g)."""
    return math.atan(tangent) * inverse_gradient / p


@compiled(borrows=True)
def chord_time(chord: float, c1: float, c2: float, gradient: float) -> float:
    """Travel time (s) along the arc over a chord (m) in one layer, from the end speeds; it may hold a turning point.

    T = (2/|g|) arsinh(|g| S / (2 sqrt(c1 c2))), exact for a linear profile.
    """
    mean = math.sqrt(c1 * c2)
    return chord / mean * asinhc(0.5 * gradient * chord / mean)
