"""What a model of propagation says of itself: one that is added needs no more than `connect`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np

from sonarsynth.conventions import Floats, Ints
from sonarsynth.description.method import FrameSize, Method, returned, returned_rows
from sonarsynth.environment.sea import Profile
from sonarsynth.products import Paths


class KnownRays(NamedTuple):
    """Rays that are known, to find those beside them by."""

    start: Floats  # (ray, xyz) m, world
    departure: Floats  # (ray, xyz)
    vertices: Ints  # (ray,) reflections and turning points


class RaysBeside(NamedTuple):
    """Rays of the same kind from the same starts to other ends; NaN where there is none."""

    travel_time: Floats  # (ray, end) s
    spreading: Floats  # (ray, end) 1/m
    departure: Floats  # (ray, end, xyz)


class PathModel(Method):
    """A model of how sound travels from point to point. It has a field `bounces: Bounces`: the most reflections from
    surface and bottom on the way from the snap to the array."""

    bounces: int

    def connect(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """All paths with at most `bounces` reflections from start (pair, xyz) to end (pair, xyz) in the world.

        environment_depth: depth of the bottom in m. Sorted by pair, and of a pair by travel time. Raises ValueError
        for points outside the water or not finite.
        """
        raise NotImplementedError(f"{type(self).__name__} connects no points")

    def checked_paths(self, profile: Profile, environment_depth: float, start: Floats, end: Floats) -> Paths:
        """What `connect` returns, once it has the shape of paths."""
        wide, known = {"departure": (3,), "arrival": (3,)}, ("travel_time", "length", "spreading")
        found = self.connect(profile, environment_depth, start, end)
        paths: Paths = returned_rows(self, "connect", found, Paths, "pair", known, wide)
        return paths

    @property
    def bends(self) -> bool:
        """Whether rays bend where the sound speed varies, so that things are not where they are heard."""
        return True

    @property
    def layered(self) -> bool:
        """Whether its rays are those of water in layers of the profile, and bounds that hold for these hold for it."""
        return False

    def straight(self, profile: Profile) -> bool:
        """Whether all its paths are straight lines at one speed, and their mirror images, so that closed forms do."""
        return False

    def beside(self, profile: Profile, environment_depth: float, rays: KnownRays, end: Floats) -> RaysBeside | None:
        """Rays beside known ones, to points (end, xyz) in the world: a faster way than `connect`; none: there is no
        such way, and `connect` is asked."""
        return None

    def checked_rays_beside(
        self, profile: Profile, environment_depth: float, rays: KnownRays, end: Floats
    ) -> RaysBeside | None:
        """What `beside` returns, once it has the shape of that, and is known wherever a travel time is."""
        found = self.beside(profile, environment_depth, rays, end)
        if found is not None:
            shape = len(rays.start), len(end)
            returned(self, "beside", found, shape, "travel_time", unknown=True)
            there = np.isfinite(found.travel_time)
            for name, wide in (("spreading", ()), ("departure", (3,))):
                returned(self, "beside", found, (*shape, *wide), name, unknown=True)
                known = getattr(found, name)[there]
                returned(self, "beside", known, known.shape)
        return found

    @property
    def direct(self) -> Self:
        """The same model, of paths without reflections."""
        return self.reflected(0)

    def reflected(self, bounces: int) -> Self:
        """The same model, of paths with at most so many reflections."""
        model: Any = self
        changed: Self = model if bounces == self.bounces else replace(model, bounces=bounces)
        return changed

    def cost(self, size: FrameSize) -> float:
        """As `Method.cost`, of the paths to all facets: what they take more than straight lines, once an emission and
        pair of families; ever more in water of many layers."""
        return 1.6e-6 * size.facets * (1.0 + max(size.layers - 50, 0) / 40)

    def row(self) -> str:
        """As `Method.row`."""
        return f"{self.kind} rays"
