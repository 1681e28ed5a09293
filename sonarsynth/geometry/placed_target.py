"""A target where it is at an instant, and how it moves from there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Motion, Track

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])


@dataclass(frozen=True, eq=False)
class PlacedTarget:
    """A target where it is."""

    name: str
    mesh: Mesh
    pose: Pose
    velocity: Floats  # (xyz) m/s, world
    motion: Motion | None = None  # that brought it here; None: it goes on at its velocity, and does not turn
    time: float = 0.0  # s: of the motion

    @property
    def track(self) -> Track:
        """Of its origin."""
        return Track(self.pose, self.velocity, self.motion, self.time)

    @property
    def box(self) -> Floats:
        """(8, xyz) m, world: corners of the oriented bounding box, z changing fastest, x slowest."""
        low, high = self.mesh.box
        return self.pose.to_world(low + _CORNERS * (high - low))

    def later(self, seconds: float) -> PlacedTarget:
        """The body where it will be, or was, so many seconds (s) after."""
        track = self.track.later(seconds)
        return replace(self, pose=track.pose, velocity=track.velocity, time=track.time)

    @property
    def frozen(self) -> PlacedTarget:
        """The body at rest where it is."""
        return replace(self, velocity=np.zeros(3), motion=None)
