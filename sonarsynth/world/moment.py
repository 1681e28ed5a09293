"""The world at one instant: placed bodies and the snaps of that instant. What a frame is traced in."""

from __future__ import annotations

from dataclasses import dataclass

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.world.meshes import Mesh
from sonarsynth.world.sources import LogarithmicBubble


@dataclass(frozen=True, eq=False)
class Body:
    """A target where it is."""

    name: str
    mesh: Mesh
    pose: Pose
    velocity: Floats  # (xyz) m/s, world


@dataclass(frozen=True, eq=False)
class Snap:
    """One snap of one shrimp."""

    position: Floats  # (xyz) m, world
    time: float  # s of the collapse on the clock of the frame
    model: LogarithmicBubble
    source_level: float | None  # dB re 1 uPa at 1 m peak of the unfiltered snap; None: the model's own


@dataclass(frozen=True, eq=False)
class Moment:
    """Everything that is in the water at the instant of a frame."""

    time: float  # s since the start of the trajectory
    bodies: tuple[Body, ...]
    snaps: tuple[Snap, ...]
