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
from sonarsynth.propagation.images import images
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
        ways = images(z1, z2, environment_depth, self.bounces)
        climb = np.array([image.climb for image in ways])
        mean = np.broadcast_to(1.0 / profile.speed[0], climb.shape)
        if not profile.uniform:
            top, bottom = np.minimum(z1, z2), np.maximum(z1, z2)
            ends = ((0.0 * top, top), (top, bottom), (bottom, 0.0 * bottom + environment_depth))
            over, own, under = (mean_slowness(layers, a, b) for a, b in ends)
            crossed = [image.above * over + image.between * own + image.below * under for image in ways]
            height = np.abs(climb)
            mean = np.divide(crossed, height, out=np.tile(own, (len(ways), 1)), where=height > 0)
        surface, bounced = (np.array(n) for n in zip(*((w.surface, w.bottom) for w in ways), strict=True))
        family, time, length, departure, arrival, spreading, grazing = straight_rays(
            np.asarray(start, float), np.asarray(end, float), climb, mean, (surface + bounced) % 2
        )
        if not np.isfinite(time).all():
            raise ValueError("paths need finite ends")
        pair, none, missing = np.arange(len(z1)), alike(0, len(length)), alike(np.nan, len(length))
        met = {"surface": none, "bottom": none, "surface_grazing": missing, "bottom_grazing": missing}
        if self.bounces:
            pair, counts = np.repeat(pair, len(ways)), (surface[family], bounced[family])
            met = dict(zip(met, (*counts, *(np.where(n > 0, grazing, np.nan) for n in counts)), strict=True))
        return Paths(
            pair=pair, travel_time=time, length=length, departure=departure, arrival=arrival, spreading=spreading,
            turning=none, caustics=none, flag=np.where(length > 0, GOOD, COINCIDENT), **met,
        )  # fmt: skip
