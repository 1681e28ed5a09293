"""Fewer bins for the energy of short sound: its spectrum is smooth, so that every third or fourth bin is enough.

Of sound that lasts T the power spectrum varies as cos(2 pi f tau), tau up to T, and no faster. A weighted sum over
every k-th bin is then that over all, but for the ends of the band, if k bins are less than 1/T: the weights are those
that err least over all such tau, each counting as much as the autocorrelation of sound of that length has of it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.products import Snapshots

LONGEST = 0.8
"""Longest sound of which energies are exact, over the inverse of the bins' distance. Images of the remus recipe: 0.005
dB rms within 20 dB of the brightest beam; with 1.0: 0.03."""
FEWEST = 16
"""Bins that are left, at least."""
WEIGHTED = 200
"""Most bins whose weights are solved for: of more, those in the middle weigh one. Over 600 to 1000 bins that changes
weights by 1e-4, and the sum by 1e-5 of what the weights leave wrong."""


def fewer_bins(snapshots: Snapshots, travel_time: float) -> Snapshots:
    """Every k-th bin of a window, weighted so that energies of beams are those of all bins; all, where sound lasts as
    long as the window.

    travel_time (s): of sound from the widest beam over half of the array, by which that spreads out what comes from
    elsewhere.
    """
    bins, lasting = len(snapshots.frequency), snapshots.lasting + travel_time
    step = min(int(1.0 / (snapshots.spacing * lasting)), bins // FEWEST)
    if step < 2:
        return snapshots
    chosen, weight = weighted_bins(bins, step)
    every = slice(int(chosen[0]), None, step)
    spectra = snapshots.spectra[:, every] * np.sqrt(weight).astype(np.float32)
    return replace(snapshots, frequency=snapshots.frequency[every], spacing=step * snapshots.spacing, spectra=spectra)


@lru_cache(maxsize=64)
def weighted_bins(bins: int, step: int) -> tuple[Ints, Floats]:
    """Every `step`-th of so many bins, and weights, about one, with which `step` times their sum is that over all."""
    chosen = np.arange((bins - 1) % step // 2, bins, step)
    unweighted = len(chosen) - WEIGHTED
    if unweighted > 0:
        ends = weighted_bins(bins - unweighted * step, step)[1]
        return chosen, np.insert(ends, WEIGHTED // 2, np.ones(unweighted))
    longest = LONGEST / step  # periods of a cosine over a bin
    turns = 2.0 * np.pi * np.linspace(0.0, longest, int(6 * bins * longest) + 8)
    counts = np.sqrt(1.02 - turns / turns[-1])[:, None]
    offset, all_offsets = chosen - 0.5 * (bins - 1), np.arange(bins) - 0.5 * (bins - 1)
    cosine, sine = (counts * wave(np.outer(turns, offset)) for wave in (np.cos, np.sin))
    total = counts[:, 0] * np.cos(np.outer(turns, all_offsets)).sum(axis=1)
    wrong = np.concatenate([total / step - cosine.sum(axis=1), -sine.sum(axis=1), np.zeros(len(chosen))])
    change = np.linalg.lstsq(np.concatenate([cosine, sine, np.eye(len(chosen)) / step]), wrong, rcond=None)[0]
    return chosen, np.maximum(1.0 + change, 0.0)
