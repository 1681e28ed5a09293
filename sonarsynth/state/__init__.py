"""The world at one instant: water, placed bodies, the snaps of that instant, the array. What a frame is traced in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.geometry import Pose, turned
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.receiver import Elements, Sonar
from sonarsynth.scattering import FacetLaw, Scatterers
from sonarsynth.sources.sound_source import Emission

if TYPE_CHECKING:
    from sonarsynth.environment.absorption import DepthAbsorption

__all__ = [
    "Emission",
    "FrameContext",
    "Medium",
    "OcclusionPoint",
    "Receiver",
    "Survey",
    "Tolerances",
    "Trigger",
    "WorldState",
    "meeting_times",
    "positions",
]

OcclusionPoint = Literal["centre", "sensors"]
"""From where facets are seen: the middle of the array or part, or each hydrophone for itself."""

TravelTime = Callable[[Floats, Floats], Floats]
"""Travel times (pair,) in s from points (pair, xyz) to points (pair, xyz) of the world; NaN where no sound arrives."""

MEETINGS, MET = 20, 1e-7
"""Rounds of solving for when sound meets what moves, at most; s: the last change that is enough: v/c of it is left."""


@dataclass(frozen=True, eq=False)
class WorldState:
    """Everything that is in the water at the instant of a frame."""

    time: float  # s since the start of the trajectory
    bodies: tuple[PlacedTarget, ...]
    snaps: tuple[Emission, ...]
    scatterers: tuple[Scatterers, ...] = field(default=(), kw_only=True)  # that belong to no body, and hide nothing


@dataclass(frozen=True, eq=False)
class Medium:
    """The water between surface and bottom."""

    environment: Environment
    profile: Profile  # sound speed, as rays go through it
    absorption: float | DepthAbsorption = 0.0  # dB/m at the centre of the band: the same at all depths, or at each

    @property
    def depth(self) -> float:
        """Depth of the bottom in m."""
        return self.environment.depth

    @property
    def mean_absorption(self) -> float:
        """dB/m at the centre of the band: the mean over all depths."""
        return self.absorption if isinstance(self.absorption, float) else self.absorption.mean

    def absorbed(self, length: Floats, start: Floats, end: Floats, climb: Floats, bounces: Ints) -> Floats:
        """What is absorbed (path,) in dB, at the centre of the band, along paths of some length (path,) m; the rest as
        of `DepthAbsorption.along`."""
        loss = self.absorption
        return np.asarray(length * (loss if isinstance(loss, float) else loss.along(start, end, climb, bounces)))


@dataclass(frozen=True, eq=False)
class Receiver:
    """The array, or a part of it, where it is."""

    pose: Pose
    elements: Elements
    sonar: Sonar = field(default_factory=Sonar)
    track: Track | None = None  # of the array, if it and bodies move while sound is under way; None: all stays
    instant: float = 0.0  # s after that of the frame: when it is there

    @property
    def band(self) -> tuple[float, float]:
        """Hz: its lowest and highest frequency."""
        return self.sonar.band.low, self.sonar.band.high

    @property
    def centre(self) -> float:
        """Hz: centre of the band."""
        return self.sonar.band.centre

    def pose_at(self, time: float) -> Pose:
        """Of the array, at a time (s) after the instant of the frame."""
        return self.at(time).pose

    def at(self, time: float) -> Receiver:
        """The same where it is at a time (s) after the instant of the frame; without a track as it is."""
        if self.track is None:
            return self
        track = self.track.later(time - self.instant)
        return replace(self, pose=track.pose, track=track, instant=time)

    def speed(self, medium: Medium) -> float:
        """Of sound at the middle of the array, m/s."""
        return float(medium.profile.at(depth(self.pose.position)))

    def turn_to_array(self, towards: Floats, time: Floats) -> Floats:
        """Unit vectors (path, xyz) of the world in the frame of the array at times (path,), s after the instant of the
        frame: by then it has turned at its spin of its `instant`."""
        spin = np.zeros(3) if self.track is None else self.pose.turn_to_body(self.track.spin)
        return turned(np.asarray(towards @ self.pose.rotation), spin, self.instant - time)


@dataclass(frozen=True, eq=False)
class Trigger:
    """What the sonar is told of an emission."""

    time: float  # s on the clock of the frame: peak of the envelope of its pulse in the band, where it is emitted
    position: Floats  # (xyz) m, world


@dataclass(frozen=True, eq=False)
class Survey:
    """The water as the sonar knows it, and the emissions that it is told of."""

    bottom: float  # m: depth of the bottom, positive down, where sources are known to be
    profile: Profile  # sound speed, from a cast: to trace rays through, or for what straight ones may cost
    triggers: tuple[Trigger, ...] = ()  # loudest first, as far as it has any


@dataclass(frozen=True)
class Tolerances:
    """What tracing may leave out."""

    negligible: float = 1e-7
    """The faintest echoes of a snap from each target are left out, so many that their powers together stay below this
    part of the power of all from there (70 dB); each counts with the largest amplitude that it has anywhere on the
    array. Of coherent ones, which add by amplitude, so many that their amplitudes together stay below the root of this
    part of that of the largest."""
    shared: float = 1e-2
    """What moves by less than this part of the radius of a body from one snap to another, or turns by less than this
    (rad) in the sight of snap and array from one family of rays to another, and keeps as near to what its velocity and
    spin say, in radians of the highest frequency, is traced for both together."""
    occlusion: OcclusionPoint = "centre"
    """From where facets must be seen."""
    every: int = 1
    """Every so manieth facet is traced, to measure errors on some; all of them hide what is behind."""


@dataclass(frozen=True, eq=False)
class FrameContext(WorldState):
    """All that the paths of a frame depend on but how sound travels. It is truth: what locates and ranges sees none."""

    medium: Medium
    receiver: Receiver
    laws: tuple[FacetLaw, ...] = ()  # how the facets of each body scatter
    tolerances: Tolerances = Tolerances()

    @cached_property
    def scattering(self) -> tuple[Scatterers, ...]:
        """Everything that scatters: the facets of each body, then what belongs to none."""
        laws = self.laws or (FacetLaw(),) * len(self.bodies)
        of_bodies = (Scatterers.of_body(body, law) for body, law in zip(self.bodies, laws, strict=True))
        return (*of_bodies, *self.scatterers)


def meeting_times(
    tracks: Sequence[Track], snaps: tuple[Emission, ...], travel_time: TravelTime, families: tuple[int, ...] = ()
) -> Floats:
    """When the sound of each snap meets what is on each track (*families, snap, track), s on the clock of the frame.

    tracks: from the instant of the frame on; travel_time: of direct paths, or of so many families of rays, each
    on pairs of its own. Solves t = t_snap + T(x(t)), x the track, by iteration; NaN where no sound arrives.
    """
    shape = (*families, len(snaps), len(tracks))
    emitted = np.broadcast_to(np.array([snap.time for snap in snaps])[:, None], shape)
    start = np.broadcast_to(np.array([snap.position for snap in snaps]).reshape(-1, 1, 3), (*shape, 3))
    met, arrives = emitted, np.ones(emitted.shape, bool)
    for _ in range(MEETINGS if emitted.size else 0):
        arrival = emitted + travel_time(start.reshape(-1, 3), positions(tracks, met).reshape(-1, 3)).reshape(met.shape)
        arrives = np.isfinite(arrival)
        late = np.abs(arrival - met)[arrives].max(initial=0.0)
        met = np.where(arrives, arrival, met)
        if late <= MET or all(track.still for track in tracks):
            break
    return np.where(arrives, met, np.nan)


def positions(tracks: Sequence[Track], times: Floats) -> Floats:
    """Where tracks are (..., track, xyz) m, world, at times (..., track) s of the frame; NaN where these are."""
    places, unknown = np.empty((*times.shape, 3)), np.isnan(times)
    known = np.where(unknown, 0.0, times)
    for number, track in enumerate(tracks):
        places[..., number, :] = track.positions(known[..., number])
    places[unknown] = np.nan
    return places
