"""Facets with a rough surface: what is left of the coherent echo, and the power that is scattered instead.

Heights of the surface about the facet are Gaussian with an rms `height`, its slopes with an rms `slope` per axis. With

    g = k height (cos i + cos s) = k height n.(ks - ki)

the coherent part of the amplitude is that of the smooth facet times exp(-g^2/2), and the share 1 - exp(-g^2) of the
power goes into the lobe of the slopes. Smooth (g = 0) is Kirchhoff, rough (g large) is the lobe alone; powers add by
area, so that a facet may be split. Unit vectors of propagation (..., xyz), in and away.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from sonarsynth.conventions import Floats
from sonarsynth.equations.scattering.lobes import dot, lambert, slope_lobe


def roughness_parameter(
    wavenumber: npt.ArrayLike, height: npt.ArrayLike, incident: Floats, scattered: Floats, normal: Floats
) -> Floats:
    """Rayleigh's parameter g (...): the rms phase (rad) that an rms height (m) gives an echo; never negative.

    wavenumber (rad/m), height (m): broadcast with the directions (...). Source: Rayleigh (1896), section 272a.
    """
    path = dot(normal, np.asarray(scattered, float) - np.asarray(incident, float))
    return np.asarray(np.abs(np.asarray(wavenumber, float) * np.asarray(height, float) * path))


def coherent_factor(parameter: npt.ArrayLike) -> Floats:
    """What is left (...) of the coherent amplitude, exp(-g^2/2), at a roughness parameter g. Source: Eckart (1953),
    JASA 25, 566."""
    g = np.asarray(parameter, float)
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(-0.5 * g * g))


def incoherent_power(
    parameter: npt.ArrayLike,
    incident: Floats,
    scattered: Floats,
    normal: Floats,
    slope: float,
    reflection: npt.ArrayLike = 1.0,
    albedo: float = 0.0,
) -> Floats:
    """Scattered power |f|^2 per area (...) (1/sr), without phase: (1 - exp(-g^2)) |V|^2 sigma0 + the Lambert floor.

    parameter g (...), `slope` rms per axis, reflection coefficient V (...), `albedo` the share of the power that the
    floor gives back: with |V|^2 at most 1. Reciprocal where V and g are. The lobe (Barrick's, `lobes.slope_lobe`) knows
    no shadows and no second bounce: it gives back all power for slopes up to 0.1, 0.96 to 1.00 of it for 0.2. Raises
    ValueError for a slope that is not above 0.
    """
    if not slope > 0:
        raise ValueError("slope (rms, per axis) of a rough surface must be above 0")
    g = np.asarray(parameter, float)
    mirrored = np.abs(np.asarray(reflection)) ** 2
    with np.errstate(over="ignore"):
        share = -np.expm1(-g * g)
    power = share * mirrored * slope_lobe(incident, scattered, normal, slope)
    return np.asarray(power + lambert(incident, scattered, normal, albedo) if albedo > 0 else power)
