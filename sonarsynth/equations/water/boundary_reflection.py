"""Reflection at the bottom and at the surface, smooth and rough.

Plane-wave coefficients for f > 0 in time dependence exp(+i 2 pi f t): below the critical angle of a fast bottom the
phase falls from pi at grazing to 0.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Complexes, Floats
from sonarsynth.equations.water import formula_ranges

SEDIMENTS: Final = MappingProxyType(
    {
        "rock": (2.5, 2.5, 0.01374),
        "pebbles": (2.5, 1.8, 0.01374),
        "sandy gravel": (2.492, 1.3370, 0.01705),
        "very coarse sand": (2.401, 1.3067, 0.01667),
        "muddy sandy gravel": (2.314, 1.2778, 0.01630),
        "coarse sand": (2.231, 1.2503, 0.01638),
        "gravelly muddy sand": (2.151, 1.2241, 0.01645),
        "medium sand": (1.845, 1.1782, 0.01624),
        "muddy gravel": (1.615, 1.1396, 0.01610),
        "fine sand": (1.451, 1.1073, 0.01602),
        "muddy sand": (1.339, 1.0800, 0.01728),
        "very fine sand": (1.268, 1.0568, 0.01875),
        "clayey sand": (1.224, 1.0364, 0.02019),
        "coarse silt": (1.195, 1.0179, 0.02158),
        "sandy silt": (1.169, 0.9999, 0.01261),
        "medium silt": (1.149, 0.9885, 0.00676),
        "sandy mud": (1.149, 0.9873, 0.00386),
        "fine silt": (1.148, 0.9861, 0.00306),
        "sandy clay": (1.147, 0.9849, 0.00242),
        "very fine silt": (1.147, 0.9837, 0.00194),
        "silty clay": (1.146, 0.9824, 0.00163),
        "clay": (1.145, 0.9800, 0.00148),
    }
)
"""Density ratio, speed ratio (to the water above) and loss tangent: APL-UW TR 9407 (1994), section IV, table 2; for 10
to 100 kHz (`formula_ranges.APL_SEDIMENTS`)."""

GRAVITY: Final = 9.81  # m/s2
PHILLIPS, DECAY = 8.1e-3, 0.74  # alpha and beta of the spectrum of Pierson and Moskowitz (1964)


def rayleigh(
    grazing: npt.ArrayLike, density_ratio: npt.ArrayLike, speed_ratio: npt.ArrayLike, loss_tangent: npt.ArrayLike = 0.0
) -> Complexes:
    """Plane-wave reflection coefficient of a fluid half-space at grazing angles (rad, from the boundary).

    With m = rho2/rho1, n = (c1/c2)(1 - i delta) and q the grazing angle,

        V = (m sin q - w)/(m sin q + w),   w = sqrt(n^2 - cos^2 q),   Im w <= 0

    so that the wave in the bottom dies away from the boundary. n^2 - cos^2 q is taken as (n^2 - 1) + sin^2 q, which
    keeps its digits near grazing; V(0) = -1 for every bottom but one of density alone (n = 1), where
    V = (m - 1)/(m + 1) at every angle. Arguments broadcast. Exact for fluids; a bottom that carries shear waves, as
    rock does, takes part of the sound away in them, which is left out (`formula_ranges.FLUID_BED`).
    Source: Rayleigh; Brekhovskikh and Lysanov (2003), Fundamentals of Ocean Acoustics, section 3.1 (conjugated).
    """
    sine = np.abs(np.sin(np.asarray(grazing, float)))
    m, ratio, delta = (np.asarray(x, float) for x in (density_ratio, speed_ratio, loss_tangent))
    n = (1.0 - 1j * delta) / ratio
    contrast = (n - 1.0) * (n + 1.0)
    square = np.asarray(contrast + sine * sine)
    above, w = square.real >= 0.0, np.empty(square.shape, complex)  # NumPy's complex roots take five times as long
    larger = np.where(contrast == 0.0, sine, np.sqrt(0.5 * (np.abs(square) + np.abs(square.real))))
    smaller = 0.5 * np.abs(square.imag) / np.maximum(larger, 1e-300)
    w.real, w.imag = np.where(above, larger, smaller), -np.where(above, smaller, larger)
    both = m * sine
    top, bottom = both - w, both + w
    nothing = bottom == 0.0  # q = 0 and n = 1
    return np.asarray(np.where(nothing, (m - 1.0) / (m + 1.0), top / np.where(nothing, 1.0, bottom)))


def plane_wave_error(distance: npt.ArrayLike, wavenumber: npt.ArrayLike) -> Floats:
    """How much (...), over the incident wave, the reflection of a spherical wave differs from `rayleigh`, which is that
    of a plane one, at its worst: within a few degrees of the critical angle of a fast bottom.

    3 (k R)^-0.6, of the length R (m) of the path from image to receiver and the wavenumber k (rad/m): that of
    Sommerfeld's integral is 0.6 to 1.4 times as much over sand and rock, k R from 200 to 5000. Beyond ten degrees it is
    a tenth of that or less, and falls as 1/(k R) (Brekhovskikh and Lysanov 2003, section 4.2). Arguments broadcast.
    """
    return np.asarray(np.minimum(3.0 * (np.asarray(wavenumber, float) * np.asarray(distance, float)) ** -0.6, 1.0))


def pressure_release(grazing: npt.ArrayLike) -> Complexes:
    """Reflection coefficient of the flat sea surface: -1 at every angle."""
    return np.full(np.shape(grazing), -1.0 + 0j)


def roughness_blur(rms_height: npt.ArrayLike, grazing: npt.ArrayLike, sound_speed: npt.ArrayLike) -> Floats:
    """Time (s) that stands for a rough reflection at every frequency: exp(-(2 pi f delay_std)^2/2) of it is coherent.

    delay_std = 2 h sin q/c: the rms of the delay from boundary that is a height h nearer or farther, with the sound
    speed c (m/s) at the boundary. Roughness that differs from bounce to bounce adds its squares. For heights of normal
    distribution and slopes gentler than q, so that nothing lies in shadow; the rest of the energy is scattered, not
    lost. Source: Eckart (1953), JASA 25, 566: exp(-g^2/2), g = 2 k h sin q.
    """
    h, q, c = (np.asarray(x, float) for x in (rms_height, grazing, sound_speed))
    return np.asarray(2.0 * h * np.abs(np.sin(q)) / c)


def wind_wave_height(wind_speed: npt.ArrayLike) -> Floats:
    """Rms height (m) of a fully developed sea under wind (m/s at 19.5 m): U^2/(2 g) sqrt(alpha/beta) = 0.00533 U^2.

    A quarter of the significant wave height. Source: Pierson and Moskowitz (1964), JGR 69, 5181, their spectrum
    integrated; measured between 10 and 21 m/s, and warns outside but for a calm. A young sea or a short fetch is lower.
    """
    u = np.asarray(wind_speed, float)
    formula_ranges.PIERSON_MOSKOWITZ.check(wind_speed=np.where(u == 0.0, np.nan, u))
    return np.asarray(u**2 / (2.0 * GRAVITY) * np.sqrt(PHILLIPS / DECAY))


def bubble_loss(wind_speed: npt.ArrayLike, frequency: npt.ArrayLike, grazing: npt.ArrayLike) -> Floats:
    """Loss (dB) of one surface reflection in the bubbles that breaking waves leave; inf at grazing 0.

    1.26e-3 U^1.57 f^0.85/sin q with wind U (m/s at 10 m) of 6 m/s or more and f in kHz; below, exp(1.2 (U - 6)) times
    the loss at 6 m/s. This is the loss of energy: coherent and scattered echo together.
    Source: APL-UW TR 9407 (1994), II-21; a handbook for 10 to 100 kHz, and warns outside. Arguments broadcast;
    frequency in Hz.
    """
    u, f, q = (np.asarray(x, float) for x in (wind_speed, frequency, grazing))
    formula_ranges.BUBBLE_LOSS.check(frequency=f)
    at_normal = 1.26e-3 * np.maximum(u, 6.0) ** 1.57 * (f / 1e3) ** 0.85 * np.exp(1.2 * np.minimum(u - 6.0, 0.0))
    with np.errstate(divide="ignore"):
        return np.asarray(at_normal / np.abs(np.sin(q)))
