"""When and where the sound of each snap meets each body and the array: the poses that a frame is traced between.

A body that moves is met elsewhere by each snap, and an array that moves hears the echoes of each body elsewhere. Snaps
and bodies for which that is nearly the same are traced together; by what is left paths are carried (`tracing.doppler`).
What comes later by surface and bottom meets a body that has turned, or has gone on before others, and an array that has
turned: where that shows or hides other facets, or moves them otherwise, these families are traced anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TypeVar

import numpy as np

from sonarsynth.conventions import Bools, Floats, depth
from sonarsynth.equations.scattering.lobes import dot
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.propagation.images import lengths
from sonarsynth.state import Emission, FrameContext, meeting_times, positions
from sonarsynth.tracing.doppler import Meeting, Ways

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class TracingGroup:
    """What is traced together: some snaps, and what scatters whose echoes of them are heard at about one place."""

    snaps: tuple[int, ...]
    owners: tuple[int, ...]  # index into `FrameContext.scattering`
    ways: Ways | None  # None: all
    bounces: int  # reflections, at most, of what goes on from there
    bodies: tuple[PlacedTarget, ...]  # all of them, where the sound meets them
    meeting: Meeting

    @property
    def direct(self) -> bool:
        """Whether what is not reflected is among the ways."""
        return self.ways is None or (0, 0) in self.ways

    @property
    def reflected(self) -> bool:
        """Whether sound comes to them by reflections: families are picked, and others than the direct one."""
        return self.ways is not None and any(out for out, _ in self.ways)


@dataclass(frozen=True, eq=False)
class MeetingTimes:
    """When the sound of each snap meets the middle of what scatters, by each family, and when the array hears that."""

    bodies: tuple[PlacedTarget, ...]
    sonar: Track
    met: Floats  # (family, snap, owner) s
    arrival_time: Floats  # (family, family on, snap, owner) s
    direct_time: Floats  # (family, snap) s: when the array hears the snap itself
    snaps: tuple[Emission, ...]
    middles: tuple[Track, ...]  # of owners
    radius: Floats  # (owner,) m
    speed: float  # m/s, of sound
    bounces: int  # of a path, at most
    shared: float
    wavenumber: float  # rad/m at the highest frequency
    aperture: float  # m

    def classes(self, snap: int) -> list[tuple[tuple[int, ...], Ways | None]]:
        """Owners, ascending, whose echoes of a snap the array hears at about one place, and the ways by which its sound
        meets them, and they the array, in about one attitude."""
        ways, found = [self._ways(snap, owner) for owner in range(self.met.shape[2])], []
        for alike in dict.fromkeys(ways):
            for families in alike:
                arrival_time = self.when(snap, families)[1]

                def near(first: int, n: int, times: Floats = arrival_time) -> bool:
                    return self._array_near(self.sonar.later(float(times[first])), float(times[n] - times[first]))

                waiting = [n for n in np.argsort(arrival_time, kind="stable").tolist() if ways[n] == alike]
                found += [(tuple(sorted(of)), families) for of in groups(waiting, near)]
        return found or [((), None)]

    def _ways(self, snap: int, owner: int) -> tuple[Ways | None, ...]:
        """Ways by which the sound of a snap meets an owner, and that the array, those together that meet both in about
        one attitude."""
        body = self.bodies[owner] if owner < len(self.bodies) else None
        met, arrival_time = self.met[:, snap, owner], self.arrival_time[:, :, snap, owner]
        if len(met) == 1:
            return (None,)
        in_sight = cache(partial(self._in_sight, snap, owner, self._between(snap, owner)))

        def near(first: tuple[int, int], pair: tuple[int, int]) -> bool:
            heard = self._alike(self.sonar, float(arrival_time[first]), float(arrival_time[pair]), self.aperture)
            times = float(met[first[0]]), float(met[pair[0]])
            alike = heard and (body is None or self._alike(body.track, *times, body.mesh.radius))
            return alike and bool(in_sight(first)[pair])

        order = [divmod(n, len(met)) for n in np.argsort(arrival_time, axis=None, kind="stable").tolist()]
        found = [tuple(sorted(of)) for of in groups(order, near) if not self.every.isdisjoint(of)]
        return tuple(found) if len(found) > 1 else (None,)

    def _in_sight(self, snap: int, owner: int, between: Bools, first: tuple[int, int]) -> Bools:
        """Whether an owner that sound meets by other ways (family, family on) is lit and seen from nearly the same
        sides then as by the first, and hidden alike by bodies that may come between (body,)."""
        met, heard = self.met[:, snap], self.arrival_time[:, :, snap, owner]
        late, later = met - met[first[0]], heard - heard[first]
        _, velocity, spin = self._places
        gone, moved = velocity * late[..., None], self.sonar.velocity * later[..., None]
        way, way_on = met[:, owner] - self.snaps[snap].time, heard - met[:, owner, None]
        past = np.linalg.norm(gone[:, owner], axis=-1) / way
        past_on = np.linalg.norm(gone[:, None, owner] - moved, axis=-1) / way_on
        rate, turning = np.maximum(past[:, None], past_on) / self.speed, np.linalg.norm(spin[owner])
        beside = np.linalg.norm(gone - gone[:, owner, None], axis=-1)[:, : len(between)]
        hidden_alike = (beside <= self.shared * self.radius[: len(between)])[:, between].all(axis=1)
        return np.asarray((rate + turning * np.abs(late[:, owner, None]) <= self.shared) & hidden_alike[:, None])

    def _between(self, snap: int, owner: int) -> Bools:
        """(body,) which may stand in rays from a snap to an owner and on to the array: seen from above, where all
        families are one line."""
        place, velocity, _ = self._places
        level = (place + velocity * self.met[0, snap][:, None])[:, :2]
        found = np.zeros(len(self.bodies), bool)
        for end in (self.snaps[snap].position, self.sonar.pose.position):
            line, beside = end[:2] - level[owner], level[: len(found)] - level[owner]
            along = np.clip(beside @ line / max(line @ line, 1e-30), 0.0, 1.0)
            apart = np.linalg.norm(beside - along[:, None] * line, axis=1)
            found |= apart < self.radius[: len(found)] + self.radius[owner]
        return found

    @cached_property
    def _places(self) -> tuple[Floats, Floats, Floats]:
        """Place (owner, xyz) m, velocity (owner, xyz) m/s and spin (owner, xyz) rad/s of middles, at the frame's
        time."""
        moving = [(track.pose.position, track.velocity, track.spin) for track in self.middles]
        place, velocity, spin = np.reshape(moving, (-1, 3, 3)).swapaxes(0, 1)
        return place, velocity, spin

    @property
    def every(self) -> frozenset[tuple[int, int]]:
        """The ways of no more reflections than a path may have."""
        number = range(len(self.met))
        pairs = [(out, on) for out in number for on in number if (out + 1) // 2 + (on + 1) // 2 <= self.bounces]
        return frozenset(pairs)

    def heard(self, snap: int) -> list[tuple[tuple[int, ...] | None, Meeting]]:
        """Families by which the array hears a snap itself in about one attitude, None for all of them, and where."""
        times = self.direct_time[:, snap].tolist()
        order = np.argsort(times, kind="stable").tolist()
        found = list(groups(order, lambda first, n: self._alike(self.sonar, times[first], times[n], self.aperture)))
        at = [Meeting(np.zeros(0), times[of[0]], self.sonar.later(times[of[0]])) for of in found]
        return [(tuple(of) if len(found) > 1 else None, meeting) for of, meeting in zip(found, at, strict=True)]

    def _alike(self, track: Track, first: float, time: float, size: float) -> bool:
        """Whether what is `size` m large is, at a time (s), where its velocity and spin at the first bring it."""
        return track.straight or self._goes_on(track.later(first), time - first, size)

    def when(self, snap: int, ways: Ways | None) -> tuple[Floats, Floats]:
        """When the first sound of a snap by some ways meets each owner (owner,), and when the array hears that (s)."""
        out, on = zip(*(((0, 0),) if ways is None else ways), strict=True)
        return self.met[out, snap].min(axis=0), self.arrival_time[out, on, snap].min(axis=0)

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


def groups(waiting: list[T], near: Callable[[T, T], bool]) -> Iterator[list[T]]:
    """All that wait, in their order: the first with what is near to it, then the first of the others."""
    while waiting:
        found = [n for n in waiting if n == waiting[0] or near(waiting[0], n)]
        yield found
        waiting = [n for n in waiting if n not in found]


def family_times(
    tracks: Sequence[Track], snaps: tuple[Emission, ...], bottom_depth: float, bounces: int, speed: float
) -> Floats:
    """When the sound of each snap meets what is on each track by each family of up to so many reflections (family,
    snap, track), s on the clock of the frame: by straight lines and their images, at one speed (m/s).

    Where tracks are straight and nothing is reflected, |p + v t - s| = c t is a quadratic equation of t after the snap.
    """
    if not bounces and all(track.straight for track in tracks):
        ends = [(track.pose.position, track.velocity) for track in tracks]
        place, velocity = np.reshape(ends, (-1, 2, 3)).swapaxes(0, 1)
        start = np.reshape([snap.position for snap in snaps], (-1, 1, 3))
        sent = np.array([snap.time for snap in snaps])[:, None]
        away = place + sent[..., None] * velocity - start  # when a snap sounds (snap, track, xyz)
        along, slower = dot(velocity, away), speed**2 - dot(velocity, velocity)
        return np.asarray(sent + (along + np.sqrt(along**2 + slower * dot(away, away))) / slower)[None]
    travel_time = partial(_times_of_families, bottom_depth, bounces, speed)
    return meeting_times(tracks, snaps, travel_time, (2 * bounces + 1,))


def _times_of_families(bottom_depth: float, bounces: int, speed: float, start: Floats, end: Floats) -> Floats:
    """Travel times (pair,) s from start to end (pair, xyz), each family of `images` on pairs of its own, in turn."""
    number = range(2 * bounces + 1)
    every = lengths(start, end, bottom_depth, bounces).reshape(len(number), len(number), -1)
    return np.asarray(every[number, number].ravel() / speed)


def meetings(context: FrameContext, sonar: Track, bounces: int) -> MeetingTimes:
    """By straight lines and their images of up to so many reflections; sonar: the track of the array."""
    receiver, bottom_depth, snaps = context.receiver, context.medium.depth, context.snaps
    speed = float(context.medium.profile.at(depth(sonar.pose.position)))
    tracks = [surface.track.part(surface.middle) for surface in context.scattering]

    def heard(position: Floats, sent: Floats) -> Floats:
        return hearing_times(position, sent, sonar, bottom_depth, bounces, speed)

    met = family_times(tracks, snaps, bottom_depth, bounces, speed)
    arrival_time = heard(positions(tracks, met), met).swapaxes(0, 1)
    places = np.reshape([snap.position for snap in snaps], (-1, 3))  # of none as well
    direct = heard(places, np.array([snap.time for snap in snaps]))
    wavenumber, aperture = 2.0 * np.pi * receiver.band[1] / speed, receiver.elements.aperture
    shared = context.tolerances.shared
    times, tolerance = (met, arrival_time, direct), (shared, wavenumber, aperture)
    radius = np.array([surface.radius for surface in context.scattering])
    return MeetingTimes(context.bodies, sonar, *times, snaps, tuple(tracks), radius, speed, bounces, *tolerance)


def occasions(context: FrameContext, times: MeetingTimes) -> list[TracingGroup]:
    """Poses to trace the echoes of each snap from each body between."""
    found: list[TracingGroup] = []
    for snap in range(len(context.snaps)):
        for owners, ways in times.classes(snap):
            for number, group in enumerate(found):
                if (group.owners, group.ways) == (owners, ways) and times.serves(group, snap):
                    found[number] = replace(group, snaps=(*group.snaps, snap))
                    break
            else:
                when, heard = times.when(snap, ways)
                placed = tuple(body.later(late) for body, late in zip(context.bodies, when.tolist(), strict=False))
                late = float(heard[list(owners)].mean()) if owners else 0.0
                left = [(on + 1) // 2 for _, on in times.every.intersection(ways or ())]
                meeting = Meeting(when, late, times.sonar.later(late))
                found.append(TracingGroup((snap,), owners, ways, max(left, default=times.bounces), placed, meeting))
    return found


def hearing_times(
    position: Floats, sent: Floats, sonar: Track, bottom_depth: float, bounces: int, speed: float
) -> Floats:
    """When an array on a track hears what was sent from places (..., xyz) m at times (...) s, by each family of up to
    so many reflections (family, ...): by straight lines and their images, at one speed (m/s)."""
    shape = (2 * bounces + 1, *sent.shape)
    begin, arrival_time = np.broadcast_to(position, (*shape, 3)).reshape(-1, 3), np.broadcast_to(sent, shape)
    for _ in range(1 if sonar.still else 6):
        end = sonar.positions(arrival_time).reshape(-1, 3)
        arrival_time = sent + _times_of_families(bottom_depth, bounces, speed, begin, end).reshape(shape)
    return arrival_time
