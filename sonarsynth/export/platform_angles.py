"""Angles as ships have them: x forward, y to starboard, z down, turns clockwise as one looks along an axis; and where
on the Earth they are."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats

UPRIGHT = 1e-6
"""Sine of the angle from the vertical below which a bow points straight up or down."""

EQUATOR = 6_378_137.0
"""m: radius of the ellipsoid of WGS 84 (NIMA TR8350.2, 2000)."""
FLATTENING = 1.0 / 298.257223563


def latitude_longitude(position: Floats) -> tuple[Floats, Floats]:
    """Latitude and longitude (row,) in degrees, WGS 84, of places (row, xyz) in m about 0 N 0 E: x east, y north."""
    along_meridian = EQUATOR * (1.0 - FLATTENING) ** 2  # radius of curvature there
    return np.rad2deg(position[:, 1] / along_meridian), np.rad2deg(position[:, 0] / EQUATOR)


def heading_pitch_roll(orientation: Floats) -> tuple[Floats, Floats, Floats]:
    """Heading from north by east, pitch (bow up), roll (starboard down), in degrees; no roll where the bow is upright.

    orientation: (row, wxyz) from the body (x forward, y port, z up) to the world (x east, y north, z up).
    """
    w, x, y, z = np.moveaxis(orientation, -1, 0)
    bow = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    port = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    level = np.hypot(bow[0], bow[1])
    upright = level < UPRIGHT  # heading and roll are then turns about one axis
    heading = np.where(upright, np.arctan2(port[1], -port[0]), np.arctan2(bow[0], bow[1]))
    roll = np.where(upright, 0.0, np.arctan2(port[2], 1 - 2 * (x * x + y * y)))
    return np.rad2deg(heading) % 360.0, np.rad2deg(np.arctan2(bow[2], level)), np.rad2deg(roll)


def beam_rotation(azimuth: Floats, elevation: Floats) -> tuple[Floats, Floats]:
    """phi in -180 to 180 and theta in -90 to 90 (deg): the turns about x, then about y, that bring z, down, to the axis
    of a beam.

    azimuth (port positive), elevation (up positive): rad.
    """
    forward = np.cos(elevation) * np.cos(azimuth)
    starboard, down = -np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)
    below = np.where(down >= 0.0, 1.0, -1.0)  # a beam that looks up: half a turn about x, and back
    phi = np.arctan2(-starboard, below * np.hypot(forward, down))
    return np.rad2deg(phi), np.rad2deg(np.arctan2(below * forward, below * down))
