"""Polynomials through values at a few probes, compiled; as in `row_products`, rows do not round each other."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats


@compiled
def fits(values: Floats, solve: Floats, basis: Floats) -> tuple[Floats, Floats]:
    """Coefficients (row, term) of polynomials through values (row, probe), and the largest of what they miss these by
    (row,), inf where a value is NaN. solve (fitted, term): values at the first probes to coefficients; basis (term,
    probe)."""
    out, missed = np.zeros((len(values), len(basis))), np.empty(len(values))
    fitted = np.empty(values.shape[1])
    for i in range(len(values)):
        coefficient = out[i]
        fitted[:], missed[i] = 0.0, 0.0
        for k in range(len(solve)):
            value = 0.0 if math.isnan(values[i, k]) else values[i, k]
            for t in range(len(coefficient)):
                coefficient[t] += value * solve[k, t]
        for t in range(len(coefficient)):
            for j in range(len(fitted)):
                fitted[j] += coefficient[t] * basis[t, j]
        for j in range(len(fitted)):
            wrong = abs(values[i, j] - fitted[j])
            missed[i] = np.inf if math.isnan(wrong) else max(missed[i], wrong)
    return out, missed


@compiled
def gains(
    law: Floats, amplitude: Floats, probe_gain: Floats, tapered: Bools, strength: Floats
) -> tuple[Floats, Floats, float]:
    """Amplitudes at probes (row, probe) by a law, and by what the way to each adds, over those at the centre (row,);
    and strengths (row,), 0 of rows that are nothing at some probe: there the gain is 1 unless they are tapered (row,).
    The last is the largest product of both."""
    gain, counted, loudest = np.empty(law.shape), np.empty(len(law)), 0.0
    for i in range(len(law)):
        ends = False
        for j in range(law.shape[1]):
            ends = ends or law[i, j] == 0.0
            gain[i, j] = law[i, j] / amplitude[i] * probe_gain[i, j]
        if ends and not tapered[i]:
            gain[i] = 1.0
        counted[i] = 0.0 if ends else abs(strength[i])
        for j in range(law.shape[1]):
            loudest = max(loudest, counted[i] * abs(gain[i, j]))
    return gain, counted, loudest
