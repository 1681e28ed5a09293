"""Refracted rays: circular arcs through the sound speed profile."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sonarsynth.acoustics.rays import eigenrays, water
from sonarsynth.conventions import Floats, depth
from sonarsynth.description import description
from sonarsynth.products import Paths
from sonarsynth.world.environment import Profile


@description
class Refracted:
    """All rays of the direct family: no reflection, at most one turning point; exact in a piecewise linear profile."""

    kind: Literal["refracted"] = "refracted"

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """None (a shadow zone), one or several paths a pair; arguments and errors as in `Propagation`."""
        layers = water(profile.depth, profile.speed, environment_depth)
        span = np.asarray(end, float)[:, :2] - np.asarray(start, float)[:, :2]
        distance = np.hypot(span[:, 0], span[:, 1])
        rays = eigenrays(layers, depth(start), depth(end), distance)
        with np.errstate(invalid="ignore", divide="ignore"):
            ahead = np.where(distance[:, None] > 0, span / distance[:, None], 0.0)[rays.pair]
        none = np.zeros(len(rays.pair), int)
        return Paths(
            pair=rays.pair,
            travel_time=rays.travel_time,
            length=rays.length,
            departure=_direction(ahead, rays.slowness * rays.start_speed, rays.start_sine),
            arrival=_direction(ahead, rays.slowness * rays.end_speed, rays.end_sine),
            spreading=rays.amplitude,
            surface=none,
            bottom=none,
            turning=rays.turning,
            caustics=rays.caustics,
            surface_grazing=np.full(len(none), np.nan),
            bottom_grazing=np.full(len(none), np.nan),
            flag=rays.flag,
        )


def _direction(ahead: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Unit vectors (path, xyz) that go `ahead` (path, xy) at a grazing angle, up positive; NaN where the sine is."""
    level = np.where(np.isnan(sine), np.nan, cosine)
    return np.concatenate([ahead * level[:, None], sine[:, None]], axis=1)
