"""What a source of sound says of itself: one that is added says where it is, when it sounds, and what that is like."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Method
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.snap_pulses import Waveform, waveform


@dataclass(frozen=True, eq=False)
class Snap:
    """One emission of one source: gain p(t/width) of its model."""

    position: Floats  # (xyz) m, world
    time: float  # s of the collapse on the clock of the frame
    model: PulseModel  # a bubble at its depth
    source_level: float | None  # dB re 1 uPa at 1 m peak of the model (see `level_below`); None: its own
    gain: float = 1.0
    width: float = 1.0

    @property
    def waveform(self) -> Waveform:
        """What it shares with snaps that sound alike, but for how loud they are."""
        return waveform(self.model, self.width)


class SoundSource(Method):
    """Something that makes sound at given times of every frame, from where it is, the same in all directions."""

    name: str
    """For people; nothing depends on it."""

    times_field: ClassVar[str] = "times"
    """The field that gives the times, to be named where they are wrong."""
    pulse_field: ClassVar[str] = "kind"
    """The field that gives the pulse."""

    def place(self, bottom: float) -> Floats:
        """Where it is (xyz) in m, over a bottom at this depth (m)."""
        raise NotImplementedError(f"{type(self).__name__} is nowhere")

    @property
    def times(self) -> tuple[float, ...]:
        """When it sounds (s), after the instant of each frame: time 0 of its pulse."""
        return (0.0,)

    def model(self, bottom: float) -> PulseModel:
        """What it sounds like, where it is."""
        raise NotImplementedError(f"{type(self).__name__} has no pulse")

    @property
    def level(self) -> float | None:
        """Peak source level (dB re 1 uPa at 1 m) to scale the pulse to; none: its own."""
        return None

    @property
    def largest_scales(self) -> tuple[float, float]:
        """Bounds on the gain and the width of what it emits, over its model's; the smallest are their inverses."""
        return 1.0, 1.0

    def emissions(self, bottom: float, random: np.random.Generator) -> tuple[Snap, ...]:
        """What it emits in a frame, one a time; random: a stream of its own in each frame."""
        place, model = self.place(bottom), self.model(bottom)
        return tuple(Snap(place, time, model, self.level) for time in self.times)
