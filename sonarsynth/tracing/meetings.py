"""When and where the sound of each snap meets each body and the array: the poses that a frame is traced between.

A body that moves is met elsewhere by each snap, and an array that moves hears the echoes of each body elsewhere. Snaps
and bodies for which that is nearly the same are traced together; by what is left paths are carried (`tracing.doppler`).
A body that turns shows another side to what comes later by surface and bottom: these families are traced with it as it
has turned by then.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sonarsynth.conventions import Floats, depth
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation.images import lengths
from sonarsynth.state import Emission, FrameContext, meeting_times, positions
from sonarsynth.tracing.doppler import Meeting


@dataclass(frozen=True, eq=False)
class TracingGroup:
    """What is traced together: some snaps, and what scatters whose echoes of them are heard at about one place."""

    snaps: tuple[int, ...]
    owners: tuple[int, ...]  # index into `FrameContext.scattering`
    ways: tuple[int, ...] | None  # families (`images.family`) by which sound comes to them; None: all
    bounces: int  # reflections, at most, of what goes on from there
    bodies: tuple[PlacedTarget, ...]  # all of them, where the sound meets them
    meeting: Meeting

    @property
    def direct(self) -> bool:
        """Whether the family without reflections is among the ways."""
        return self.ways is None or 0 in self.ways


@dataclass(frozen=True, eq=False)
class MeetingTimes:
    """When the sound of each snap meets the middle of what scatters, by each family, and when the array hears that."""

    bodies: tuple[PlacedTarget, ...]
    sonar: Track
    met: Floats  # (family, snap, owner) s
    arrival_time: Floats  # (family, snap, owner) s
    shared: float
    wavenumber: float  # rad/m at the highest frequency
    aperture: float  # m

    def classes(self, snap: int) -> list[tuple[tuple[int, ...], tuple[int, ...] | None]]:
        """Owners, ascending, whose echoes of a snap the array hears at about one place, and the ways by which its sound
        meets them in about one attitude."""
        ways, groups = [self._ways(snap, owner) for owner in range(self.met.shape[2])], []
        for alike in dict.fromkeys(ways):
            for families in alike:
                arrival_time = self.when(snap, families)[1]
                waiting = [n for n in np.argsort(arrival_time, kind="stable").tolist() if ways[n] == alike]
                while waiting:
                    first = float(arrival_time[waiting[0]])
                    track = self.sonar.later(first)
                    near = [n for n in waiting if self._array_near(track, float(arrival_time[n]) - first)]
                    groups.append((tuple(sorted(near)), families))
                    waiting = [n for n in waiting if n not in near]
        return groups or [((), None)]

    def _ways(self, snap: int, owner: int) -> tuple[tuple[int, ...] | None, ...]:
        """Families by which the sound of a snap meets an owner, those together that meet it in about one attitude."""
        if owner >= len(self.bodies) or (body := self.bodies[owner]).track.straight:
            return (None,)
        met, groups = self.met[:, snap, owner], []
        waiting = np.argsort(met, kind="stable").tolist()
        while waiting:
            first = float(met[waiting[0]])
            track = body.track.later(first)
            near = [n for n in waiting if self._goes_on(track, float(met[n]) - first, body.mesh.radius)]
            groups.append(tuple(sorted(near)))
            waiting = [n for n in waiting if n not in near]
        return tuple(groups) if len(groups) > 1 else (None,)

    def when(self, snap: int, ways: tuple[int, ...] | None) -> tuple[Floats, Floats]:
        """When the first sound of a snap by some ways meets each owner (owner,), and when the array hears that (s)."""
        some = [0] if ways is None else list(ways)
        return self.met[some, snap].min(axis=0), self.arrival_time[some, snap].min(axis=0)

    def serves(self, occasion: TracingGroup, snap: int) -> bool:
        """Whether what is traced on an occasion serves another snap as well."""
        met, arrival_time = self.when(snap, occasion.ways)
        late = (met - occasion.meeting.met)[: len(occasion.bodies)]  # the others are at rest
        for body, seconds in zip(occasion.bodies, late.tolist(), strict=True):
            if not self._near(body.track, seconds, body.mesh.radius, body.mesh.radius):
                return False
        after = arrival_time[list(occasion.owners)] - occasion.meeting.arrival_time
        return all(self._array_near(occasion.meeting.sonar, seconds) for seconds in after.tolist())

    def _array_near(self, sonar: Track, seconds: float) -> bool:
        smallest = min((body.mesh.radius for body in self.bodies), default=np.inf)
        return self._near(sonar, seconds, smallest, self.aperture)

    def _near(self, track: Track, seconds: float, reach: float, size: float) -> bool:
        """Whether what is `size` m large moves by little in some seconds, and that as its velocity and spin say."""
        if track.still or seconds == 0.0:
            return True
        if np.linalg.norm(track.velocity * seconds) > self.shared * reach:
            return False
        return self._goes_on(track, seconds, size)

    def _goes_on(self, track: Track, seconds: float, size: float) -> bool:
        """Whether what is `size` m large moves as its velocity and spin say, in some seconds."""
        return self.beyond(track, seconds, size) <= self.shared

    def beyond(self, track: Track, seconds: float, size: float) -> float:
        """By how much what is `size` m large moves more than its velocity and spin say, in some seconds: radians of the
        highest frequency."""
        shift = track.velocity * seconds
        then, turn = track.later(seconds).pose, track.pose.rotation.T
        off = np.linalg.norm(then.position - track.pose.position - shift)
        turned = turn + np.cross(track.spin * seconds, turn)  # rows: the axes
        return float((off + size * np.linalg.norm(then.rotation.T - turned)) * self.wavenumber)


def family_times(
    tracks: Sequence[Track], snaps: tuple[Emission, ...], bottom_depth: float, bounces: int, speed: float
) -> Floats:
    """When the sound of each snap meets what is on each track by each family of up to so many reflections (family,
    snap, track), s on the clock of the frame: by straight lines and their images, at one speed (m/s)."""

    def travel_time(start: Floats, end: Floats, number: int) -> Floats:
        return np.asarray(lengths(start, end, bottom_depth, bounces)[number] / speed)

    families = [partial(travel_time, number=number) for number in range(2 * bounces + 1)]
    return np.array([meeting_times(tracks, snaps, family) for family in families])


def meetings(context: FrameContext, sonar: Track, bounces: int) -> MeetingTimes:
    """By straight lines and, of up to so many reflections, their images; sonar: the track of the array."""
    receiver, bottom_depth = context.receiver, context.medium.depth
    speed = float(context.medium.profile.at(depth(sonar.pose.position)))
    tracks = [surface.track.part(surface.middle) for surface in context.scattering]
    met = family_times(tracks, context.snaps, bottom_depth, bounces, speed)
    arrival_time = np.array([hearing_times(positions(tracks, of), of, sonar, speed) for of in met])
    wavenumber = 2.0 * np.pi * receiver.band[1] / speed
    return MeetingTimes(
        context.bodies, sonar, met, arrival_time, context.tolerances.shared, wavenumber, receiver.elements.aperture
    )


def occasions(context: FrameContext, sonar: Track, bounces: int) -> list[TracingGroup]:
    """Poses to trace the echoes of each snap from each body between; arguments as of `meetings`."""
    bodies, turns = context.bodies, any(not body.track.straight for body in context.bodies)
    times = meetings(context, sonar, bounces if turns else 0)
    groups: list[TracingGroup] = []
    for snap in range(len(context.snaps)):
        for owners, ways in times.classes(snap):
            for number, group in enumerate(groups):
                if (group.owners, group.ways) == (owners, ways) and times.serves(group, snap):
                    groups[number] = replace(group, snaps=(*group.snaps, snap))
                    break
            else:
                when, heard = times.when(snap, ways)
                placed = tuple(body.later(late) for body, late in zip(bodies, when.tolist(), strict=False))
                late = float(heard[list(owners)].mean()) if owners else 0.0
                left = bounces - (min(ways) + 1) // 2 if ways else bounces
                meeting = Meeting(when, late, sonar.later(late))
                groups.append(TracingGroup((snap,), owners, ways, left, placed, meeting))
    return groups


def hearing_times(position: Floats, sent: Floats, sonar: Track, speed: float) -> Floats:
    """When an array on a track hears what was sent from places (..., xyz) m at times (...) s, by straight lines."""
    arrival_time = sent
    for _ in range(1 if sonar.still else 6):
        arrival_time = sent + np.linalg.norm(sonar.positions(arrival_time) - position, axis=-1) / speed
    return np.asarray(arrival_time)
