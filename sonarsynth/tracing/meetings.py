"""When and where the sound of each snap meets each body and the array: the poses that a frame is traced between.

A body that moves is met elsewhere by each snap, and an array that moves hears the echoes of each body elsewhere. Snaps
and bodies for which that is nearly the same are traced together; by what is left paths are carried (`tracing.doppler`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.state import FrameContext, meeting_times, positions
from sonarsynth.tracing.doppler import Meeting


@dataclass(frozen=True, eq=False)
class TracingGroup:
    """What is traced together: some snaps, and what scatters whose echoes of them are heard at about one place."""

    snaps: tuple[int, ...]
    owners: tuple[int, ...]  # index into `FrameContext.scattering`
    bodies: tuple[PlacedTarget, ...]  # all of them, where the sound meets them
    meeting: Meeting


@dataclass(frozen=True, eq=False)
class _MeetingTimes:
    """When the sound of each snap meets the middle of what scatters, and when the array hears that."""

    bodies: tuple[PlacedTarget, ...]
    sonar: Track
    met: Floats  # (snap, owner) s
    arrival_time: Floats  # (snap, owner) s
    shared: float
    wavenumber: float  # rad/m at the highest frequency
    aperture: float  # m

    def classes(self, snap: int) -> list[tuple[int, ...]]:
        """Owners, ascending, whose echoes of a snap the array hears at about one place."""
        waiting, groups = np.argsort(self.arrival_time[snap], kind="stable").tolist(), []
        while waiting:
            first = float(self.arrival_time[snap, waiting[0]])
            track = self.sonar.later(first)
            near = [n for n in waiting if self._array_near(track, float(self.arrival_time[snap, n]) - first)]
            groups.append(tuple(sorted(near)))
            waiting = [n for n in waiting if n not in near]
        return groups or [()]

    def serves(self, occasion: TracingGroup, snap: int) -> bool:
        """Whether what is traced on an occasion serves another snap as well."""
        met = (self.met[snap] - occasion.meeting.met)[: len(occasion.bodies)]  # the others are at rest
        for body, late in zip(occasion.bodies, met.tolist(), strict=True):
            if not self._near(body.track, late, body.mesh.radius, body.mesh.radius):
                return False
        late = self.arrival_time[snap, list(occasion.owners)] - occasion.meeting.arrival_time
        return all(self._array_near(occasion.meeting.sonar, seconds) for seconds in late.tolist())

    def _array_near(self, sonar: Track, seconds: float) -> bool:
        smallest = min((body.mesh.radius for body in self.bodies), default=np.inf)
        return self._near(sonar, seconds, smallest, self.aperture)

    def _near(self, track: Track, seconds: float, reach: float, size: float) -> bool:
        """Whether what is `size` m large moves by little in some seconds, and that as its velocity and spin say."""
        if track.still or seconds == 0.0:
            return True
        shift = track.velocity * seconds
        if np.linalg.norm(shift) > self.shared * reach:
            return False
        then, turn = track.later(seconds).pose, track.pose.rotation.T
        off = np.linalg.norm(then.position - track.pose.position - shift)
        turned = turn + np.cross(track.spin * seconds, turn)  # rows: the axes
        return bool((off + size * np.linalg.norm(then.rotation.T - turned)) * self.wavenumber <= self.shared)


def occasions(context: FrameContext, sonar: Track) -> list[TracingGroup]:
    """Poses to trace the echoes of each snap from each body between, by the times of straight lines; sonar: of the
    array."""
    bodies, snaps, receiver = context.bodies, context.snaps, context.receiver
    speed = float(context.medium.profile.at(depth(sonar.pose.position)))
    tracks = [surface.track.part(surface.middle) for surface in context.scattering]
    met = meeting_times(tracks, snaps, lambda start, end: np.linalg.norm(end - start, axis=1) / speed)
    arrival_time = hearing_times(positions(tracks, met), met, sonar, speed)
    wavenumber = 2.0 * np.pi * receiver.band[1] / speed
    times = _MeetingTimes(
        bodies, sonar, met, arrival_time, context.tolerances.shared, wavenumber, receiver.elements.aperture
    )
    groups: list[TracingGroup] = []
    for snap in range(len(snaps)):
        for owners in times.classes(snap):
            for number, group in enumerate(groups):
                if group.owners == owners and times.serves(group, snap):
                    groups[number] = replace(group, snaps=(*group.snaps, snap))
                    break
            else:
                placed = tuple(body.later(late) for body, late in zip(bodies, met[snap].tolist(), strict=False))
                late = float(arrival_time[snap, list(owners)].mean()) if owners else 0.0
                groups.append(TracingGroup((snap,), owners, placed, Meeting(met[snap], late, sonar.later(late))))
    return groups


def hearing_times(position: Floats, sent: Floats, sonar: Track, speed: float) -> Floats:
    """When an array on a track hears what was sent from places (..., xyz) m at times (...) s, by straight lines."""
    arrival_time = sent
    for _ in range(1 if sonar.still else 6):
        arrival_time = sent + np.linalg.norm(sonar.positions(arrival_time) - position, axis=-1) / speed
    return np.asarray(arrival_time)
