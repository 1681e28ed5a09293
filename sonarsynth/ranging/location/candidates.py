"""Pulses that were measured, and which of them count as snaps: an echo must not be taken for a snap.

An echo comes after the pulse that it is of, which it cannot be louder than a mirror would make it: as if it came from
the image of the source behind the mirror. Where it seems to come from lies between the point of the body that it met
and that image. So an echo of a pulse of delay t, place S and amplitude A, L/c later from direction v, has

    1/(R + L) <= curvature <= 1/r,  amplitude <= A R/(R + L),  R = |S|,  r = L (L + 2 R)/(2 (L + R (1 - cos psi))),

r the range at which a body in that direction is met (psi between S and v), for S or any of its images in surface and
bottom. A pulse that satisfies all of this may be an echo, and is refused.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from sonarsynth.conventions import Bools, Floats, azimuth_elevation
from sonarsynth.equations.kernels.sensor_rows import heard_power, power_and_peak
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import Track
from sonarsynth.products import Signals, SourceEstimates
from sonarsynth.ranging.location import pulse_times
from sonarsynth.ranging.location.plane_waves import PlaneWaveFit, accompanied, without
from sonarsynth.ranging.location.source_position import (
    ACCEPTED,
    ECHO,
    OUTSIDE,
    RANGE,
    SILENT,
    SonarKnowledge,
    SourceFix,
    refused,
)
from sonarsynth.receiver import Band, Elements, Sonar

SIGMAS = 4.0
"""Standard errors within which a curvature, a direction and a time may be those of an echo."""
LOUDER = 1.25
"""An echo louder than a mirror's by this factor is none; less may be noise."""
SMALL = 0.5
"""Part of a mirror's echo that a body too small, or too round, to mirror gives: its echo comes from where it is."""
ALLOWED = 0.02
"""Share of a curvature by which straight rays, and bodies that are no points, may change it."""
SHARP = 0.05
"""Standard error of the curvature, in curvatures, with which a wavefront shows that its source is on the bottom."""
BOUNCES = 2
"""Reflections at surface and bottom after which sound may still meet a body."""
FAR = 1e7
"""m: taken for the distance of a source whose range is not known."""
RISING = 0.15
"""Sine of the elevation above which no direct sound comes from the bottom below: a ray that turned above the array,
where sound is faster by 1 %, comes from sqrt(0.02) at most."""
FAINT = 1e-8
"""Power over that of the loudest pulse (80 dB below it) under which none is looked at: signals are not so exact, and
what comes before a snap, as a filter rings or a synthetic pulse begins, would be an earlier one at its place."""
LOUD = 0.01
"""Power over that of the loudest pulse, of those beside which others are looked for: echoes are fainter."""
QUIET = 2.0
"""The mean power while a pulse passes over the array must exceed that of the quiet, and of rounding, by this factor."""


@dataclass(frozen=True, eq=False)
class PowerTrack:
    """How loud the signals are, all live sensors together."""

    track: Floats  # (sample,) Pa2: mean power, summed over sensors, in a window about the sample
    quiet: float  # Pa2: the same where nothing is heard
    peak: float  # Pa: the largest |pressure|


def loudness(signals: Signals, live: Bools, length: int) -> PowerTrack:
    """Power at live sensors in a sliding window of `length` samples, in quiet, and the peak.

    The quiet power is the tenth part from below of short means: a snap and its echoes fill no more of the signals.
    """
    every = 0, signals.pressure.shape[1]
    power, peak = heard_power(signals, *every) if live.all() else power_and_peak(signals.pressure, live, *every)
    track = uniform_filter1d(power, min(length, len(power)), mode="constant")
    short = min(16, len(power))
    means = np.sort(power[: len(power) // short * short].reshape(-1, short).mean(axis=1))
    return PowerTrack(np.maximum(track, 0.0), float(means[len(means) // 10]), peak)


def quiet_bin(quiet: float, live: int, band: Band, half: float) -> float:
    """Mean power in a bin, (Pa s)^2, of noise at a sensor, at most: `quiet` (Pa2) of `live` sensors, in the band."""
    return quiet / max(live, 1) * half / (band.high - band.low)


def clipping_error(signals: Signals, elements: Elements, sonar: Sonar, centre: float, half: float) -> float:
    """Standard error (s) that clipping adds to the time of a pulse: its peak may be anywhere in the samples at full
    scale within `half` of `centre` (s), so many as a live sensor has of them on average."""
    if sonar.converter is None or not signals.clipped:
        return 0.0
    largest = sonar.converter.full_scale - 1.5 * sonar.converter.quantum  # half a count below the highest
    cut, _ = pulse_times.excerpt(signals, centre, half)
    live = elements.gain != 0
    clipped = np.count_nonzero(np.abs(cut[live]) > largest) / max(int(live.sum()), 1)
    return float(clipped / (np.sqrt(12.0) * signals.sampling_frequency))


def when_heard(knowledge: SonarKnowledge, track: Track | None, time: float) -> SonarKnowledge:
    """Where an array on a track is when it hears a pulse at a time (s) of the frame, and how fast its sensors go."""
    if track is None or track.still:
        return knowledge
    then = track.later(time)
    ahead, spin = then.in_own_frame
    return replace(knowledge, pose=then.pose, velocity=ahead + np.cross(spin, knowledge.elements.position))


class Candidate(NamedTuple):
    """A pulse as it was looked at."""

    centre: float  # s: about when
    power: float  # Pa2: mean over its window, all sensors together
    row: SourceFix


class Source(NamedTuple):
    """What echoes may be of: a pulse that was heard, or its image."""

    time: float  # s at the array centre
    place: Floats  # (xyz) m
    amplitude: float  # at the array centre


@dataclass
class Candidates:
    """Pulses, loudest first."""

    known: SonarKnowledge
    found: list[Candidate] = field(default_factory=list)

    @property
    def rows(self) -> list[SourceFix]:
        """Those that are accepted, then those that may be echoes, whose places count as well, then the others."""
        judged = [self._judged(candidate) for candidate in self.found]
        return sorted(judged, key=lambda row: 0 if row.reason in (ACCEPTED, RANGE) else 1 + (row.suspect is None))

    @property
    def accepted(self) -> int:
        """How many are."""
        return sum(row.reason in (ACCEPTED, RANGE) for row in self.rows)

    def look_beside(
        self, signals: Signals, track: Track | None, width: int, least: float,
        look: Callable[[Signals, float, float], Candidate],
    ) -> None:  # fmt: skip
        """Add pulses that are heard within `width` samples of louder ones, and are louder than `least` (Pa2): by `look`
        at the signals without those."""
        elements, sonar, rate = self.known.elements, self.known.sonar, signals.sampling_frequency
        loudest, heard = max((candidate.power for candidate in self.found), default=0.0), []
        for n, (_, power, row) in enumerate(self.found):
            if row.reason in (ACCEPTED, RANGE) and power >= LOUD * loudest:
                self.found[n] = Candidate(row.time, power, row)  # the loudest window may have held others
                front = PlaneWaveFit(row.chord, row.curvature[0], row.time)
                late = front.delays(elements, sonar.assumed_sound_speed) - row.time
                moved = late[:, None] * when_heard(self.known, track, row.time).velocity
                heard.append((replace(elements, position=elements.position + moved), front))
        crowded = [front.time for moved, front in heard if accompanied(signals, moved, sonar, front, width / rate)]
        if not crowded:
            return
        rest = without(signals, heard, sonar)
        left = loudness(rest, elements.gain != 0, width).track
        for time in crowded:
            middle = round((time - signals.start) * rate)
            first = max(middle - width, 0)
            top = first + int(left[first : middle + width + 1].argmax())
            power = float(left[top])
            left[max(top - width, 0) : top + width + 1] = 0.0
            if power > least:
                found = look(rest, signals.start + top / rate, power)
                if np.isfinite(found.row.time):
                    self.add(found._replace(centre=found.row.time), pulse_times.half_length(sonar.band), time)

    def add(self, found: Candidate, apart: float, beside: float = np.nan) -> None:
        """Add a pulse by how loud it is, but none that is within `apart` (s) of any that is known, but for the one at
        `beside` (s): a fit to the flank of a pulse leads to that."""
        known = [other.row.time for other in self.found if other.row.time != beside]
        if not any(abs(other - found.row.time) < apart for other in known):
            fainter = (n for n, other in enumerate(self.found) if other.power < found.power)
            self.found.insert(next(fainter, len(self.found)), found)

    def _judged(self, candidate: Candidate) -> SourceFix:
        row = candidate.row
        if row.reason not in (ACCEPTED, RANGE):
            return refused(row.reason)
        if row.reason == RANGE and self._mirrored(row):
            return refused(OUTSIDE)
        earlier = [cause for cause in self.found if cause.centre < candidate.centre]
        if not any(self._may_cause(cause, candidate) for cause in earlier):
            return row
        return replace(refused(ECHO), amplitude=row.amplitude, suspect=row)

    def _mirrored(self, row: SourceFix) -> bool:
        """Whether a pulse of unknown range comes from beyond the horizon of the bottom that sources are known to be on:
        it is the image of one in the surface."""
        pose, error = self.known.pose, SIGMAS * float(np.hypot(*row.angle_error))
        away = np.sign(self.known.bottom_depth + pose.position[2]) * float(pose.rotation[2] @ row.chord)
        return self.known.on_bottom and bool(away > RISING + error)

    def _may_cause(self, cause: Candidate, candidate: Candidate) -> bool:
        row, fix = candidate.row, cause.row
        if not np.isfinite(fix.time):  # nothing is known of it, but that it was there
            return cause.power > candidate.power
        return any(self._may_be_echo(row, source) for source in _sources(fix, self.known))

    def _may_be_echo(self, row: SourceFix, source: Source) -> bool:
        """Whether a pulse is what a source's echo, or the image itself, would be."""
        speed, error = self.known.sonar.assumed_sound_speed, SIGMAS * row.time_error
        extra, distance = speed * (row.time - source.time), float(np.linalg.norm(source.place))
        cosine = float(row.chord @ source.place) / distance
        mirrored = distance + extra
        loudest = LOUDER * source.amplitude * distance / max(mirrored, distance)
        if extra < -speed * error or row.amplitude > loudest:
            return False
        if extra <= speed * error:  # no longer on its way than from the source itself
            return cosine > float(np.cos(SIGMAS * float(np.hypot(*row.angle_error)) + ALLOWED))
        range_ = extra * (extra + 2 * distance) / (2 * (extra + distance * (1 - cosine)))
        k, slack = row.curvature[0], SIGMAS * row.curvature[1] + ALLOWED / range_
        if not 1 / mirrored - slack <= k <= 1 / range_ + slack:
            return False
        behind = max(1 / max(k - slack, 1 / mirrored) - range_, 0.0)  # how far behind the body it may come from
        flat = behind * mirrored / ((behind + range_) * (mirrored - range_))
        if row.amplitude > loudest * min(max(SMALL, 1.5 * flat), 1.0):
            return False
        # a snap on the bottom that was made at the same time is where a wall would mirror the other: it is a snap
        on_bottom = row.bottom_used == 1 and row.curvature[1] < SHARP * k
        return not (on_bottom and bool(abs(k - 1 / mirrored) <= slack) and k + slack < 1 / range_)


def _sources(row: SourceFix, knowledge: SonarKnowledge) -> list[Source]:
    """The pulse where its wavefront puts it, and its images in surface and bottom."""
    k = max(row.curvature[0], 1 / FAR)
    direct = Source(row.time, row.chord / k, row.amplitude)
    speed, sources = knowledge.sonar.assumed_sound_speed, [direct]
    for _, _, image in images(direct.place, knowledge.pose, knowledge.bottom_depth, BOUNCES):
        distance = float(np.linalg.norm(image))
        longer = distance - 1 / k
        sources.append(Source(row.time + longer / speed, image, row.amplitude / (k * distance)))
    return [source for source in sources if source.time >= row.time]


def images(position: Floats, pose: Pose, bottom_depth: float, bounces: int) -> list[tuple[int, int, Floats]]:
    """Reflections at surface and at bottom, and image source (xyz, sonar frame), of every path of up to `bounces`.

    Two paths of each number of reflections: the first at the surface, or at the bottom.
    """
    paths = []
    for first in (0, 1):
        image = pose.to_world(position).copy()
        for n in range(bounces):
            at_bottom = (first + n) % 2
            image[2] = -2 * bottom_depth * at_bottom - image[2]
            bottom = (n + 1 + first) // 2
            paths.append((n + 1 - bottom, bottom, pose.to_body(image)))
    return paths


def as_estimates(rows: list[SourceFix], snaps: int, reason: int = SILENT) -> SourceEstimates:
    """Rows as `SourceEstimates` of `snaps` rows; NaN beyond those there are, for a reason."""
    rows = [*rows[:snaps], *[refused(reason)] * (snaps - len(rows))]

    def column(get: Callable[[SourceFix], object], *shape: int) -> Floats:
        return np.array([get(row) for row in rows], float).reshape(snaps, *shape)

    return SourceEstimates(
        time=column(lambda r: r.time),
        time_error=column(lambda r: r.time_error),
        azimuth=column(lambda r: azimuth_elevation(r.direction)[0]),
        azimuth_error=column(lambda r: r.angle_error[0]),
        elevation=column(lambda r: azimuth_elevation(r.direction)[1]),
        elevation_error=column(lambda r: r.angle_error[1]),
        range_from_depth=column(lambda r: r.range_from_depth[0]),
        range_from_depth_error=column(lambda r: r.range_from_depth[1]),
        range_from_curvature=column(lambda r: r.range_from_curvature[0]),
        range_from_curvature_error=column(lambda r: r.range_from_curvature[1]),
        position=column(lambda r: r.position, 3),
        position_covariance=column(lambda r: r.covariance, 3, 3),
        residual=column(lambda r: r.residual),
        position_by_speed=column(lambda r: r.by_speed, 3),
        bottom_used=column(lambda r: r.bottom_used).astype(np.int64),
        reason=column(lambda r: r.reason).astype(np.int64),
        pressure=column(lambda r: r.amplitude),
        as_snap_time=column(lambda r: (r.suspect or r).time),
        as_snap_position=column(lambda r: (r.suspect or r).position, 3),
        as_snap_covariance=column(lambda r: (r.suspect or r).covariance, 3, 3),
    )
