"""Spectra in decibels and in 1/3 octaves."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats


def decibels(power: Floats) -> Floats:
    """10 log10 of powers (...); minus infinity of 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(10.0 * np.log10(power))


def octave_bands(low: float, high: float) -> tuple[Floats, Floats]:
    """Centres (band,) and edges (band, 2) in Hz of the 1/3 octaves that lie within a band. Source: IEC 61260-1 (2014),
    base 10."""
    number = np.arange(np.ceil(10.0 * np.log10(low)), np.floor(10.0 * np.log10(high)) + 1.0)
    centre = 10.0 ** (number / 10.0)
    edge = centre[:, None] * 10.0 ** np.array([-0.05, 0.05])
    inside = (edge[:, 0] >= low) & (edge[:, 1] <= high)
    return centre[inside], edge[inside]


def band_means(frequency: Floats, density: Floats, edges: Floats) -> Floats:
    """Mean densities (band,) of bins (bin,) whose frequencies lie within edges (band, 2); NaN without a bin."""
    masks = [(frequency >= low) & (frequency < high) for low, high in edges.tolist()]
    return np.array([float(density[inside].mean()) if inside.any() else np.nan for inside in masks])
