"""How a facet changes the pulse that it echoes: the factor on its spectrum, beside amplitude and delay.

A smooth facet differentiates the pulse and takes its mean over the facet, i f/f_c 2 exp[-i 2 pi f t_0, t_1, t_2] with
the delays t of its corners about its middle (`kirchhoff`, with amplitude k_c A |n.(ki - ks)|/(4 pi) at f_c). A rough
one sends, without phase in common, what is missing from that: sqrt(1 - w exp(-g^2)), g = 2 pi f t_h with the rms delay
t_h = h n.(ks - ki)/c of its heights (`roughness`), w the share of the lobe in its power, the rest being Lambert's.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Bools, Complexes, Floats
from sonarsynth.equations.scattering.kirchhoff_integral import divided_exponential


def facet_response(
    frequency: Floats,
    coherent: Bools,
    corners: Floats,
    coherent_fraction: Floats,
    height_delay_std: Floats,
    centre: float,
) -> Complexes:
    """Factor (path, bin) on the spectra of pulses at frequencies (bin,) (Hz), exact.

    coherent, coherent_fraction, height_delay_std (path,) and corners (path, 3) in s as in `products.Arrivals`; centre
    f_c (Hz).
    """
    slope = np.where(coherent[:, None], 1j * frequency / centre, 1.0)
    return np.asarray(
        facet_mean(frequency, corners) * slope * rough_factor(frequency, coherent_fraction, height_delay_std)
    )


def facet_mean(frequency: Floats, corners: Floats) -> Complexes:
    """Mean (path, bin) of the delays of facets, exp(-i 2 pi f t), between those of their corners (path, 3) (s)."""
    if not corners.any():
        return np.ones((len(corners), 1), complex)
    return 2.0 * divided_exponential(-2.0 * np.pi * frequency[:, None] * corners[:, None, :])


def rough_factor(frequency: Floats, share: Floats, delay: Floats) -> Floats:
    """What rough facets send without phase in common (path, bin), sqrt(1 - w exp(-g^2)): share w and delay (s)
    (path,)."""
    g = 2.0 * np.pi * np.multiply.outer(delay, frequency)
    with np.errstate(over="ignore"):
        return np.asarray(np.sqrt((1.0 - share[:, None]) - share[:, None] * np.expm1(-g * g)))


def mean_powers(corners: Floats, scale: float, count: int) -> Floats:
    """Means over facets of powers of the delay over `scale` (s), (t/scale)^j, j < count: (power, path).

    With corners (path, 3) (s) whose sum is 0, 2 exp[-i w t_0, t_1, t_2] = sum_j (-i w scale)^j mean_j/j!; mean_j =
    2 j! h_j/((j+2)! scale^j), h_0 = 1, h_1 = 0, h_j = -e2 h_(j-2) + e3 h_(j-3) as in
    `kirchhoff_integral.divided_exponential`.
    """
    a, b, c = np.ascontiguousarray((corners / scale).T)
    e2, e3 = a * (b + c) + b * c, a * b * c
    h = np.zeros((max(count, 3), a.size))
    h[0], h[2] = 1.0, -e2
    for j in range(3, count):
        h[j] = e3 * h[j - 3] - e2 * h[j - 2]
    degree = np.arange(len(h))
    return np.asarray((h * (2.0 / ((degree + 1.0) * (degree + 2.0)))[:, None])[:count])
