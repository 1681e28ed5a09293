"""Whether `layered_rays`, which know one ray of a family and one turning point, are all there are."""

from __future__ import annotations

from collections import Counter

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.equations.rays import ray_solutions
from sonarsynth.validation.references.rays.followed_rays import count_rays
from sonarsynth.validation.references.rays.layered_rays import families, rays
from sonarsynth.validation.references.rays.layers_crossed import Water

TURNING = 12
"""Turning points of the rays that are looked for."""


def knows_every_ray(water: Water, start: Floats, end: Floats, bounces: int) -> bool:
    """Whether the rays of all families between points (ray, xyz) are as many as rays followed leg by leg.

    Parameters
    ----------
    water : the layers
    start, end : (ray, xyz) m, world, z up
    bounces : most reflections of a ray
    """
    if np.ptp(water.speed) == 0.0:
        return True
    missing: Counter[tuple[int, int, int]] = Counter()
    for family in families(bounces):
        for pair, time in enumerate(rays(water, start, end, family).time):
            missing[pair, family.bounces - family.bottom, family.bottom] -= int(np.isfinite(time))
    layers, far = ray_solutions.Water(*water.unfolded(range(1))), np.hypot(*(end - start)[:, :2].T)
    followed = count_rays(layers, -start[:, 2], -end[:, 2], far, bounces + TURNING, bounces)
    for (pair, _, surface, bottom, _), number in followed.items():
        missing[pair, surface, bottom] += number
    return not any(missing.values())
