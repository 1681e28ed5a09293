"""Paths between things that move: directions, spreading, delays and Doppler of when and where sound meets them.

A snap's echoes are traced as if all were at rest: each body where the snap's sound meets its middle, the array where it
hears that (`sonarsynth.tracing.meetings`). What is left is by how much sooner or later (tau_1) a path meets its facet,
which is then v tau_1 farther, and the array (tau_2), which is u tau_2 farther. With T, a, d and b the travel times and
directions of travel of the rays that were traced, to the facet, from it and to the array, t_s the time of the snap and
m and h those of the poses that rays were traced between,

    m + tau_1 = t_s + T_out + (v.a/c) tau_1,    h + tau_2 = m + tau_1 + T_in - (v.d/c) tau_1 + (u.b/c) tau_2

and each leg is longer by its curvature, as a straight one of its length is (`moving_ends`), so that times are exact in
uniform water. Directions at facet and array, and spreading, are those of the lengthened leg, exact there as well; so
are what surface and bottom reflect, and what a source sends into its beam. v is the velocity of the facet: its body may
turn, by omega tau_1 till then, and with it all that its law asks for. The pulse is longer by dt_2/dt_s; of a source
that moves at w by 1 - w.n/c times as much, n the direction in which the ray leaves it. Of direct sound the source is
the facet. Each sensor meets the wavefront when it is there (`_over_aperture`). Left out in bent water: how much more or
less than straight rays the rays turn and spread for the remainder v tau_1; and of the pulse's length, not of its delay,
that what moves is seen from another side at each sensor, v/c of the angle that the array takes up there: parts of the
array see it from their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from sonarsynth.columns import Columns, alike
from sonarsynth.conventions import Floats, Ints, depth
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.kernels import moving_ends
from sonarsynth.equations.kernels.row_products import row_products
from sonarsynth.equations.kernels.unit_vectors import moved
from sonarsynth.equations.scattering.lobes import dot
from sonarsynth.geometry import Pose, unit
from sonarsynth.geometry.motion import Track
from sonarsynth.products import ArrayExpansion, Arrivals
from sonarsynth.propagation.reflections import reflections_along
from sonarsynth.receiver import Elements
from sonarsynth.scattering import Scatterers
from sonarsynth.state import Emission, Medium
from sonarsynth.tracing.expansion.probe_sensors import probes, sphere
from sonarsynth.tracing.receive_paths import ReceivePaths
from sonarsynth.tracing.transmit_paths import TransmitPaths

Ways = tuple[tuple[int, int], ...]
"""Families (`images.family`) by which sound comes to what scatters, each with one by which it goes on to the array."""
Bounced = TypeVar("Bounced", TransmitPaths, ReceivePaths)
SAME = 1e-6
"""rad: directions that differ by less are reflected alike."""


@dataclass(frozen=True, eq=False)
class Meeting:
    """When what was traced is where it was traced."""

    met: Floats  # (body,) s of the frame: each body is where it is then
    arrival_time: float  # s: the array is
    sonar: Track  # of the array, at `arrival_time`


@dataclass(frozen=True, eq=False)
class MotionTerms(Columns):
    """How paths (path,) differ from those that were traced, by the remainder of the motion."""

    met: Floats  # s: of the poses of bodies
    late: Floats  # s: after `met`, the facet is met
    velocity: Floats  # (path, xyz) m/s of the facet, world
    spin: Floats  # (path, xyz) rad/s of its body
    apart: Floats  # (path, xyz) m: by what the array, or its image, is farther from the facet

    @staticmethod
    def none(count: int) -> MotionTerms:
        """Paths of which nothing moves."""
        zero, none = np.zeros(count), np.zeros((count, 3))
        return MotionTerms(zero, zero, none, none, none)

    @staticmethod
    def direct(count: int, snap: Emission) -> MotionTerms:
        """Paths from a snap itself, which is where it is when it sounds."""
        none = MotionTerms.none(count)
        return none.but(met=none.met + snap.time, velocity=none.velocity + snap.velocity)

    def departure(self, length: Floats, away: Floats, body: Pose | None = None) -> Floats:
        """Directions (path, ..., xyz) to the array or probes of it, of rays of some length (path,) m that left in
        directions `away`, world; with the pose of the body that was traced, as it sees them when it has turned, in
        its axes."""
        late, rotation = (np.zeros_like(self.late), np.eye(3)) if body is None else (self.late, body.rotation)
        places = away if away.ndim == 3 else away[:, None]
        return np.asarray(moved(length, places, self.apart, late, self.spin, rotation).reshape(away.shape))

    def arrival(self, direction: Floats, body: Pose) -> Floats:
        """Directions (path, xyz) of rays, world, as the body that has turned sees them, in its axes."""
        if self.spin.any():
            direction = unit(direction - np.cross(self.late[:, None] * self.spin, direction))
        return body.turn_to_body(direction)


def velocities(scattering: tuple[Scatterers, ...], owner: Ints, point: Floats) -> tuple[Floats, Floats]:
    """Velocity (point, xyz) m/s of surface elements (owner of each), world, and the spin of their owner rad/s."""
    tracks = [surface.track for surface in scattering]
    own = [np.array(column).reshape(-1, 3) for column in zip(*((t.velocity, t.spin) for t in tracks), strict=True)]
    motion, spins = (alike(of[0], len(point)) if len(of) == 1 else of[owner] for of in own)
    if spins.any():
        middle = np.array([track.pose.position for track in tracks])[owner]
        motion = motion + np.cross(spins, point - middle)
    return motion, spins


def meets(
    out: TransmitPaths, met: Floats, velocity: Floats, time: float, speed: Floats
) -> tuple[TransmitPaths, Floats, Floats]:
    """Ways to facets that move, when and where the sound of a snap at `time` (s) meets them, by how much after `met`
    (way,) s, where ways lead to where they are then, and how far from there (way, xyz) m; velocity (way, xyz) of the
    facets, speed (way,) of sound there, m/s."""
    late, arrival, length, apart = moving_ends.meet(
        out.length, out.arrival, time + out.travel_time - met, speed, velocity
    )
    spreading, travel_time = out.spreading * (out.length / length), (met - time) + late
    return out.but(arrival=arrival, length=length, travel_time=travel_time, spreading=spreading), late, apart


def bounced_anew(paths: Bounced, z: Floats, before: Floats, after: Floats, medium: Medium, centre: float) -> Bounced:
    """Paths of which surface and bottom reflect what has another direction (path, xyz) at depths z (path,) m than was
    traced; centre (Hz): of the band."""
    rows = np.flatnonzero(paths.bounces)
    turned = np.abs(np.subtract(after.take(rows, axis=0).T, before.take(rows, axis=0).T, order="C"))
    rows = rows[(turned > SAME).any(axis=0)]
    if not len(rows):
        return paths
    counts = paths.surface[rows], paths.bottom[rows], centre
    old, new = (
        reflections_along(medium.environment, medium.profile, z[rows], of.take(rows, axis=0), *counts)
        for of in (before, after)
    )
    boundary, phase, blur = paths.boundary.copy(), paths.phase.copy(), paths.delay_std.copy()
    boundary[rows] *= new.modulus / np.maximum(old.modulus, 1e-300)
    phase[rows] += new.phase - old.phase
    blur[rows] = np.sqrt(np.maximum(blur[rows] ** 2 + (new.delay_std**2 - old.delay_std**2), 0.0))
    return paths.but(boundary=boundary, phase=phase, delay_std=blur)


def mirrored(velocity: Floats, bounces: Ints) -> Floats:
    """Velocities (path, xyz) of images after so many reflections (path,) from level surfaces."""
    image = velocity.copy()
    image[bounces % 2 == 1, 2] *= -1.0
    return image


def met_paths(legs: ReceivePaths, leg: Ints, of: MotionTerms, meeting: Meeting) -> MotionTerms:
    """The remainder of paths (path,) that go on by a leg each, from that of an array at rest."""
    if meeting.sonar.still:
        return of
    arrival_time = of.met + of.late + legs.travel_time[leg] - meeting.arrival_time
    gone = mirrored(meeting.sonar.velocity * arrival_time[:, None], legs.bounces[leg])
    return of.but(apart=of.apart + gone)


def received(legs: ReceivePaths, of: MotionTerms, meeting: Meeting, medium: Medium, centre: float) -> ReceivePaths:
    """Legs from facets that move to an array that does: from where they are met to where they are heard; centre (Hz)
    of the band."""
    profile = medium.profile
    pose, u = meeting.sonar.pose, meeting.sonar.velocity
    c_facet, c_array = profile.at(depth(legs.point)), float(profile.at(depth(pose.position)))
    begun = of.met + of.late
    rays = legs.length, legs.arrival, begun - meeting.arrival_time + legs.travel_time, u, c_array, legs.bounces
    points = legs.point, legs.departure, of.late, of.velocity, c_facet
    late, arrival, radius, there = moving_ends.hear(*rays, *points)
    departure = of.departure(legs.length, legs.departure)
    legs = bounced_anew(legs, depth(legs.point), legs.departure, departure, medium, centre)
    direction = -pose.turn_to_body(arrival)
    if meeting.sonar.spin.any():
        direction = direction - np.cross(pose.turn_to_body(meeting.sonar.spin), direction) * late[:, None]
        direction /= np.sqrt(dot(direction, direction))[:, None]
    return legs.but(
        point=there, departure=departure, arrival=arrival,
        direction=direction, radius=radius, length=legs.length + (radius - legs.radius),
        spreading=legs.spreading * (legs.radius / radius), travel_time=meeting.arrival_time - begun + late,
    )  # fmt: skip


def apply_doppler(
    arrivals: Arrivals, legs: ReceivePaths, out: TransmitPaths, of: MotionTerms, meeting: Meeting, profile: Profile,
    elements: Elements,
) -> Arrivals:  # fmt: skip
    """Arrivals with their Doppler, that of the array centre; legs and ways: those of `received` and `meets`."""
    array = meeting.sonar
    c, c_array = profile.at(depth(legs.point)), float(profile.at(depth(array.pose.position)))
    rate_out, rate_in = dot(of.velocity, out.arrival) / c, -dot(of.velocity, legs.departure) / c
    of_array = dot(legs.arrival, array.velocity) / c_array
    doppler = (1.0 - out.approach) * (1.0 + rate_in) / ((1.0 - rate_out) * (1.0 - of_array)) - 1.0
    arrivals = arrivals.but(doppler=doppler)
    if not elements.aperture or not (array.velocity.any() or array.spin.any()):
        return arrivals
    return arrivals.but(expansion=_over_aperture(arrivals, legs, array, c_array, 1.0 / (1.0 - of_array), elements))


def _over_aperture(
    arrivals: Arrivals, legs: ReceivePaths, array: Track, c: float, longer: Floats, elements: Elements
) -> ArrayExpansion:
    """Wavefronts as sensors meet them that move, and turn with the array: later, or sooner, the farther these have
    still to go; longer (path,): 1/(1 - u.b/c).

    A sensor q at velocity w meets the sphere about R d at |R d - q - w t| = R + c t, a quadratic equation of t. What
    bent rays are late beside it is longer as at the centre.
    """
    probe, over = probes(elements), arrivals.expansion
    q, turn = probe.position, array.pose.turn_to_body
    w = turn(array.velocity) + np.cross(turn(array.spin), q)
    farther, radius = sphere(legs.direction, legs.radius, q), legs.radius[:, None]
    square = farther * (farther + 2.0 * radius)
    along = radius * (c + row_products(legs.direction, w.T)) - dot(q, w)
    late = square / (along + np.sqrt(along**2 + (c**2 - dot(w, w)) * square)) - farther / c
    terms, missed = probe.expand(late)
    if over.delay.shape[1]:
        terms += over.delay * longer[:, None]
    return over.but(delay=terms, error=over.error + missed)
