"""Spheres near by, exactly: spherical waves of a point source at a point receiver."""

from __future__ import annotations

import numpy as np
from scipy.special import eval_legendre, spherical_jn, spherical_yn

from sonarsynth.conventions import Floats


def exact_sphere(
    frequency: Floats, c: float, radius: float, out: float, back: float, cosine: float, *, rigid: bool = True
) -> Floats:
    """Pressure (frequency,) that a sphere adds at a receiver for a source of unit pressure at 1 m, rigid or soft.

    Source and receiver are `out` and `back` (m) from its middle, at an angle of that cosine from there. With k = w/c,
    i k sum (2n+1) A_n h_n(k out) h_n(k back) P_n(cosine), Morse and Ingard (1968), section 8.2, conjugated.
    """
    total = []
    for k in 2.0 * np.pi * frequency / c:
        n = np.arange(int(k * radius + 4.05 * (k * radius) ** (1 / 3) + 20))
        h = [spherical_jn(n, x) + 1j * spherical_yn(n, x) for x in (k * out, k * back)]
        j = spherical_jn(n, k * radius, rigid)
        a = -j / (j + 1j * spherical_yn(n, k * radius, rigid))
        total.append(np.conj(1j * k * np.sum((2 * n + 1) * a * h[0] * h[1] * eval_legendre(n, cosine))))
    return np.array(total)
