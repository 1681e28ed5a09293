"""Shadows of bodies in reverberation: scatterers that a body hides from the snap, or from a part of the array."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.casting.folded_rays import may_meet
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.receiver.subarrays import subarrays
from sonarsynth.state import FrameContext, Medium, Receiver
from sonarsynth.tracing.facet_paths import of_one_speed
from sonarsynth.tracing.meetings import family_times
from sonarsynth.tracing.occlusion.ray_cones import hidden, spheres

PART = 32
"""Hydrophones of a part of the array, at most: all of them see what its middle sees."""


@dataclass(frozen=True, eq=False)
class Shadows:
    """The bodies of a frame as they stand in the way of reverberation.

    Rays are straight, as those of reverberation are, and shadows have sharp edges. A body is where the sound of each
    snap meets it, directly.
    """

    met: tuple[tuple[PlacedTarget, ...], ...]  # (snap, body)
    medium: Medium  # of one sound speed
    receiver: Receiver
    parts: tuple[Ints, ...]  # sensors of each part of the array; one part where there are no bodies
    middle: Floats  # (part, xyz) m from the middle of the array, world

    @staticmethod
    def of(context: FrameContext) -> Shadows:
        """In a frame."""
        receiver, medium, bodies = context.receiver, context.medium, context.bodies
        tracks = [body.track for body in bodies]
        times = family_times(tracks, context.snaps, medium.depth, 0, receiver.speed(medium))[0].tolist()
        met = tuple(tuple(body.later(t) for body, t in zip(bodies, row, strict=True)) for row in times)
        parts = subarrays(receiver.elements, -(-receiver.elements.count // PART) if bodies else 1)
        middle = receiver.pose.turn_to_world(np.array([part.centre for part in parts]))
        return Shadows(met, of_one_speed(medium, receiver), receiver, tuple(part.sensor for part in parts), middle)

    def lit(self, number: int, source: Floats, position: Floats, way: Floats, bounces: int) -> Bools:
        """Which scatterers, at position (point, xyz) m, no body hides from emission `number` at source (xyz) m; way
        (point, xyz) m, bounces: as `ScatteredPaths.way_out` and its reflections."""
        return ~self._hide(number, np.broadcast_to(source, position.shape), position, way, bounces)

    def hidden(self, number: int, position: Floats, way: Floats, bounces: int) -> Bools:
        """From which parts of the array a body hides scatterers (point, part); way: as `ScatteredPaths.way_back`."""
        count, receiver = len(position), self.receiver
        array = np.column_stack([position[:, :2] - way[:, :2], np.full(count, receiver.pose.position[2])])
        up, reach = way[:, 2] > 0.0, np.full(count, receiver.elements.aperture)
        times = np.full(count, bounces)
        bodies = spheres(self.met[number])
        far, first = may_meet(array, position, up, times, self.medium.depth, reach, *bodies)
        rows = np.flatnonzero(far | (first > 0.0))
        found = np.zeros((count, len(self.parts)), bool)
        start, on = (array[rows, None] + self.middle).reshape(-1, 3), (way[rows, None] - self.middle).reshape(-1, 3)
        end = np.repeat(position[rows], len(self.parts), axis=0)
        found[rows] = self._hide(number, start, end, on, bounces).reshape(len(rows), len(self.parts))
        return found

    def _hide(self, number: int, start: Floats, end: Floats, way: Floats, bounces: int) -> Bools:
        """Whether a body stands in ways (ray, xyz), unfolded, from start to end (ray, xyz)."""
        length = np.linalg.norm(way, axis=1)
        ahead = way / np.maximum(length, 1e-300)[:, None]
        return hidden(self.met[number], self.medium, start, end, ahead, length, bounces=np.full(len(end), bounces))
