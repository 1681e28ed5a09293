"""A sonar's own transmitter: a source that is mounted on the sonar, and what it sends."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from annotated_types import Ge, Gt, Le
from pydantic import model_validator

from sonarsynth.conventions import (
    PINGS,
    Decibels,
    Floats,
    Number,
    Position,
    PositiveHertz,
    PositiveSeconds,
    Radians,
    Seconds,
)
from sonarsynth.conventions import direction as direction_of
from sonarsynth.description import BY_KIND, description
from sonarsynth.equations.bubble import waveforms
from sonarsynth.equations.bubble.pulses import Pulse
from sonarsynth.geometry.motion import Motion, pose, spin, velocity
from sonarsynth.sources.pulse_model import PulseModel
from sonarsynth.sources.recordings import RecordedSnap
from sonarsynth.sources.snap_models import Gabor
from sonarsynth.sources.sound_source import Directivity, SoundSource

HALF_POWER: Final = 0.44295
"""sinc(x)^2 = 1/2 there, sinc(x) = sin(pi x)/(pi x)."""
BAFFLED: Final = 0.25
"""Sine of the angle behind the plane of the face from which on only what passes the baffle is heard: 14 degrees."""


@description
class Sweep(PulseModel):
    """A tone whose frequency rises or falls, with raised-cosine ends (Tukey); with one frequency, a tone burst."""

    kind: Literal["sweep"] = "sweep"
    start: PositiveHertz
    """Frequency at the beginning."""
    stop: PositiveHertz
    """Frequency at the end."""
    duration: PositiveSeconds
    """Length, ends included. Time 0 is its middle."""
    law: Literal["linear", "hyperbolic"] = "linear"
    """How the frequency changes: evenly, or so that its inverse does (then a pulse that is stretched by motion is
    itself, later)."""
    taper: Annotated[Number, Gt(0), Le(1)] = 0.1
    """Share of the length in which it rises and falls, both together."""

    def pulse(self, depth: float, highest: float) -> Pulse:
        """As `PulseModel.pulse`."""
        return waveforms.sweep(self.start, self.stop, self.duration, self.taper, self.law == "hyperbolic", highest)


PingModel = Annotated[Sweep | Gabor | RecordedSnap, BY_KIND]
"""The pulses that a transmitter sends, by `kind`."""


@description
class TransmitBeam:
    """Where a rectangular face sends its sound: sinc sinc, alike at all frequencies of the pulse."""

    azimuth_width: Annotated[Radians, Gt(0), Le(np.pi)]
    """Angle across between the directions of half the power."""
    elevation_width: Annotated[Radians, Gt(0), Le(np.pi)]
    """The same up and down."""
    azimuth: Radians = 0.0
    """Where its axis points, in the frame of the sonar: to port of straight ahead."""
    elevation: Annotated[Radians, Ge(-0.5 * np.pi), Le(0.5 * np.pi)] = 0.0
    """The same upwards."""
    baffle: Annotated[Decibels, Ge(0), Le(200)] = 30.0
    """How much quieter than on its axis it is behind its face, alike in all directions from 14 degrees behind the plane
    of the face on."""

    def pattern(self, towards: Floats) -> Floats:
        """Pressure (...) over that on the axis in directions (..., xyz), unit vectors in the frame of the sonar."""
        ahead = direction_of(self.azimuth, self.elevation)
        across = direction_of(self.azimuth + 0.5 * np.pi, 0.0)
        up = direction_of(self.azimuth, self.elevation + 0.5 * np.pi)
        y, z = (HALF_POWER / np.sin(0.5 * w) for w in (self.azimuth_width, self.elevation_width))
        behind = np.sin(0.5 * np.pi * np.clip(-(towards @ ahead) / BAFFLED, 0.0, 1.0)) ** 2
        face = np.sinc(y * (towards @ across)) * np.sinc(z * (towards @ up))
        return np.asarray((1.0 - behind) * face + behind * 10.0 ** (-self.baffle / 20.0))


@description
class Transmitter(SoundSource):
    """The sonar's own transmitter, which goes where the sonar goes. With `processing.locating: {kind: trigger}` the
    sonar knows when and where it sends, and what."""

    kind: Literal["transmitter"] = "transmitter"
    name: str = "transmitter"
    """Name, for people; nothing depends on it."""
    position: Position
    """Position (x, y, z) in the frame of the sonar: ahead, to port and up from the middle of the array."""
    pulse: PingModel
    """What it sends."""
    source_level: Annotated[Decibels, Ge(-200), Le(300)]
    """Peak source level (dB re 1 uPa at 1 m) on the axis of its beam; the root mean square of a tone is 3 dB less."""
    beam: TransmitBeam | None = None
    """Where it sends it; left out: everywhere alike."""
    ping_times: tuple[Seconds, ...] = (0.0,)
    """Times (s) after the instant of each frame of the middle of its pulses (time 0 of a recording); none: silent."""

    times_field: ClassVar[str] = "ping_times"
    pulse_field: ClassVar[str] = "pulse"
    mounted: ClassVar[bool] = True

    @model_validator(mode="after")
    def _check(self) -> Transmitter:
        if not any(self.position):
            raise ValueError("position is the middle of the array: say where beside it the transmitter is")
        return self

    def mounted_on(self, motion: Motion) -> SoundSource:
        """As `SoundSource.mounted_on`."""
        return _Mounted(motion=motion, **{field.name: getattr(self, field.name) for field in fields(self)})

    @property
    def light(self) -> str:
        """As `SoundSource.light`."""
        return PINGS

    @property
    def as_transmitter(self) -> dict[str, str | float]:
        """As `SoundSource.as_transmitter`: place (m), level (dB), and what a sweep and a beam are (Hz, s, degrees)."""
        said: dict[str, str | float] = dict(zip(("name", *"xyz"), (self.name, *self.position), strict=True))
        said["source_level"] = self.source_level
        if isinstance(self.pulse, Sweep):
            start, stop = self.pulse.start, self.pulse.stop
            kind = "CW" if start == stop else {"linear": "LFM", "hyperbolic": "HFM"}[self.pulse.law]
            said |= {"type": kind, "start": start, "stop": stop, "duration": self.pulse.duration}
        if self.beam is not None:
            angles = ("azimuth", "elevation", "azimuth_width", "elevation_width")
            said |= {name: round(float(np.rad2deg(getattr(self.beam, name))), 9) for name in angles}
        return said

    @property
    def times(self) -> tuple[float, ...]:
        """As `SoundSource.times`."""
        return self.ping_times

    def model(self, bottom: float) -> PulseModel:
        """As `SoundSource.model`."""
        return self.pulse

    @property
    def level(self) -> float | None:
        """As `SoundSource.level`."""
        return self.source_level


@dataclass(frozen=True, kw_only=True)
class _Mounted(Transmitter):
    """A transmitter on a sonar that moves so."""

    motion: Motion

    def position_at(self, bottom: float, time: float = 0.0) -> Floats:
        """As `SoundSource.position_at`."""
        return pose(self.motion, time).to_world(self.position)

    def velocity(self, time: float) -> Floats:
        """As `SoundSource.velocity`."""
        arm = pose(self.motion, time).turn_to_world(self.position)
        return np.asarray(velocity(self.motion, time) + np.cross(spin(self.motion, time), arm))

    def directivity(self, time: float) -> Directivity | None:
        """As `SoundSource.directivity`."""
        return None if self.beam is None else partial(_pattern, self.beam, pose(self.motion, time).rotation)


def _pattern(beam: TransmitBeam, rotation: Floats, towards: Floats) -> Floats:
    """`TransmitBeam.pattern` in directions (..., xyz) of the world; rotation of the sonar to the world."""
    return beam.pattern(towards @ rotation)
