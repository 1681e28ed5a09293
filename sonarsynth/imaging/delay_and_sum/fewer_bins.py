"""Fewer bins for the energy of sound with silence in it: every second to fourth bin, say, is enough.

A sum over every k-th of bins df apart takes what comes 1/(k df), or a multiple of it, later in a beam for the same
sound: to the energy it adds their correlation. That is no more than the square root of both powers, summed over time,
which is none where one of both is silent. The ends of the band are weighted: so that the sum errs least over the power
spectra of sound that lasts T < 1/(k df), which vary as cos(2 pi f tau), tau up to T, each counting as much as the
autocorrelation of sound of that length has of it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.products import Snapshots

OVERLAP = 0.03
"""Of the energy of a window, what correlates at most. Within 20 dB of the brightest beam, images of remus.yaml err
by 0.01 dB rms with two bounces; by 0.02, and 0.3 at most, where it is 0.1."""
LONGEST = 0.8
"""Longest sound that the ends of the band are weighted for, over the inverse of the bins' distance."""
FEWEST = 83
"""Bins that are left, at least: of 64 the ends of the band err by 0.01 to 0.03 dB, of 83 by 0.001 to 0.03, 0.008
rms (remus.yaml)."""
WEIGHTED = 200
"""Most bins whose weights are solved for: of more, those in the middle weigh one. Over 600 to 1000 bins that changes
weights by 1e-4, and the sum by 1e-5 of what the weights leave wrong."""


def fewer_bins(snapshots: Snapshots, transit: float, widest: float = 1.0) -> Snapshots:
    """Every k-th bin of a window, weighted so that energies of beams are those of all bins; all, where sound lasts as
    long as the window. They are among those that ranging takes, where a part of the window has all of its sound.

    transit (s): of sound over half of the array; widest: sine of the angle to the widest beam.
    """
    bins, part = len(snapshots.frequency), snapshots.without_silence(transit)
    least = round(part.spacing / snapshots.spacing)
    step = _longest_step(snapshots, widest * transit, len(part.frequency) // FEWEST, least)
    if step < 2:
        return snapshots
    skipped = (len(part.frequency) - 1) % (step // least) // 2
    weight = weighted_bins(bins, step, round((part.frequency[skipped] - snapshots.frequency[0]) / snapshots.spacing))[1]
    few = part.having(part.spectra).every(step // least, skipped)
    return few.having(few.spectra * np.sqrt(weight).astype(np.float32))


def _longest_step(snapshots: Snapshots, travel_time: float, most: int, least: int) -> int:
    """From bin to bin, in steps of `least` with which `OVERLAP` is kept, and `most` of them: of all sensors together,
    give or take a block. travel_time (s): by which the array spreads out what comes from elsewhere."""
    rate, power = snapshots.sampling_frequency, snapshots.sample_power
    block = max(round(travel_time * rate), -(-len(power) // 256))
    amplitude = np.sqrt(np.add.reduceat(power, np.arange(0, len(power), block), dtype=float))
    shared = np.zeros(2 * len(amplitude) + 1)  # by blocks later
    shared[: len(amplitude)] = np.correlate(amplitude, amplitude, "full")[len(amplitude) - 1 :]
    about = np.maximum(shared[:-1], shared[1:])
    for step in range(most * least, least, -least):
        late = np.arange(1, step) * (rate / (step * snapshots.spacing * block))
        if 2.0 * about[late.astype(int)].sum() <= OVERLAP * shared[0]:
            return step
    return least


@lru_cache(maxsize=64)
def weighted_bins(bins: int, step: int, first: int | None = None) -> tuple[Ints, Floats]:
    """Every `step`-th of so many bins, from the `first` on or as many at either end left out, and weights, about one,
    with which `step` times their sum is that over all."""
    chosen = np.arange((bins - 1) % step // 2 if first is None else first, bins, step)
    unweighted = len(chosen) - WEIGHTED
    if unweighted > 0:
        ends = weighted_bins(bins - unweighted * step, step, int(chosen[0]))[1]
        return chosen, np.insert(ends, WEIGHTED // 2, np.ones(unweighted))
    longest = LONGEST / step  # periods of a cosine over a bin
    turns = 2.0 * np.pi * np.linspace(0.0, longest, int(6 * bins * longest) + 8)
    counts = (1.02 - turns / turns[-1])[:, None]
    offset, all_offsets = chosen - 0.5 * (bins - 1), np.arange(bins) - 0.5 * (bins - 1)
    cosine, sine = (counts * wave(np.outer(turns, offset)) for wave in (np.cos, np.sin))
    total = counts[:, 0] * np.cos(np.outer(turns, all_offsets)).sum(axis=1)
    wrong = np.concatenate([total / step - cosine.sum(axis=1), -sine.sum(axis=1), np.zeros(len(chosen))])
    change = np.linalg.lstsq(np.concatenate([cosine, sine, np.eye(len(chosen)) / step]), wrong, rcond=None)[0]
    return chosen, np.maximum(1.0 + change, 0.0)
