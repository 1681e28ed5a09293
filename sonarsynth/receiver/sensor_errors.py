"""Hydrophones and their electronics as they are: what people write, and what is drawn of it for a sequence."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt, Le
from pydantic import model_validator

from sonarsynth.conventions import (
    Bools,
    Decibels,
    Floats,
    Hertz,
    Ints,
    NonNegativeMetres,
    Number,
    Pascals,
    PositiveSeconds,
    Radians,
    Seconds,
)
from sonarsynth.description import description
from sonarsynth.randomness import stream

Share = Annotated[Number, Ge(0), Le(1)]


@description
class Electronics:
    """Noise of the preamplifiers: independent between hydrophones, added after their faces and their errors, whether
    they hear or not. 20 lg e_n - M: 10 nV/rtHz at -190 dB re 1 V/uPa are 30 dB."""

    level: Annotated[Decibels, Ge(-200), Le(300)] = 30.0
    """Spectral level in dB re 1 uPa2/Hz at high frequencies."""
    corner: Annotated[Hertz, Ge(0)] = 0.0
    """Frequency below which it rises as 1/f."""


@description
class Overload:
    """A channel that was too loud: it is cut at a level, and its gain comes back exponentially after that."""

    level: Annotated[Pascals, Gt(0)]
    """Peak pressure at which it is cut."""
    recovery: PositiveSeconds = 50e-6
    """Time constant of the recovery."""


@description
class SensorErrors:
    """What is wrong with hydrophones and channels. Each is drawn once a sequence, and kept in `/truth/sensors`."""

    gain: Annotated[Decibels, Ge(0), Le(10)] = 0.0
    """Standard deviation of the sensitivity."""
    phase: Annotated[Radians, Ge(0), Le(np.pi)] = 0.0
    """Standard deviation of the phase, alike at all frequencies."""
    delay: Annotated[Seconds, Ge(0), Le(1e-3)] = 0.0
    """Standard deviation of the time at which channels are sampled."""
    position: Annotated[NonNegativeMetres, Le(0.1)] = 0.0
    """Standard deviation of each coordinate. What it is along the axis (x) is a delay, that of sound from ahead."""
    dead: Share = 0.0
    """Share of hydrophones that hear nothing; the electronics still sound."""
    stuck: Share = 0.0
    """Share of channels that give one number for ever."""
    noisy: Share = 0.0
    """Share of channels whose electronics are louder."""
    noisy_by: Annotated[Decibels, Ge(0), Le(100)] = 20.0
    """How much louder those are."""
    cross_talk: Annotated[Decibels, Ge(-200), Le(-6)] | None = None
    """What a channel gets of each neighbour: on a lattice of the next in row and column, else of the next numbers."""
    jitter: Annotated[Seconds, Ge(0)] = 0.0
    """Standard deviation of the time of each sample, the same for all channels, which share one clock."""
    clock_rate: Annotated[Number, Ge(0), Le(1000)] = 0.0
    """Standard deviation of the rate of the clock, in parts per million: time runs from the start of the window."""
    overload: Overload | None = None
    """What a sound does that is too loud; left out: nothing."""
    known: Literal["none", "gain", "all"] = "none"
    """What processing may correct: nothing; gains, and it leaves out dead and stuck ones; or phases and delays as well.
    Positions across the axis, cross-talk, clock and overload stay as they are. Stored signals are never corrected."""

    @model_validator(mode="after")
    def _check(self) -> SensorErrors:
        if self.dead + self.stuck + self.noisy > 1.0:
            raise ValueError("dead, stuck and noisy are more than all hydrophones together")
        return self


class SensorState(IntEnum):
    """What a channel is."""

    WORKING = 0
    DEAD = 1
    STUCK = 2
    NOISY = 3


@dataclass(frozen=True, eq=False)
class DrawnErrors:
    """The errors of a sequence."""

    gain: Floats  # (sensor,) factor of pressure
    phase: Floats  # (sensor,) rad
    delay: Floats  # (sensor,) s: without what the position along x does
    position: Floats  # (sensor, xyz) m: to be added to the nominal one
    state: Ints  # (sensor,) a SensorState
    stuck_at: Floats  # (sensor,) -1 to 1, of full scale
    clock_rate: float  # of time, relative

    @property
    def works(self) -> Bools:
        """Which channels (sensor,) hear at all: neither dead nor stuck."""
        return np.asarray((self.state != SensorState.DEAD) & (self.state != SensorState.STUCK))

    def delays(self, sound_speed: float) -> Floats:
        """Delays (sensor,) in s by which channels hear sound from ahead too late; sound_speed in m/s."""
        return np.asarray(self.delay - self.position[:, 0] / sound_speed)

    def response(self, frequency: Floats, sound_speed: float) -> np.ndarray:
        """Response (sensor, bin) of channels that hear, at frequencies (bin,) Hz."""
        late = self.phase[:, None] - 2.0 * np.pi * np.outer(self.delays(sound_speed), frequency)
        return np.asarray(self.gain[:, None] * np.exp(1j * late))


@lru_cache(maxsize=16)
def drawn_errors(errors: SensorErrors, sensors: int, seed: int, key: int | str) -> DrawnErrors:
    """The errors of a sequence of this seed and key. Each kind has a stream of its own: one changes no other."""

    def normal(quantity: str, *shape: int) -> Floats:
        return stream(seed, "sensors", key, quantity).standard_normal(shape)

    even = stream(seed, "sensors", key, "state").random(sensors)
    edges = np.cumsum([errors.dead, errors.stuck, errors.noisy])
    state = np.select([even < edge for edge in edges], [SensorState.DEAD, SensorState.STUCK, SensorState.NOISY], 0)
    return DrawnErrors(
        gain=10.0 ** (errors.gain * normal("gain", sensors) / 20.0),
        phase=errors.phase * normal("phase", sensors),
        delay=errors.delay * normal("delay", sensors),
        position=errors.position * normal("position", sensors, 3),
        state=state,
        stuck_at=stream(seed, "sensors", key, "stuck").uniform(-1.0, 1.0, sensors),
        clock_rate=1e-6 * errors.clock_rate * float(normal("clock", 1)[0]),
    )
