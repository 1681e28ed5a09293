"""Refracted rays: circular arcs through the sound speed profile."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sonarsynth.conventions import Bools, Floats, depth
from sonarsynth.description import description
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays.ray_solutions import eigenrays, water
from sonarsynth.products import Paths
from sonarsynth.propagation.bounces import Bounces
from sonarsynth.propagation.path_model import KnownRays, PathModel, RaysBeside


@description
class Refracted(PathModel):
    """All rays with so many reflections and one turning point more at most; exact in a piecewise linear profile."""

    kind: Literal["refracted"] = "refracted"
    bounces: Bounces = 0
    """Most reflections from surface and bottom on the way from the snap to the array."""

    @property
    def layered(self) -> bool:
        """As `PathModel.layered`."""
        return True

    def straight(self, profile: Profile) -> bool:
        """As `PathModel.straight`."""
        return profile.uniform

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """None (a shadow zone), one or several paths a pair; arguments and errors as in `PathModel`."""
        layers = water(profile.depth, profile.speed, environment_depth)
        span = np.asarray(end, float)[:, :2] - np.asarray(start, float)[:, :2]
        distance = np.hypot(span[:, 0], span[:, 1])
        rays = eigenrays(layers, depth(start), depth(end), distance, self.bounces + 1, self.bounces)
        with np.errstate(invalid="ignore", divide="ignore"):
            ahead = np.where(distance[:, None] > 0, span / distance[:, None], 0.0)[rays.pair]
        return Paths(
            pair=rays.pair,
            travel_time=rays.travel_time,
            length=rays.length,
            departure=_direction(ahead, rays.slowness * rays.start_speed, rays.start_sine),
            arrival=_direction(ahead, rays.slowness * rays.end_speed, rays.end_sine),
            spreading=rays.amplitude,
            surface=rays.surface,
            bottom=rays.bottom,
            turning=rays.turning,
            caustics=rays.caustics,
            surface_grazing=grazing(rays.slowness * layers.speed[0], rays.surface > 0),
            bottom_grazing=grazing(rays.slowness * layers.speed[-1], rays.bottom > 0),
            flag=rays.flag,
        )

    def beside(self, profile: Profile, environment_depth: float, rays: KnownRays, end: Floats) -> RaysBeside:
        """By Newton's method from each known ray, along the layers that it crosses."""
        from sonarsynth.equations.rays import ray_continuation

        layers = water(profile.depth, profile.speed, environment_depth)
        count, ends = len(rays.start), len(end)
        z, z_end = (np.clip(depth(point), 0.0, environment_depth) for point in (rays.start, end))
        c_start = np.interp(z, layers.depth, layers.speed)
        level = end[None, :, :2] - rays.start[:, None, :2]
        distance = np.hypot(level[..., 0], level[..., 1])
        time, sine, spreading = (np.empty((count, ends)) for _ in range(3))
        ray_continuation.rays_nearby(
            layers.depth, layers.speed, z, np.hypot(rays.departure[:, 0], rays.departure[:, 1]) / c_start,
            (rays.departure[:, 2] > 0).astype(np.int64), rays.vertices, np.arange(ends), z_end, distance,
            time, sine, spreading,
        )  # fmt: skip
        ahead = np.divide(level, distance[..., None], out=np.zeros_like(level), where=distance[..., None] > 0)
        cosine = np.sqrt(np.maximum((1.0 - sine) * (1.0 + sine), 0.0))
        departure = np.concatenate([ahead * cosine[..., None], sine[..., None]], axis=2)
        return RaysBeside(time, spreading, departure)


def grazing(cosine: Floats, met: Bools) -> Floats:
    """Grazing angle (path,) in rad at a boundary, from its cosine there p c; NaN for paths that do not meet it."""
    sine = np.sqrt(np.maximum((1.0 - cosine) * (1.0 + cosine), 0.0))
    return np.where(met, np.arctan2(sine, cosine), np.nan)


def _direction(ahead: Floats, cosine: Floats, sine: Floats) -> Floats:
    """Unit vectors (path, xyz) that go `ahead` (path, xy) at a grazing angle, up positive; NaN where the sine is."""
    level = np.where(np.isnan(sine), np.nan, cosine)
    return np.concatenate([ahead * level[:, None], sine[:, None]], axis=1)
