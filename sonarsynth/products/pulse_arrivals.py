"""Many pulses of one shape as they reach the array: of the snaps of a chorus, of what scatters at boundaries."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

from sonarsynth.conventions import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class PulseArrivals:
    """Arrivals at the array centre.

    delay       (path,)       s     after the instant of the frame: time 0 of the pulse
    direction   (path, xyz)   -     sonar frame, towards where it comes from
    length      (path,)       m     radius of the wavefront
    gain        (path,)       -     pressure over that of the pulse at 1 m, but for absorption; signed
    phase       (path,)       rad   of lossy reflections
    delay_std   (path,)       s     of roughness, a Gaussian in time
    """

    delay: Floats
    direction: Floats
    length: Floats
    gain: Floats
    phase: Floats
    delay_std: Floats
    sound_speed: float  # m/s of the water at the array

    @property
    def before(self) -> Floats | float:
        """Length (path,) in m of the path before its wave began at what scatters it: it absorbs as well."""
        return 0.0

    def select(self, keep: Bools | Ints) -> Self:
        """Some of the arrivals."""
        columns = {f.name: getattr(self, f.name) for f in fields(self)}
        return type(self)(**{n: v[keep] if n not in self._whole() else v for n, v in columns.items()})

    @staticmethod
    def _whole() -> tuple[str, ...]:
        """Fields that are not of one path each."""
        return ("sound_speed",)


@dataclass(frozen=True, eq=False)
class ReverberationArrivals(PulseArrivals):
    """As `PulseArrivals`, with

    lit_from    (path,)       m     length of the way out
    emission    (path,)       -     number of the emission
    family      (path,)       -     number of the family, of `families`
    energy      (path,)       Pa2 s received at the array centre in the band, absorbed as at its centre
    hidden      (path, part)  -     whether a body hides it from a part of the array, of `parts`
    """

    lit_from: Floats
    emission: Ints
    family: Ints
    energy: Floats
    hidden: Bools
    families: tuple[str, ...]
    left_out: tuple[tuple[str, float], ...]  # families left out, and dB re all of the reverberation of the frame
    parts: tuple[Ints, ...]  # sensors of each part of the array

    @property
    def before(self) -> Floats:
        """As `PulseArrivals.before`."""
        return self.lit_from

    @staticmethod
    def _whole() -> tuple[str, ...]:
        return ("sound_speed", "families", "left_out", "parts")
