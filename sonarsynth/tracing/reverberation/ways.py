"""Ways between a point and many scatterers: straight rays, directly and by mirror images in surface and bottom."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.rays.ray_solutions import Water, mean_slowness, water
from sonarsynth.propagation.images import boundary_at, images


@dataclass(frozen=True, eq=False)
class UnfoldedPaths:
    """From a point to points (point,), unfolded; a single value stands for all of them."""

    own: str  # "surface" or "bottom": the point lies on it, and its image there goes this way as well; else ""
    surface: int  # reflections
    bottom: int
    climb: Floats  # (point,) m: height that the ray gains, up positive, as it starts
    slowness: Floats  # (point,) s/m: mean over the depths that it crosses

    @property
    def bounces(self) -> int:
        """Reflections."""
        return self.surface + self.bottom


@lru_cache(maxsize=16)
def _water(profile: Profile, bottom_depth: float) -> Water:
    return water(profile.depth, profile.speed, bottom_depth)


def ways(
    profile: Profile, bottom_depth: float, start: float, end: Floats, bounces: int, owner: str
) -> list[UnfoldedPaths]:
    """All ways from depth start (m) to depths end (point,) by at most so many reflections, the straight one first.

    To the bottom those that arrive from above, to the surface from below: a reflection there is none before it. A point
    on a boundary and its image there are one, where reflections are followed: its ways are those that leave the
    boundary, for both of them.
    """
    own = boundary_at(start, bottom_depth)
    layers, begin, paths = _water(profile, bottom_depth), np.full(end.shape, start), []
    top, low, bottom = np.minimum(begin, end), np.maximum(begin, end), np.full(end.shape, bottom_depth)

    def mean(a: Floats, b: Floats) -> Floats:
        own = 1.0 / profile.at(a)
        if profile.uniform:
            return own
        thin = b - a < 1e-9
        return np.where(thin, own, mean_slowness(layers, np.where(thin, 0.0, a), np.where(thin, bottom, b)))

    above, between, below = mean(np.zeros(end.shape), top), mean(top, low), mean(low, bottom)
    for image in images(begin, end, bottom_depth, bounces):
        falls = image.climb * image.turns < 0.0
        into_it = image.climb > 0.0 if own == "surface" else image.climb < 0.0
        if own and into_it.any():
            continue
        if (owner == "bottom" and not falls.all()) or (owner == "surface" and (falls | (image.climb == 0.0)).any()):
            continue
        crossed = image.above * above + image.between * between + image.below * below
        all_of_it = image.above + image.between + image.below
        slowness = np.where(all_of_it > 1e-9, crossed / np.maximum(all_of_it, 1e-9), between)
        paths.append(UnfoldedPaths(own if bounces else "", image.surface, image.bottom, image.climb, slowness))
    return paths
