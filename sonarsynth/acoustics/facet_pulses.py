"""How a facet changes the pulse that it echoes: the factor on its spectrum, beside amplitude and delay.

A smooth facet differentiates the pulse and takes its mean over the facet, i f/f_c 2 exp[-i 2 pi f t_0, t_1, t_2] with
the delays t of its corners about its middle (`kirchhoff`, with amplitude k_c A |n.(ki - ks)|/(4 pi) at f_c). A rough
one sends, without phase in common, what is missing from that: sqrt(1 - w exp(-g^2)), g = 2 pi f t_h with the rms delay
t_h = h n.(ks - ki)/c of its heights (`roughness`), w the share of the lobe in its power, the rest being Lambert's.
"""

from __future__ import annotations

import numpy as np

from sonarsynth.acoustics.kirchhoff import Complexes, divided_exponential
from sonarsynth.conventions import Bools, Floats


def facet_response(
    frequency: Floats, coherent: Bools, corners: Floats, rough_share: Floats, rough_delay: Floats, centre: float
) -> Complexes:
    """Factor (path, bin) on the spectra of pulses at frequencies (bin,) (Hz), exact.

    coherent, rough_share, rough_delay (path,) and corners (path, 3) in s as in `products.Arrivals`; centre f_c (Hz).
    """
    omega = 2.0 * np.pi * frequency
    delay = corners[:, None, :]
    mean = 2.0 * divided_exponential(-omega[:, None] * delay) if corners.any() else np.ones((len(corners), 1), complex)
    slope = np.where(coherent[:, None], 1j * frequency / centre, 1.0)
    g = np.multiply.outer(rough_delay, omega)
    share = rough_share[:, None]
    with np.errstate(over="ignore"):
        left = np.sqrt((1.0 - share) - share * np.expm1(-g * g))
    return np.asarray(mean * slope * left)
