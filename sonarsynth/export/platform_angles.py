"""Angles as ships have them: x forward, y to starboard, z down, turns clockwise as one looks along an axis."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats


def heading_pitch_roll(orientation: Floats) -> tuple[Floats, Floats, Floats]:
    """Heading from north by east, pitch (bow up), roll (starboard down), in degrees.

    orientation: (row, wxyz) from the body (x forward, y port, z up) to the world (x east, y north, z up).
    """
    w, x, y, z = np.moveaxis(orientation, -1, 0)
    bow = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    port_up, mast_up = 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    heading = np.rad2deg(np.arctan2(bow[0], bow[1])) % 360.0
    pitch = np.rad2deg(np.arcsin(np.clip(bow[2], -1.0, 1.0)))
    return heading, pitch, np.rad2deg(np.arctan2(port_up, mast_up))


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
