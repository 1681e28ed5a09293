"""Second and fourth moments of a chorus: snaps that are Poisson in place, on a plane, and in time (Campbell's theorem).

Boundaries are taken for rough or the many images for incoherent: their energies add. Sources: Rice (1944), Bell System
Technical Journal 23, 282, sections 1.3 and 1.5; Campbell (1909), Proc. Cambridge Phil. Soc. 15, 117.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats

NODES = 24
"""Of a quadrature in the logarithm of the distance, a factor of two or so each."""

Reflected = Callable[[Floats, Floats], Floats]
"""Share of the energy (image, node) that the reflections of each image leave, of horizontal distances (node,) and
path lengths (image, node) in m."""


class RingMoments(NamedTuple):
    """What snaps of 1 Pa at 1 m, one for each m2 and s, between two distances bring together."""

    spectrum: Floats  # (bin,) 1: times |S(f)|^2 and 2, a one-sided power spectral density
    square: float  # Pa2: mean square pressure
    fourth: float  # Pa4: fourth cumulant


class PulsePower(NamedTuple):
    """A snap of 1 Pa at 1 m as the moments take it."""

    frequency: Floats  # (bin,) Hz, in equal steps
    power: Floats  # (bin,) (Pa s)^2: |S(f)|^2 behind the filter
    absorbed: Floats  # (bin,) Np/m of power, at those frequencies
    duration: float  # s: (int s^2)^2 / int s^4


def level_moment(level: float, deviation: float, power: int) -> float:
    """E[A^power] in Pa^power of a source level that is normal: dB re 1 uPa at 1 m, mean and standard deviation."""
    spread = deviation * np.log(10.0) / 20.0
    return float((REFERENCE_PRESSURE * 10.0 ** (level / 20.0)) ** power * np.exp(0.5 * (power * spread) ** 2))


def effective_duration(pressure: Floats, step: float) -> float:
    """(int s^2)^2 / int s^4 in s of samples (sample,) of a pulse, `step` (s) apart: of a rectangle, its length."""
    return float(step * np.sum(pressure**2) ** 2 / np.sum(pressure**4))


def ring_moments(low: float, high: float, heights: Floats, reflected: Reflected, pulse: PulsePower) -> RingMoments:
    """Moments of the snaps at horizontal distances low to high (m, above 0), by images at heights (image,) in m.

    spectrum = int 2 pi rho drho sum_k V_k^2 exp(-alpha r_k)/r_k^2; square = 2 int |S|^2 spectrum df; and fourth =
    int 2 pi rho drho sum_k (V_k^2 E(r_k)/r_k^2)^2/T, with E(r) the energy of a snap and T its duration, both without
    what absorption does to T: it makes pulses longer, so that the fourth moment is a bound.
    """
    x, weight = np.polynomial.legendre.leggauss(NODES)
    rho = np.exp(0.5 * (np.log(low) + np.log(high)) + 0.5 * np.log(high / low) * x)
    area = np.pi * np.log(high / low) * weight * rho**2  # 2 pi rho drho
    length = np.hypot(rho, heights[:, None])
    share = reflected(rho, length) / length**2
    transmitted = np.exp(-np.multiply.outer(length, pulse.absorbed))  # (image, node, bin)
    spectrum = np.einsum("n,kn,knb->b", area, share, transmitted)
    step = pulse.frequency[1] - pulse.frequency[0]
    energy = 2.0 * step * (transmitted @ pulse.power)
    square = float(np.einsum("n,kn,kn->", area, share, energy))
    fourth = float(np.einsum("n,kn->", area, (share * energy) ** 2)) / pulse.duration
    return RingMoments(spectrum, square, fourth)


def power_spectrum(density: float, mean_square: float, spectrum: Floats, power: Floats) -> Floats:
    """One-sided power spectral density (bin,) in Pa2/Hz of a chorus: 2 lambda E[A^2] |S|^2 times that of its rings."""
    return np.asarray(2.0 * density * mean_square * power * spectrum)


def excess_kurtosis(density: float, deviation: float, square: float, fourth: float) -> float:
    """Of the pressure: exp(4 s^2) fourth/(density square^2), s the standard deviation of the source level in Np; 0 is
    that of Gaussian noise. density: snaps/(m2 s)."""
    spread = deviation * np.log(10.0) / 20.0
    return float(np.exp(4.0 * spread**2) * fourth / (density * square**2))
