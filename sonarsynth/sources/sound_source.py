"""What a source of sound says of itself: one that is added says where it is, when it sounds, and what that is like."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, Self

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.method import Method, returned
from sonarsynth.geometry.motion import Motion
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.snap_pulses import Waveform, waveform

Directivity = Callable[[Floats], Floats]
"""Pressure (...) in directions (..., xyz), unit vectors of the world in which sound leaves, over that which the source
level is of. Negative where the phase is turned by pi. One pattern for all of the band: that at its centre."""


@dataclass(frozen=True, eq=False)
class Emission:
    """One emission of one source: gain p(t/width) of its model."""

    position: Floats  # (xyz) m, world
    time: float  # s of the collapse on the clock of the frame
    model: PulseModel  # a bubble at its depth
    source_level: float | None  # dB re 1 uPa at 1 m peak of the model (see `level_below`); None: its own
    gain: float = 1.0
    width: float = 1.0
    velocity: Floats = field(default_factory=lambda: np.zeros(3))  # (xyz) m/s of the source at that time, world
    directivity: Directivity | None = None  # None: the same in all directions
    illuminates: bool = True  # whether echoes of it are traced; if not, it is heard directly alone

    @property
    def waveform(self) -> Waveform:
        """What it shares with snaps that sound alike, but for how loud they are."""
        return waveform(self.model, self.width)


class SoundSource(Method):
    """Something that makes sound at given times of every frame, at rest and alike in all directions unless it says
    otherwise."""

    name: str
    """Name, for people; nothing depends on it."""

    times_field: ClassVar[str] = "times"
    """The field that gives the times, to be named where they are wrong."""
    pulse_field: ClassVar[str] = "kind"
    """The field that gives the pulse."""
    mounted: ClassVar[bool] = False
    """Whether it is mounted on the sonar: then it is somewhere only as `mounted_on` gives it."""
    illuminates: bool = True
    """Whether its echoes are traced; if not, it is heard directly alone."""

    def mounted_on(self, motion: Motion) -> SoundSource:
        """The same on a sonar that moves so; what is not mounted stays where it is."""
        return self

    @property
    def light(self) -> str:
        """What targets are seen by, as cards of datasets say it."""
        return self.kind.replace("_", " ")

    @property
    def as_transmitter(self) -> dict[str, str | float] | None:
        """What a store says of a transmitter of the sonar, in its attribute `transmitters`; None of other sources."""
        return None

    def position_at(self, bottom: float, time: float = 0.0) -> Floats:
        """Where it is (xyz) in m, over a bottom at this depth (m), at a time (s) since the start of the motions."""
        raise NotImplementedError(f"{type(self).__name__} is nowhere")

    def checked_position(self, bottom: float, time: float = 0.0) -> Floats:
        """What `position_at` returns, once it is a place."""
        return np.asarray(returned(self, "position_at", self.position_at(bottom, time), (3,)))

    def on_relief(self, bottom: float, ground: Callable[[Floats], float]) -> Self:
        """The same where the bottom rises over its mean depth (m): by a height (m) at each place (xy). What gives its
        own z stays there."""
        return self

    def velocity(self, time: float) -> Floats:
        """How it moves (xyz) in m/s then: pulses are shorter ahead of it (Doppler)."""
        return np.zeros(3)

    def directivity(self, time: float) -> Directivity | None:
        """How loud it is in each direction then; none: alike in all."""
        return None

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

    def emissions(self, bottom: float, random: np.random.Generator, start: float) -> tuple[Emission, ...]:
        """What it emits in a frame, one a time; random: a stream of its own in each frame; start: time (s) of the
        frame since the start of the motions."""
        return tuple(self.emission(bottom, start, time) for time in self.times)

    def emission(self, bottom: float, start: float, time: float, gain: float = 1.0, width: float = 1.0) -> Emission:
        """What it emits `time` (s) after the instant of a frame, gain times as loud and width times as long."""
        now, model = start + time, self.model(bottom)
        velocity, pattern = np.asarray(returned(self, "velocity", self.velocity(now), (3,))), self.directivity(now)
        motion = velocity, None if pattern is None else partial(self._checked_factor, pattern)
        return Emission(
            self.checked_position(bottom, now), time, model, self.level, gain, width, *motion, self.illuminates
        )

    def _checked_factor(self, pattern: Directivity, direction: Floats) -> Floats:
        """What the pattern that `directivity` returns says of directions (..., xyz), once each has a number."""
        return np.asarray(returned(self, "directivity", pattern(direction), direction.shape[:-1]))
