"""Loud arrivals at one hydrophone: found, counted, and how many a process of snaps with many paths gives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from sonarsynth.conventions import Floats, Ints

APART = 0.5e-3
"""s: what exceeds a level again within this time belongs to the same arrival. Filtered snaps ring for as long."""


class CountMoments(NamedTuple):
    """Arrivals of a Poisson process of snaps, each of which arrives several times."""

    rate: float  # 1/s
    fano: float  # variance of their number in long windows over its mean: 1 where each snap arrives once


def loud_arrivals(pressure: Floats, level: float, rate: float, apart: float = APART) -> Ints:
    """First samples (arrival,) of what exceeds a level (the unit of the pressure) in samples (sample,) at a rate (Hz),
    after at least `apart` (s) below it."""
    above = np.flatnonzero(np.abs(pressure) > level)
    return above[np.diff(above, prepend=-np.inf) > apart * rate]


def fano_factor(counts: Ints) -> float:
    """Variance over mean of counts (window,): 1 on average for a Poisson process, with a standard deviation of
    sqrt(2/(windows - 1)). NaN without a count, or of one window. Source: Fano (1947), Phys. Rev. 72, 26."""
    mean = float(np.mean(counts)) if len(counts) > 1 else 0.0
    return float(np.var(counts, ddof=1)) / mean if mean > 0.0 else float("nan")


def path_counts(
    gain: Floats, delay: Floats, weight: Floats, source: tuple[float, float], levels: Floats
) -> list[CountMoments]:
    """Moments of the number of arrivals above each level (level,) in dB, of snaps that are Poisson in place and time.

    gain (place, path): dB from the source level to what arrives; delay (place, path) s; weight (place,): snaps/s there;
    source: mean and standard deviation (dB) of source levels, normal. Paths within `APART` of the one before count
    once; and so do snaps: of arrivals of a rate R, R exp(-R APART) are found (a paralysable counter; Feller 1948),
    which leaves 1 - 2 R APART of the Fano factor. Waves that overlap do not interfere.
    """
    order = np.argsort(-gain, axis=1)
    louder, late = (np.take_along_axis(x, order, axis=1) for x in (gain, delay))
    groups = np.ones(gain.shape)
    for paths in range(2, gain.shape[1] + 1):
        groups[:, paths - 1] += (np.diff(np.sort(late[:, :paths], axis=1), axis=1) > APART).sum(axis=1)
    moments = []
    for level in levels.tolist():
        reached = ndtr((source[0] + louder - level) / max(source[1], 1e-9))  # (place, path): so many paths, or more
        exactly = reached - np.append(reached[:, 1:], np.zeros((len(gain), 1)), axis=1)
        first, second = (float(weight @ (exactly * groups**power).sum(axis=1)) for power in (1, 2))
        fano = second / first * max(1.0 - 2.0 * first * APART, 0.0) if first > 0.0 else 1.0
        moments.append(CountMoments(first * np.exp(-first * APART), fano))
    return moments
