"""What makes the wavefront of a source err alike at all sensors, so that lags do not show it."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats

WITHIN = 3.0
"""Standard errors within which a source may be next to a boundary."""
TAILS = 4.0
"""Paths of an image, in those that are heard apart, up to which its pulse and that of the source touch."""
LEAKS = 0.05
"""What that moves the source by, of what an image does that is heard as one with it: 0.002 to 0.1 were seen."""


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
    by_angle: Floats, slope: float, curvature: float, covariance: Floats, height: float, path: float,
    deepest: float, sound_speed: float,
) -> Floats:  # fmt: skip
    """Covariance (4, 4) of a wavefront's parameters where a source may be next to a boundary that mirrors it.

    The pulse of its image follows by a path that is longer by 2 d |sin a|, d the distance from the boundary and a the
    grazing angle. Up to `path` (m) the two are heard as one, from between them: from a point of the boundary if they
    are alike, whatever d is. So a source that seems to be within path/(2 |sin a|) may be anywhere there; a little
    farther from it (`TAILS`), what is left of its image in the window of its pulse moves it by a part (`LEAKS`).

    slope is the sine of the elevation of the wavefront, by_angle (2,) its derivatives along the tangents, curvature
    that of the wave (1/m), covariance (4, 4) what they err by besides; height (m): of the boundary over the array,
    negative below it; deepest (m): most that a source may be from the boundary; sound_speed: m/s.
    """
    if not slope * height > 0:
        return np.zeros((4, 4))
    near, within = slope / height, min(0.5 * path / abs(slope), deepest)
    row = np.array([*by_angle, -height])
    error = WITHIN * float(np.sqrt(row @ covariance[:3, :3] @ row))
    beside = (abs(curvature * height - slope) - error) / (within * near)
    moved = within / np.sqrt(3.0) * (1.0 if beside <= 1.0 else LEAKS * (beside <= TAILS))  # evenly over all distances
    column = moved * np.array([*by_angle * near, -slope * near**2, 0.0])
    covariance = np.outer(column, column)
    covariance[3, 3] = (path / sound_speed) ** 2 / 12.0 * (beside <= 1.0)  # either may be taken for the pulse
    return covariance
