"""The snap of a snapping shrimp: a bubble that grows as an error function and collapses as a logarithm.

    R(t) = a (1 + erf(k (t - m)/sqrt 2)) ln(1 + q t) for t <= 0, and 0 after;   p(t) = (rho/r) d(R^2 R')/dt

The constants of the source are printed in another order (b, c, d for q, k, m), and its pressure lacks rho/r: this is
the only order and unit in which the bubble is bounded and collapses at a physical speed. Derivatives are analytic:
differences of R are wrong by half the peak at 196 kHz. R' jumps at the collapse, but R^2 R' does not, so the pressure
has a corner and no delta.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.special import erfc

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.kernels.fourier_sums import fourier_sums


class Bubble(NamedTuple):
    """Constants of the bubble, SI."""

    a: float  # m, size
    k: float  # 1/s, growth rate
    m: float  # s, middle of the growth (negative)
    q: float  # 1/s, collapse rate (negative)
    density: float  # kg/m3 of the water


class Wall(NamedTuple):
    """Radius of the bubble and its derivatives, of the shape of the times."""

    radius: Floats  # m
    speed: Floats  # m/s
    acceleration: Floats  # m/s2


def wall(time: npt.ArrayLike, bubble: Bubble) -> Wall:
    """Radius R and its derivatives R', R'' at times (s) before the collapse at 0; zero after it, the limit from below
    at 0."""
    requested = np.asarray(time, float)
    t = np.minimum(requested, 0.0)  # before the logarithm, which is singular at -1/q > 0
    a, k, m, q, _ = bubble
    z = k * (t - m) / np.sqrt(2.0)
    growth = erfc(-z)  # 1 + erf z without cancellation far before the growth
    growth1 = np.sqrt(2.0 / np.pi) * k * np.exp(-z * z)
    growth2 = -k * k * (t - m) * growth1
    collapse = np.log1p(q * t) + 0.0  # not -0
    collapse1 = q / (1.0 + q * t)
    collapse2 = -collapse1 * collapse1
    alive = np.where(requested <= 0.0, a, 0.0)
    return Wall(
        alive * growth * collapse,
        alive * (growth1 * collapse + growth * collapse1),
        alive * (growth2 * collapse + 2.0 * growth1 * collapse1 + growth * collapse2),
    )


def pressure(time: npt.ArrayLike, bubble: Bubble) -> Floats:
    """Pressure (Pa) at 1 m: rho R (R R'' + 2 R'^2), of a small pulsating bubble (a monopole); 0 after the collapse."""
    R, R1, R2 = wall(time, bubble)
    return np.asarray(bubble.density * R * (R * R2 + 2.0 * R1 * R1))


def impulse(time: npt.ArrayLike, bubble: Bubble) -> Floats:
    """Integral (Pa s) of the pressure at 1 m up to a time: rho R^2 R'. It vanishes at both ends: no net impulse."""
    R, R1, _ = wall(time, bubble)
    return np.asarray(bubble.density * R * R * R1)


def onset(bubble: Bubble) -> float:
    """Time (s, negative) before which the bubble is under 1e-17 of its size, so that its pressure is nothing."""
    return bubble.m - 8.5 / bubble.k


@lru_cache(maxsize=64)
def peak(bubble: Bubble) -> tuple[float, float]:
    """Time (s) and size (Pa) of the largest pressure at 1 m."""
    x = np.geomspace(1e-4 / abs(bubble.q), -onset(bubble), 4096)
    for _ in range(7):  # each look is at 1/32 of the one before
        i = int(np.clip(np.argmax(pressure(-x, bubble)), 1, x.size - 2))
        x = np.linspace(x[i - 1], x[i + 1], 65)
    at = np.argmax(pressure(-x, bubble))
    return -float(x[at]), float(pressure(-x[at], bubble))


@lru_cache(maxsize=64)
def quadrature(bubble: Bubble, highest: float) -> tuple[Floats, Floats]:
    """Nodes x (s before the collapse) and weights of an integral over the snap times waves up to `highest` (Hz).

    Gauss-Legendre panels that grow by half from a quarter of the collapse time, because the logarithm is singular just
    after the collapse, up to three periods, or half the growth time.
    """
    node, weight = np.polynomial.legendre.leggauss(24)
    largest = min(0.5 / bubble.k, 3.0 / highest if highest > 0 else np.inf)
    edges, width = [0.0], 0.25 / abs(bubble.q)
    while edges[-1] < -onset(bubble):
        edges.append(edges[-1] + min(width, largest))
        width *= 1.5
    middle, half = 0.5 * (np.array(edges[1:]) + edges[:-1]), 0.5 * np.diff(edges)
    return (middle[:, None] + half[:, None] * node).ravel(), (half[:, None] * weight).ravel()


def spectrum(frequency: npt.ArrayLike, bubble: Bubble) -> Complexes:
    """Spectrum (Pa s) of the pressure at 1 m, int p(t) exp(-i 2 pi f t) dt, at frequencies (Hz); to 1e-12 of its
    peak."""
    f = np.asarray(frequency, float)
    x, w = quadrature(bubble, float(np.abs(f).max(initial=0.0)))
    p = w * pressure(-x, bubble)
    return np.asarray(fourier_sums(f.ravel(), -x, p).reshape(f.shape))
