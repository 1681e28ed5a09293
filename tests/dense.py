"""Delay and sum in float64, every sensor in every beam: what fast beams are compared with."""

from __future__ import annotations

import numpy as np

BEAMS_AT_ONCE = 128


def dense_energies(spectra, delay, weight, frequencies):
    """Sum over bins of |sum_q weight_q spectra_q exp(+i 2 pi f delay_q)|^2: (beam,), in float64.

    spectra (sensor, bin), delay (beam, sensor) s, weight (sensor,), frequencies (bin,) Hz, evenly spaced: each bin's
    phasors are those of the bin before, turned on (1e-16 a bin).
    """
    live = np.flatnonzero(weight)
    weighted = np.conj((weight[live, None] * spectra[live]).T)
    first, spacing = frequencies[0], frequencies[1] - frequencies[0] if len(frequencies) > 1 else 1.0
    energy = np.zeros(len(delay))
    for start in range(0, len(delay), BEAMS_AT_ONCE):
        block = slice(start, start + BEAMS_AT_ONCE)
        turn = np.exp(2j * np.pi * spacing * delay[block][:, live])
        phasor = np.exp(2j * np.pi * first * delay[block][:, live])
        for spectrum in weighted:
            energy[block] += np.abs(np.vecdot(spectrum, phasor)) ** 2  # row by row: threads would wait for each other
            phasor *= turn
    return energy
