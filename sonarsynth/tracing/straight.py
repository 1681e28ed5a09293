"""Straight rays."""

from __future__ import annotations

from typing import Literal

import numpy as np

from sonarsynth.acoustics.rays import COINCIDENT, GOOD, mean_slowness, water, within
from sonarsynth.conventions import Floats, depth
from sonarsynth.description import description
from sonarsynth.products import Paths
from sonarsynth.world.environment import Profile


@description
class Straight:
    """Straight rays at the mean slowness of the depths that they cross: exact where the sound speed is uniform."""

    kind: Literal["straight"] = "straight"

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """One path a pair, 1/r; arguments and errors as in `Propagation`. Coincident ends are flagged."""
        layers = water(profile.depth, profile.speed, environment_depth)
        z1, z2 = within(layers, depth(start), "start"), within(layers, depth(end), "end")
        span = np.asarray(end, float) - start
        length = np.sqrt(np.einsum("ij,ij->i", span, span))
        if not np.isfinite(length).all():
            raise ValueError("paths need finite ends")
        slowness = 1.0 / profile.speed[0] if profile.uniform else mean_slowness(layers, z1, z2)
        none = np.zeros(len(length), int)
        with np.errstate(divide="ignore", invalid="ignore"):
            towards, spreading = span / length[:, None], 1.0 / length
        flag = np.where(length > 0, GOOD, COINCIDENT)
        pair = np.arange(len(length))
        nowhere = np.full(len(length), np.nan)
        return Paths(
            pair=pair,
            travel_time=length * slowness,
            length=length,
            departure=towards,
            arrival=towards,
            spreading=spreading,
            surface=none,
            bottom=none,
            turning=none,
            caustics=none,
            surface_grazing=nowhere,
            bottom_grazing=nowhere,
            flag=flag,
        )
