"""What makes the wavefront of a source err alike at all sensors, so that lags do not show it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.arrays.spherical_wave import Wavefront

WITHIN = 3.0
"""Standard errors within which a source may be next to a boundary."""


def source_place(
    direction: Floats, curvature: float, tangents: Floats, covariance: Floats, by_speed: Floats
) -> tuple[Floats, Floats, Floats]:
    """Place (xyz) of the source of a wave, its covariance, and its change (xyz) per m/s of the assumed sound speed.

    direction (xyz) and tangents (2, xyz) of length one; curvature, 1/m: one over its distance; covariance (3, 3) and
    by_speed (3,) of (angles along tangents, rad, curvature, 1/m). NaN where the curvature is.
    """
    k = curvature
    jacobian = np.stack([tangents[0] / k, tangents[1] / k, -direction / k**2], axis=1)
    return direction / k, jacobian @ covariance @ jacobian.T, jacobian @ by_speed


def bias_covariance(wave: Wavefront, true: Wavefront) -> Floats:
    """Covariance (4, 4) of a wave's two angles (rad), curvature (1/m) and time (s) where it is off by what is between
    it and the true one."""
    turned = wave.tangents @ (wave.direction - true.direction)
    bias = np.array([*turned, wave.curvature - true.curvature, wave.time - true.time])
    return np.outer(bias, bias)


def bending_covariance(
    by_angle: Floats, slope: float, distance: float, gradient: float, sound_speed: float, aperture: float
) -> Floats:
    """Covariance (4, 4) of a wavefront's parameters where rays are taken for straight in a gradient (1/s).

    A ray of grazing angle a is an arc of curvature g cos a/c: over a distance r it arrives r g cos a/(2c) beside its
    chord, in the vertical plane. Where the gradient is that of a layer on the way, rays spread there by more or less,
    and the curvature of the wavefront over the array is off by up to g cos^2 a/(c sin a), half of it on the mean; where
    it is the same all the way, by g sin a/(2c): together g/(2c sin a), and never more than that of a source in the
    array (1/aperture). slope is sin a; by_angle (2,) its derivatives along the tangents, of size cos a.
    """
    half = 0.5 * gradient / sound_speed
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = np.outer(by_angle, by_angle) * (half * distance) ** 2
    covariance[2, 2] = (half / max(abs(slope), half * aperture)) ** 2
    return covariance


def image_covariance(
    by_angle: Floats, slope: float, curvature: float, covariance: Floats, height: float, sound_speed: float,
    spread: Sequence[float], windows: tuple[float, float, float], *, deepest: float,
) -> Floats:  # fmt: skip
    """Covariance (4, 4) of a wavefront's parameters where a source may be next to a boundary that mirrors it.

    The pulse of its image is later by t = 2 d |sin a|/c, d the distance from the boundary, a the grazing angle. Where t
    is within half of the window in which lags are measured, they are heard as one, from between them by their powers:
    off by what the spread (s) of both together says, times c/|sin a|. Of later ones what is left in the window moves
    lags by (window/2t)^4 of that. The time moves by the spread, where pulses overlap and where either may be taken for
    the pulse; of what is heard apart, by (2 spread/t)^2 of that. Errors of 2 000 places 0.02 to 3 m from surface or
    bottom are 0.3 to 1.1 of all, root mean square, whatever t; under 1 % are over 4.

    slope is the sine of the elevation of the wavefront, by_angle (2,) its derivatives along the tangents, curvature
    that of the wave (1/m), covariance (4, 4) what they err by besides; height (m): of the boundary over the array,
    negative below it; spread: `spherical_wave.envelope_spread` of the pulse as lags, and as the time, are measured by;
    windows (s): of lags, of the time, and by how much that errs where it holds the image; deepest (m): most that a
    source may be from the boundary; sound_speed: m/s.
    """
    if not slope * height > 0:
        return np.zeros((4, 4))
    near, row = slope / height, np.array([*by_angle, -height])
    error = WITHIN * float(np.sqrt(row @ covariance[:3, :3] @ row))
    later = max(2.0 * (abs(curvature * height - slope) - error) * abs(height) / sound_speed, 1e-300)
    moved = min(spread[0] * sound_speed / abs(slope) * min(0.5 * windows[0] / later, 1.0) ** 4, deepest)
    column = moved * np.array([*by_angle * near, -slope * near**2, 0.0])
    covariance = np.outer(column, column)
    covariance[3, 3] = (spread[1] * min(2.0 * spread[1] / later, 1.0) ** 2) ** 2
    covariance[3, 3] += windows[2] ** 2 * (later < 0.5 * windows[1])
    return covariance
