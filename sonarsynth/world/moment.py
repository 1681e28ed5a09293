"""The world at one instant: placed bodies and the snaps of that instant. What a frame is traced in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.world.meshes import Mesh
from sonarsynth.world.snap_pulses import Scales, Waveform, at_depth, waveform
from sonarsynth.world.sources import SnapModel, SnappingShrimp


@dataclass(frozen=True, eq=False)
class Body:
    """A target where it is."""

    name: str
    mesh: Mesh
    pose: Pose
    velocity: Floats  # (xyz) m/s, world


@dataclass(frozen=True, eq=False)
class Snap:
    """One snap of one shrimp: gain p(t/width) of its model."""

    position: Floats  # (xyz) m, world
    time: float  # s of the collapse on the clock of the frame
    model: SnapModel  # a bubble at its depth
    source_level: float | None  # dB re 1 uPa at 1 m peak of the model (see `level_below`); None: its own
    gain: float = 1.0
    width: float = 1.0

    @property
    def waveform(self) -> Waveform:
        """What it shares with snaps that sound alike, but for how loud they are."""
        return waveform(self.model, self.width)


@dataclass(frozen=True, eq=False)
class Moment:
    """Everything that is in the water at the instant of a frame."""

    time: float  # s since the start of the trajectory
    bodies: tuple[Body, ...]
    snaps: tuple[Snap, ...]


def place(shrimp: SnappingShrimp, bed: float) -> Floats:
    """Where a shrimp is (xyz) in m, over a bed at this depth (m)."""
    x, y, *z = shrimp.position
    return np.array([x, y, z[0] if z else shrimp.height - bed])


def model_of(shrimp: SnappingShrimp, bed: float) -> SnapModel:
    """The model of a shrimp's snaps, where it is."""
    return at_depth(shrimp.snap, -float(place(shrimp, bed)[2]))


def snaps_of(shrimp: SnappingShrimp, bed: float, scales: Scales) -> tuple[Snap, ...]:
    """The snaps of a shrimp, with the scales (snap,) that were drawn for them."""
    position, model = place(shrimp, bed), model_of(shrimp, bed)
    drawn = zip(shrimp.snap_times, scales.gain.tolist(), scales.width.tolist(), strict=True)
    return tuple(Snap(position, time, model, shrimp.source_level, gain, width) for time, gain, width in drawn)
