"""Beams of an array: their spectra, and their energy.

The beam of direction u (unit vector to the source) is

    B(f) = sum_q g_q P_q(f) exp(+i 2 pi f tau_q) / sum_q g_q,

with tau_q the time by which sensor q hears a source at u later than the array centre does: a plane wave of pressure p
from u gives back p.
Source: any text on arrays, e.g. Van Trees (2002), Optimum Array Processing, sections 2.2 and 6.2.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.apertures import focus_delay, live_gain


def first_and_spacing(frequencies: Floats) -> tuple[float, float]:
    """First of evenly spaced frequencies (bin,) and the distance between two (Hz); 1 Hz where there is but one."""
    return float(frequencies[0]), float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 1.0


def beam_spectra(
    spectra: npt.NDArray[np.complex64],
    frequencies: Floats,
    position: npt.ArrayLike,
    gain: npt.ArrayLike,
    directions: npt.ArrayLike,
    sound_speed: float,
    focus: float | None,
) -> npt.NDArray[np.complex64]:
    """Spectra (beam, bin) of beams steered in `directions` (beam, xyz) and focused at `focus` (m; None: plane waves).

    spectra (sensor, bin) at evenly spaced frequencies (bin,) Hz; position (sensor, xyz) m; gain (sensor,), 0 for a dead
    element. Any array, exact spherical delays, float32 sums: error 2e-6 of the largest |B|. Raises ValueError when no
    element is live.
    """
    from sonarsynth.equations.kernels.phasors import steered_sums

    weight = live_gain(gain)
    u = np.asarray(directions, float)
    delay = focus_delay(position, u, focus, sound_speed)
    return steered_sums(spectra, delay, weight, *first_and_spacing(frequencies))
