"""Symmetric alpha-stable laws, of characteristic function exp(-|c t|^alpha): tails, and an estimate.

alpha 2 is the Gaussian law of variance 2 c^2, alpha 1 that of Cauchy. Exponents of 0.5 and less are refused: such noise
has not been heard, and the estimate is of no use there.
"""

from __future__ import annotations

from itertools import accumulate, repeat
from typing import NamedTuple

import numpy as np
from scipy.special import erfc, gamma

from sonarsynth.conventions import Floats

SMALLEST = 0.5
"""alpha is above this."""
NODES = 400
"""Of the integral of a tail: it is good to 3e-5."""
BESIDE_CAUCHY = 0.05
"""Nearer to 1, where the integral fails, tails are interpolated: between exponents so far below and above, and 1."""
FAR, TERMS = 10.0, 6
"""From there on tails are a sum of so many powers of x^-alpha."""
CHARACTERISTIC_POINTS = ((0.5, 56), (0.7, 20), (0.9, 18), (1.1, 15), (1.3, 14), (1.5, 11), (1.9, 10), (2.0, 9))
"""alpha, and at how many points t = pi k/25 the characteristic function is best fitted; Koutrouvelis (1980), table 1,
many samples."""
ROUNDS = 6
"""Of the fit, each at the scale and the points of the one before."""


class StableFit(NamedTuple):
    """A law that was fitted."""

    alpha: float
    scale: float  # c, in the unit of the samples


def _check(alpha: float) -> None:
    if not SMALLEST < alpha <= 2.0:
        raise ValueError(f"alpha {alpha:g} is not above {SMALLEST:g} and at most 2")


def _fit(alpha: float, scale: float) -> StableFit:
    """A fit; what lies a little beyond 2 by chance is 2. Raises ValueError for an exponent that is refused."""
    if not (alpha > SMALLEST and 0.0 < scale < np.inf):
        raise ValueError(f"no stable law fits: alpha {alpha:.3g}")
    return StableFit(min(float(alpha), 2.0), float(scale))


def exceedance(x: Floats, alpha: float) -> Floats:
    """Probability (...) that the magnitude of a number of scale 1 is above x (...), 0 or more.

    Source: Zolotarev (1986), One-dimensional Stable Distributions, eq. 2.2.18; Nolan (1997), Comm. Statist. Stoch.
    Models 13, 759, theorem 1; far out: Bergstroem (1952), Arkiv foer Matematik 2, 375.
    """
    _check(alpha)
    x = np.asarray(x, float)
    if alpha == 2.0:
        return np.asarray(erfc(0.5 * x))
    near, far = np.minimum(x, FAR), np.maximum(x, FAR)
    k = np.arange(1.0, TERMS + 1.0)
    size = 2.0 / np.pi * (-1.0) ** (k + 1.0) * gamma(k * alpha) / gamma(k + 1.0) * np.sin(0.5 * np.pi * k * alpha)
    return np.asarray(np.where(x > FAR, far[..., None] ** (-k * alpha) @ size, _near(near, alpha)))


def _near(x: Floats, alpha: float) -> Floats:
    """`exceedance` by its integral; alpha is not 2."""
    if abs(offset := (alpha - 1.0) / BESIDE_CAUCHY) < 1.0:
        cauchy = 1.0 - 2.0 / np.pi * np.arctan(x)
        below, above = _near(x, 1.0 - BESIDE_CAUCHY), _near(x, 1.0 + BESIDE_CAUCHY)
        return np.asarray(cauchy + 0.5 * offset * (above - below) + 0.5 * offset**2 * (above - 2.0 * cauchy + below))
    power = alpha / (alpha - 1.0)
    u = (np.arange(NODES) + 0.5) / NODES
    angle, weight = 0.5 * np.pi * u**2 * (3.0 - 2.0 * u), 3.0 * np.pi * u * (1.0 - u) / NODES  # fine at both ends
    cosine, sine = np.cos(angle), np.sin(alpha * angle)
    log_v = power * (np.log(cosine) - np.log(sine)) + np.log(np.cos((alpha - 1.0) * angle)) - np.log(cosine)
    with np.errstate(over="ignore", divide="ignore"):
        inner = np.exp(-np.exp(power * np.log(x)[..., None] + log_v)) @ weight
    tail = 2.0 / np.pi * inner if alpha > 1.0 else 1.0 - 2.0 / np.pi * inner
    return np.asarray(np.where(x > 0.0, np.clip(tail, 0.0, 1.0), 1.0))


def fit_stable_law(values: Floats) -> StableFit:
    """From log(-log |phi(t)|^2) = log(2 c^alpha) + alpha log t, phi the characteristic function of samples (sample,).

    Raises ValueError where no law fits. Source: Koutrouvelis (1980), J. Am. Stat. Assoc. 75, 918, by ordinary least
    squares, from mean and variance of ln |x|, pi^2/6 (1/alpha^2 + 1/2) and gamma (1/alpha - 1) + ln c, as first guess
    (Ma and Nikias 1995, IEEE Trans. Signal Processing 43, 2669).
    """
    log = np.log(np.abs(values[values != 0.0]))
    if log.size < 2:
        raise ValueError("no stable law fits: all samples are 0")
    inverse = 6.0 / np.pi**2 * float(np.var(log)) - 0.5
    alpha = min(2.0, 1.0 / np.sqrt(max(inverse, 1e-12)))
    alpha, scale = _fit(alpha, float(np.exp(np.mean(log) - np.euler_gamma * (1.0 / alpha - 1.0))))
    alphas, points = np.transpose(CHARACTERISTIC_POINTS)
    for _ in range(ROUNDS):
        t = np.pi / 25.0 * np.arange(1, 1 + round(float(np.interp(alpha, alphas, points))))
        turn = np.exp(1j * t[0] * values / scale)
        power = np.abs([np.mean(phase) for phase in accumulate(repeat(turn, len(t)), np.multiply)]) ** 2
        usable = (power > 4.0 / len(values)) & (power < 1.0)
        if usable.sum() < 2:
            raise ValueError("no stable law fits the characteristic function")
        slope, start = np.polyfit(np.log(t[usable]), np.log(-np.log(power[usable])), 1)
        alpha, scale = _fit(slope, scale * float(np.exp((start - np.log(2.0)) / slope)))
    return StableFit(alpha, scale)
