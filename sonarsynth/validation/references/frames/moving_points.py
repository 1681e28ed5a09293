"""Where the points of a body that moves are, each at a time of its own, and how fast they go there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import ConstantVelocity, Line, Motion, Still, pose, velocity

STEP = 1e-4
"""s: velocities of what turns are differences over so long, either side."""


@dataclass(frozen=True, eq=False)
class Mover:
    """A body, or the sonar, on its motion; times count from an instant of it."""

    motion: Motion
    instant: float  # s since the start of the motion, where the clock shows 0
    moves: bool = True  # false: it stays where it is at the instant

    def places(self, time: Floats) -> tuple[Floats, Floats]:
        """Position (time, xyz) m and rotation from body to world (time, 3, 3) at times (time,) s."""
        t = np.asarray(time, float)
        if self._straight:
            position, rotation, speed = self._line
            return position + (t if self.moves else 0.0 * t)[:, None] * speed, np.broadcast_to(rotation, (len(t), 3, 3))
        poses = [self._pose(elapsed) for elapsed in t.tolist()]
        positions, rotations = np.array([p.position for p in poses]), np.array([p.rotation for p in poses])
        return positions.reshape(-1, 3), rotations.reshape(-1, 3, 3)

    def points(self, body: Floats, time: Floats) -> Floats:
        """Points of the body (time, xyz), given in its own frame, in the world, each at its own time (time,)."""
        position, rotation = self.places(time)
        return np.asarray(position + np.einsum("nij,nj->ni", rotation, body))

    def turned(self, body: Floats, time: Floats) -> Floats:
        """Directions in the frame of the body (time, xyz) in that of the world, at times (time,)."""
        return np.asarray(np.einsum("nij,nj->ni", self.places(time)[1], body))

    def own(self, world: Floats, time: Floats) -> Floats:
        """Points of the world (time, xyz) in the frame of the body as it is at times (time,)."""
        position, rotation = self.places(time)
        return np.asarray(np.einsum("nji,nj->ni", rotation, world - position))

    def velocity(self, body: Floats, time: Floats) -> Floats:
        """Velocity (time, xyz) m/s of points of the body (time, xyz) at times (time,)."""
        if not self.moves:
            return np.zeros((len(time), 3))
        if self._straight:
            return np.broadcast_to(self._line[2], (len(time), 3))
        return (self.points(body, time + STEP) - self.points(body, time - STEP)) / (2.0 * STEP)

    def _pose(self, elapsed: float) -> Pose:
        found = self._poses.get(elapsed)
        if found is None:
            found = self._poses[elapsed] = pose(self.motion, self.instant + elapsed)
        return found

    @cached_property
    def _poses(self) -> dict[float, Pose]:
        """By time: rays are tested against bodies piece by piece, at the same times."""
        return {}

    @property
    def _straight(self) -> bool:
        return not self.moves or isinstance(self.motion, Still | Line | ConstantVelocity)

    @cached_property
    def _line(self) -> tuple[Floats, Floats, Floats]:
        now = pose(self.motion, self.instant)
        return now.position, now.rotation, velocity(self.motion, self.instant)
