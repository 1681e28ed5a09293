"""Rays in water of one sound speed: straight lines to the images of the receiver in surface and bottom."""

from __future__ import annotations

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.validation.rays.ray_matching import Rays


def image_rays(speed: float, bottom_depth: float, start: Floats, end: Floats, distance: Floats, bounces: int) -> Rays:
    """Every ray with up to `bounces` reflections between depths start and end (pair,) m at distances (pair,) m.

    The receiver is mirrored in the boundaries that the ray meets, the last one first (e.g. Jensen, Kuperman, Porter and
    Schmidt 2011, Computational Ocean Acoustics, section 2.4.4). speed in m/s, bottom in m.
    """
    rows = []
    for down_first in (True, False):
        for count in range(bounces + 1):
            if count == 0 and not down_first:
                continue
            at_bottom = (np.arange(count) % 2 == 0) == down_first
            image = np.array(end, float)
            for bottom_hit in at_bottom[::-1]:
                image = 2.0 * bottom_depth - image if bottom_hit else -image
            rise = start - image
            length = np.hypot(distance, rise)
            angle = np.arctan2(rise, distance)
            last = angle if count % 2 == 0 else -angle
            rows.append(
                [
                    length / speed,
                    angle,
                    last,
                    1.0 / length,
                    *(np.full(len(rise), np.sum(hits)) for hits in (~at_bottom, at_bottom)),
                ]
            )
    time, first, last, amplitude, surface, bottom = (np.concatenate(column) for column in zip(*rows, strict=True))
    none = np.zeros(len(time), int)
    pair = np.tile(np.arange(len(start)), len(rows))
    return Rays(pair, time, first, last, amplitude, surface.astype(int), bottom.astype(int), none, none)
