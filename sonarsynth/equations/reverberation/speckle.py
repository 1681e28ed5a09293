"""What few scatterers in place of many do to the speckle of reverberation."""

from __future__ import annotations

SINC = 2.0 / 3.0
"""J = B int p^4/(int p^2)^2 of pulses p of bandwidth B, of a flat spectrum; 0.789 with tapered edges."""


def scatterers_per_pulse(error: float, spread: float = 1.0, shape: float = SINC) -> float:
    """How many scatterers n within the time 1/B make the contrast <I^2>/<I>^2 of their intensity err by no more than
    this part: it is 2 + spread J/n, and 2 of very many, as of Gaussian noise.

    spread: <a^4>/<a^2>^2 of their amplitudes; shape: J of the pulse. Source: Abraham and Lyons (2002), IEEE J. Ocean.
    Eng. 27, 800: finite numbers of scatterers give the K law, of shape 2 n/(spread J).
    """
    return 0.5 * spread * shape / error
