"""How many nodes stand for an interval of waves, and how the waves are interpolated from them.

A wave exp(i k x), |x| <= 1, |k| <= p, has about 2 p/pi degrees of freedom, and a few more for its ends. Polynomials
spend pi/2 times as many nodes on them, so the interpolation is fitted to the waves themselves (the idea of the prolate
spheroidal functions of Slepian and Pollak, 1961, by least squares); where that loses to rounding, at tolerances near
1e-9, polynomials serve. Each error is measured, not estimated.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, inf, log
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats

MOST_NODES = 96
"""Most nodes in one dimension; a tile that needs more is split."""

MOST_FITTED = 20.0
"""Largest half range of phase (rad) that waves are fitted for: beyond it that takes long, and tiles are split."""

WIDER = 1.05
"""Waves are fitted up to so many times the phase that they are needed for."""

DEGREES = 4
"""Degrees, from 0 on, of the polynomials that a wave may be multiplied by."""

SpectralQuantiles = tuple[float, ...]
"""Frequencies, over the highest, that halve each eighth of the pulse's spectrum: what an error at a frequency
weighs."""


class Axis(NamedTuple):
    """Chebyshev nodes in (-1, 1), and what they interpolate."""

    nodes: int
    phase: float = inf  # rad, half range of the waves that are fitted; inf for polynomials
    weights: SpectralQuantiles = ()  # of the frequencies that they are fitted for


def rounded_up(value: float, by: float = 1.1) -> float:
    """A number above zero rounded up to the next power of `by`; what is below 1e-12 to zero."""
    if not 1e-12 < value < inf:
        return 0.0 if value <= 1e-12 else inf
    return float(by ** ceil(log(value) / log(by)))


@lru_cache(maxsize=256)
def chebyshev(count: int) -> Floats:
    """Chebyshev nodes of the first kind (node,) in (-1, 1)."""
    return np.asarray(np.cos(np.pi * (np.arange(count) + 0.5) / count))


@lru_cache(maxsize=256)
def analysis(count: int) -> Floats:
    """Matrix (degree, node) from values at Chebyshev nodes to Chebyshev coefficients."""
    degree = np.arange(count)
    weight = np.where(degree > 0, 2.0, 1.0)[:, None] / count
    return np.asarray(weight * np.cos(np.outer(degree, np.pi * (degree + 0.5) / count)))


def interpolation(x: Floats, axis: Axis) -> Floats:
    """Matrix (point, node) from values at the nodes to points x (point,) in [-1, 1]."""
    if axis.phase == inf:
        return np.asarray(polynomials(x, axis.nodes) @ analysis(axis.nodes))
    return np.asarray(_waves(x, axis) @ _fit(axis))


def polynomials(x: Floats, count: int) -> Floats:
    """Chebyshev polynomials (point, degree) at x (point,), -1 to 1, of degrees below `count`."""
    value = np.ones((count, x.size))
    value[1:2] = np.clip(x, -1.0, 1.0)
    for degree in range(2, count):
        value[degree] = 2.0 * value[1] * value[degree - 1] - value[degree - 2]
    return np.ascontiguousarray(value.T)


def _waves(x: Floats, axis: Axis) -> Floats:
    """Waves (point, function) at points: cosines and sines, weighed as paths within the phase and the colours give."""
    point, weight = _gauss(ceil(WIDER * axis.phase) + 16)
    k = 0.5 * WIDER * (1.0 + point)
    weight = weight * np.mean([(k < WIDER * w) / w for w in axis.weights], axis=0)
    positive = weight > 0.0
    angle = np.outer(x, axis.phase * k[positive])
    return np.asarray(np.concatenate([np.cos(angle), np.sin(angle)], axis=1) * np.sqrt(np.tile(weight[positive], 2)))


@lru_cache(maxsize=256)
def _gauss(count: int) -> tuple[Floats, Floats]:
    """Points and weights (count,) of Gauss and Legendre."""
    return np.polynomial.legendre.leggauss(count)


@lru_cache(maxsize=1024)
def _fit(axis: Axis) -> Floats:
    return np.asarray(np.linalg.pinv(_waves(chebyshev(axis.nodes), axis), rcond=1e-15))


@lru_cache(maxsize=4096)
def _errors(axis: Axis, phase: float, weights: SpectralQuantiles) -> tuple[float, ...]:
    """Largest errors (degree,) of T_d(x) exp(i k x), |k| <= `phase` at the highest frequency, mean over the colours."""
    x = np.cos(np.linspace(0.0, np.pi, 4 * axis.nodes + 17))
    k = np.linspace(0.0, 1.0, 17 + 2 * int(phase))
    at, onto = chebyshev(axis.nodes), interpolation(x, axis)
    waves, angles = [np.exp(1j * phase * np.outer(y, k)) for y in (x, at)], [np.arccos(y) for y in (x, at)]
    errors = []
    for d in range(DEGREES):
        exact, at_nodes = (np.cos(d * angle)[:, None] * wave for angle, wave in zip(angles, waves, strict=True))
        worst = np.maximum.accumulate(np.abs(exact - onto @ at_nodes).max(axis=0))
        errors.append(float(np.interp(weights, k, worst).mean()))
    return tuple(errors)


@lru_cache(maxsize=1)
def _tails() -> tuple[Floats, Floats]:
    """Half ranges of phase (rad), and the error (node count - 1, phase) of interpolating a wave at n = 1, 2, ... nodes.

    exp(i x t) is the sum of 2 i^n J_n(x) T_n(t), |t| <= 1. At n nodes T_n is taken for nothing and T_(n+j) for
    -T_(n-j), so that the error is 2 J_n and up to 4 of each that follows; three hold it where it is small. The J_n of
    a phase, to 1e-15, are the Fourier coefficients of exp(i x sin a) over a turn, here of its real and imaginary part
    in one: cosines are in even ones, sines in odd ones (Abramowitz and Stegun 9.1.42 and 43).
    """
    phase = np.concatenate([[0.0], np.geomspace(1e-13, 0.1, 120), np.arange(0.15, 1.1 * MOST_NODES, 0.1)])
    angle = np.outer(phase, np.sin(2.0 * np.pi * np.arange(4 * MOST_NODES) / (4 * MOST_NODES)))
    bessel = np.abs(np.fft.rfft(np.cos(angle) + np.sin(angle), norm="forward"))
    size = bessel[:, 1 : MOST_NODES + 3].T
    return phase, 2.0 * size[:-2] + 4.0 * (size[1:-1] + size[2:])


@lru_cache(maxsize=64)
def _mean_tails(weights: SpectralQuantiles) -> Floats:
    """Error (node count - 1, phase) at the phases of `_tails`, mean over the colours; never falls with phase."""
    phase, tails = _tails()
    mean = np.mean([[np.interp(phase * w, phase, tail) for tail in tails] for w in weights], axis=0)
    return np.maximum.accumulate(mean, axis=1)


@lru_cache(maxsize=4096)
def _by_polynomials(phase: float, weights: SpectralQuantiles, tolerance: float, degrees: tuple[float, ...]) -> int:
    at = int(np.searchsorted(_tails()[0], phase))
    if at == _tails()[0].size or not np.isfinite(degrees).all():
        return MOST_NODES + 1
    tail = _mean_tails(weights)[:, at]
    bound = degrees[0] * tail
    for d, size in enumerate(degrees[1:], start=1):
        # times T_d, the coefficient of T_n is half of those that were of T_(n-d) and T_(n+d)
        bound[:d] += 2.0 * size
        bound[d:] += 0.5 * size * (tail[:-d] + tail[d:])
    return int(np.argmax(np.append(bound, 0.0) <= tolerance)) + 1


def polynomials_for(phase: float, weights: SpectralQuantiles, tolerance: float, degrees: tuple[float, ...]) -> Axis:
    """As `nodes_for`, by polynomials, which more nodes may then be given for what is no wave."""
    return Axis(_by_polynomials(rounded_up(phase, 1.04), weights, tolerance, tuple(map(rounded_up, degrees))))


def nodes_for(phase: float, weights: SpectralQuantiles, tolerance: float, degrees: tuple[float, ...] = (1.0,)) -> Axis:
    """Nodes that interpolate waves of phase within +-`phase` (rad) to `tolerance`; MOST_NODES + 1 where none do.

    The waves may bear an amplitude that is a polynomial: `degrees` bounds its Chebyshev coefficients of degree 0 to 3.
    Phase is rounded up by at most 4 %, degrees by a tenth, so that choices are kept from frame to frame.
    """
    return _nodes(rounded_up(phase, 1.04), weights, tolerance, tuple(map(rounded_up, degrees)))


@lru_cache(maxsize=4096)
def _nodes(wide: float, weights: SpectralQuantiles, tolerance: float, sizes: tuple[float, ...]) -> Axis:
    most = _by_polynomials(wide, weights, tolerance, sizes)
    if most == 1 or wide > MOST_FITTED or max(sizes) == inf:
        return Axis(most)

    def good(n: int) -> bool:
        errors = _errors(Axis(n, wide, weights), wide, weights)
        return sum(size * error for size, error in zip(sizes, errors, strict=False)) <= tolerance

    n = min(int(2.0 * wide / np.pi) + 4, most)
    while n < most and not good(n):
        n += 1
    while n > 1 and good(n - 1):
        n -= 1
    return Axis(n, wide, weights) if n < most else Axis(most)
