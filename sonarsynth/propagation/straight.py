"""Straight rays."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sonarsynth.columns import alike
from sonarsynth.conventions import Floats, depth
from sonarsynth.description import description
from sonarsynth.description.method import FrameSize
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays.ray_solutions import COINCIDENT, GOOD, mean_slowness, water, within
from sonarsynth.products import Paths
from sonarsynth.propagation.bounces import Bounces
from sonarsynth.propagation.images import images, order
from sonarsynth.propagation.path_model import PathModel
from sonarsynth.propagation.refracted import Refracted


@description
class Straight(PathModel):
    """Straight rays at the mean slowness of the depths that they cross: exact where the sound speed is uniform."""

    kind: Literal["straight"] = "straight"
    bounces: Bounces = 0
    """Most reflections from surface and bottom on the way from the snap to the array."""

    @property
    def bends(self) -> bool:
        """As `PathModel.bends`."""
        return False

    @property
    def layered(self) -> bool:
        """As `PathModel.layered`."""
        return True

    def straight(self, profile: Profile) -> bool:
        """As `PathModel.straight`."""
        return True

    def exact(self) -> Refracted:
        """Bent rays."""
        return Refracted(bounces=self.bounces)

    def cost(self, size: FrameSize) -> float:
        """As `PathModel.cost`."""
        return 0.0

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """One path a pair and family, 1/r; arguments and errors as in `PathModel`. Coincident ends are flagged."""
        from sonarsynth.equations.kernels.unit_vectors import straight_rays

        layers = water(profile.depth, profile.speed, environment_depth)
        z1, z2 = within(layers, depth(start), "start"), within(layers, depth(end), "end")
        level = np.asarray(end, float)[:, :2] - np.asarray(start, float)[:, :2]
        if not np.isfinite(level).all():
            raise ValueError("paths need finite ends")
        speed = profile.speed[0]
        if not profile.uniform:
            top, bottom = np.minimum(z1, z2), np.maximum(z1, z2)
            ends = ((0.0 * top, top), (top, bottom), (bottom, 0.0 * bottom + environment_depth))
            slowness = [mean_slowness(layers, a, b) for a, b in ends]
        columns = []
        for image in images(z1, z2, environment_depth, self.bounces):
            length, departure, spreading = straight_rays(level, image.climb)
            mean, height, none = 1.0 / speed, np.abs(image.climb), alike(0, len(length))
            if not profile.uniform:
                heights = (image.above, image.between, image.below)
                crossed = sum(h * s for h, s in zip(heights, slowness, strict=True))
                mean = np.divide(crossed, height, out=slowness[1].copy(), where=height > 0)
            missing = grazing = alike(np.nan, len(length))
            if image.surface or image.bottom:
                grazing = np.arcsin(np.divide(height, length, out=missing.copy(), where=length > 0))
            columns.append(
                {
                    "pair": np.arange(len(length)),
                    "travel_time": length * mean,
                    "length": length,
                    "departure": departure,
                    "arrival": departure if image.turns > 0 else departure * [1.0, 1.0, -1.0],
                    "spreading": spreading,
                    "surface": alike(image.surface, len(length)),
                    "bottom": alike(image.bottom, len(length)),
                    "turning": none,
                    "caustics": none,
                    "surface_grazing": grazing if image.surface else missing,
                    "bottom_grazing": grazing if image.bottom else missing,
                    "flag": np.where(length > 0, GOOD, COINCIDENT),
                }
            )
        if len(columns) == 1:
            return Paths(**columns[0])
        joined = {name: np.concatenate([c[name] for c in columns]) for name in columns[0]}
        rows = order(joined["travel_time"].reshape(len(columns), -1))
        return Paths(**joined).select(rows)
