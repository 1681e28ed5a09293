"""Scattering strength of a sea surface under wind: facets, small waves and bubbles, per m2 and sr."""

from __future__ import annotations

import numpy as np
from scipy.special import erfc

from sonarsynth.conventions import Floats
from sonarsynth.equations.reverberation.bottom_strength import Angles

STEEPEST = np.cos(np.deg2rad(80.0)) ** 2
"""Small waves are taken as they are at 80 degrees from there to the vertical, where their law has no bound."""


def slope_variance(wind_speed: float) -> float:
    """Twice the variance of the slopes per axis: 4.6e-3 ln(2.1 U^2), of wind U (m/s) of 1 m/s or more; 0.0034 below.

    Source: APL-UW TR 9407 (1994), section II.
    """
    return max(4.6e-3 * float(np.log(2.1 * wind_speed**2)), 3.4e-3) if wind_speed >= 1.0 else 3.4e-3


def facets(angles: Angles, wavenumber: float, wind_speed: float, rms_height: float) -> Floats:
    """Of the facets of waves (...) in 1/sr: the lobe of slopes times 1 - exp(-g^2), g = 2 k h sin q of the direction
    that is nearer to grazing.

    What they give back is what the coherent reflection lost (Eckart), exp(-g^2) of the power is left to that. By the
    mean of both sines steep ways out would take more from a wave near grazing than it lost, up to 1.8 times what
    arrives. The lobe is that of Barrick (1968), `lobes.slope_lobe`; slopes by `slope_variance`; waves hide each other
    near grazing (`unshadowed`).
    """
    level, upright = angles.half
    spread = slope_variance(wind_speed)
    steep = np.maximum(upright, 1e-9)
    lobe = np.exp(-level / (steep**2 * spread)) * ((level + steep**2) / steep**2) ** 2 / (4.0 * np.pi * spread)
    lobe *= unshadowed(angles, spread)
    nearer = np.minimum(angles.sine_in, angles.sine_out)
    return np.asarray(-np.expm1(-((2.0 * wavenumber * rms_height * nearer) ** 2)) * lobe)


def unshadowed(angles: Angles, spread: float) -> Floats:
    """Share (...) of the facets that both directions see: 1/(1 + L(q_i) + L(q_s)), spread: `slope_variance`.

    Source: Smith (1967), J. Geophys. Res. 72, 4059; L = (exp(-v^2)/(v sqrt pi) - erfc v)/2, v = tan q/sqrt(spread).
    """
    hidden = np.zeros(np.broadcast(*angles).shape)
    for sine in (angles.sine_in, angles.sine_out):
        v = np.maximum(sine, 1e-6) / np.sqrt(np.maximum(1.0 - sine**2, 1e-12) * spread)
        hidden = hidden + 0.5 * (np.exp(-(v**2)) / (v * np.sqrt(np.pi)) - erfc(v))
    return np.asarray(1.0 / (1.0 + np.maximum(hidden, 0.0)))


def small_waves(angles: Angles, wind_speed: float) -> Floats:
    """Of ripples on the waves (...) in 1/sr: 1.3e-5 U tan^4 q, of wind U (m/s). Source: APL-UW TR 9407, section II.

    Bistatic, tan^2 q becomes that of the two directions multiplied; from 80 degrees to the vertical it stays."""
    down = np.maximum((1.0 - angles.sine_in**2) * (1.0 - angles.sine_out**2), STEEPEST**2)
    return np.asarray(1.3e-5 * wind_speed * (angles.sine_in * angles.sine_out) ** 2 / down)


def bubbles(angles: Angles, frequency: float, wind_speed: float) -> Floats:
    """Of the bubbles under the surface (...) in 1/sr, at a frequency (Hz). Source: APL-UW TR 9407, section II.

    Bistatic, sin q becomes the geometric mean of the two.
    """
    sine = np.sqrt(np.maximum(angles.sine_in * angles.sine_out, 0.0))
    deep = 10.0 ** (-5.2577 + 0.4701 * min(wind_speed, 11.0)) * max(wind_speed / 11.0, 1.0) ** 3.5
    deep *= (frequency / 25e3) ** 0.85
    beta = deep / np.maximum(sine, 1e-9)
    single = deep * 0.0136 / (4.0 * np.pi * 0.0255 * (frequency / 1e3) ** (1.0 / 3.0))
    attenuation = (1.0 + 8.0 * beta * np.exp(-2.0 * beta) - np.exp(-4.0 * beta)) / (2.0 * beta)
    return np.asarray(np.where(sine > 0.0, single * attenuation, 0.0))
