"""How bright reverberation is in time, and what few scatterers in place of many do to its speckle."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats

SINC, TAPERED = 2.0 / 3.0, 0.789
"""J = B int p^4/(int p^2)^2 of pulses p of bandwidth B: of a flat spectrum; of one with tapered edges."""


def contrast(per_pulse: npt.ArrayLike, spread: npt.ArrayLike = 1.0, shape: float = SINC) -> Floats:
    """<I^2>/<I>^2 (...) of the intensity I of scatterers with random signs, so many within the time 1/B: 2 + spread
    J/n. Of very many it is that of Gaussian noise, 2.

    spread: <a^4>/<a^2>^2 of their amplitudes; shape: J of the pulse. Source: Abraham and Lyons (2002), IEEE J. Ocean.
    Eng. 27, 800: finite numbers of scatterers give the K law, of shape 2 n/(spread J).
    """
    return np.asarray(2.0 + np.asarray(spread) * shape / np.asarray(per_pulse, float))


def scatterers_per_pulse(error: float, spread: float = 1.0, shape: float = SINC) -> float:
    """How many scatterers within 1/B make `contrast` err by no more than this part."""
    return 0.5 * spread * shape / error


def textured(contrast_of_speckle: float, patchiness: float) -> float:
    """Contrast where each patch is brighter or darker by a factor of the gamma law of mean 1 and this shape: of
    speckle alone times 1 + 1/shape. Source: Jakeman and Pusey (1976), IEEE Trans. Antennas Propag. 24, 806."""
    return contrast_of_speckle * (1.0 + 1.0 / patchiness)


def lambert_rate(time: npt.ArrayLike, height: float, mu: float, speed: float, absorption: float = 0.0) -> Floats:
    """Energy that arrives per second (...), over that of the pulse at 1 m, at a sonar that hears its own pulse from a
    bottom `height` (m) below, by Lambert's law: mu (h/r)^2 2 pi r (c/2)/r^4, r = c t/2; nothing before 2 h/c.

    time (s) after the pulse, absorption in dB/m. Source: Urick (1983), Principles of Underwater Sound, section 8.5.
    """
    r = 0.5 * speed * np.asarray(time, float)
    far = np.maximum(r, height)
    rate = mu * (height / far) ** 2 * np.pi * far * speed / far**4 * 10.0 ** (-0.2 * absorption * far)
    return np.asarray(np.where(r >= height, rate, 0.0))
