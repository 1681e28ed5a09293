"""Symmetric alpha-stable laws, of characteristic function exp(-|c t|^alpha): samples, tails, and estimates.

alpha 2 is the Gaussian law of variance 2 c^2, alpha 1 that of Cauchy. Exponents of 0.5 and less are refused: such noise
has not been heard, and the estimates are of no use there.
"""

from __future__ import annotations

from functools import lru_cache
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


@lru_cache(maxsize=1)
def _quantiles() -> tuple[Floats, Floats, Floats]:
    """Exponents (row,), their ratio of 95 % to 75 % quantiles, and the latter, of scale 1."""
    from scipy.optimize import brentq

    alphas = np.append(np.linspace(0.52, 1.98, 74), 2.0)

    def quantile(alpha: float, tail: float) -> float:
        return float(np.exp(brentq(lambda y: float(exceedance(np.exp(y), alpha)) - tail, -5.0, 25.0)))

    middle, far = (np.array([quantile(a, tail) for a in alphas.tolist()]) for tail in (0.5, 0.1))
    return alphas, far / middle, middle


def fit_quantiles(values: Floats) -> StableFit:
    """From the 5, 25, 75 and 95 % quantiles of samples (sample,). Raises ValueError where no law fits.

    Source: McCulloch (1986), Comm. Statist. Simul. Comp. 15, 1109, with quantiles computed here in place of his table.
    """
    low, lower, upper, high = np.quantile(values, [0.05, 0.25, 0.75, 0.95])
    if not upper > lower:
        raise ValueError("no stable law fits: half of the samples are alike")
    alphas, ratio, middle = _quantiles()
    spread = (high - low) / (upper - lower)
    if spread > ratio[0]:
        raise ValueError(f"no stable law fits: alpha is at most {alphas[0]:g}")
    alpha = float(np.interp(-spread, -ratio, alphas))
    return _fit(alpha, 0.5 * (upper - lower) / float(np.interp(alpha, alphas, middle)))


def fit_characteristic_function(values: Floats) -> StableFit:
    """From log(-log |phi(t)|^2) = log(2 c^alpha) + alpha log t, phi the characteristic function of samples (sample,).

    Raises ValueError where no law fits. Source: Koutrouvelis (1980), J. Am. Stat. Assoc. 75, 918, by ordinary least
    squares, from the fit by quantiles as first guess.
    """
    alpha, scale = fit_quantiles(values)
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


def fit_log_moments(values: Floats) -> StableFit:
    """From mean and variance of ln |x| of samples (sample,) that are not 0: pi^2/6 (1/alpha^2 + 1/2), and
    gamma (1/alpha - 1) + ln c. Raises ValueError where no law fits.

    Source: Ma and Nikias (1995), IEEE Trans. Signal Processing 43, 2669.
    """
    log = np.log(np.abs(values[values != 0.0]))
    if log.size < 2:
        raise ValueError("no stable law fits: all samples are 0")
    inverse = 6.0 / np.pi**2 * float(np.var(log)) - 0.5
    alpha = min(2.0, 1.0 / np.sqrt(max(inverse, 1e-12)))
    return _fit(alpha, float(np.exp(np.mean(log) - np.euler_gamma * (1.0 / alpha - 1.0))))


ESTIMATORS = {
    "quantiles": fit_quantiles,
    "characteristic function": fit_characteristic_function,
    "log moments": fit_log_moments,
}
"""Of alpha and scale, by name."""
