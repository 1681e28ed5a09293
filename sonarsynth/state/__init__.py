"""The world at one instant: placed bodies and the snaps of that instant. What a frame is traced in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.sources.sound_source import Snap

__all__ = ["Snap", "TravelTime", "WorldState", "meeting_times", "positions"]

TravelTime = Callable[[Floats, Floats], Floats]
"""Travel times (pair,) in s from points (pair, xyz) to points (pair, xyz) of the world; NaN where no sound arrives."""

MEETINGS, MET = 20, 1e-9
"""Rounds of solving for when sound meets what moves, at most; s: enough. Each round leaves v/c of the error."""


@dataclass(frozen=True, eq=False)
class WorldState:
    """Everything that is in the water at the instant of a frame."""

    time: float  # s since the start of the trajectory
    bodies: tuple[PlacedTarget, ...]
    snaps: tuple[Snap, ...]


def meeting_times(tracks: Sequence[Track], snaps: tuple[Snap, ...], travel_time: TravelTime) -> Floats:
    """When the sound of each snap meets what is on each track (snap, track), s on the clock of the frame.

    tracks: from the instant of the frame on; travel_time: of direct paths. Solves t = t_snap + T(x(t)), x the track, by
    iteration; NaN where no sound arrives.
    """
    emitted = np.array([snap.time for snap in snaps])[:, None] + np.zeros((len(snaps), len(tracks)))
    start = np.array([snap.position for snap in snaps]).reshape(-1, 1, 3) + np.zeros((len(tracks), 3))
    met, arrives = emitted, np.ones(emitted.shape, bool)
    for _ in range(MEETINGS if emitted.size else 0):
        found = emitted + travel_time(start.reshape(-1, 3), positions(tracks, met).reshape(-1, 3)).reshape(met.shape)
        arrives = np.isfinite(found)
        late = np.abs(found - met)[arrives].max(initial=0.0)
        met = np.where(arrives, found, met)
        if late <= MET or all(track.still for track in tracks):
            break
    return np.where(arrives, met, np.nan)


def positions(tracks: Sequence[Track], times: Floats) -> Floats:
    """Where tracks are (snap, track, xyz) m, world, at times (snap, track) s of the frame; NaN where these are."""
    places = np.empty((*times.shape, 3))
    for number, track in enumerate(tracks):
        places[:, number] = track.positions(np.nan_to_num(times[:, number]))
    return np.where(np.isnan(times)[..., None], np.nan, places)
