"""Paths between things that move: Doppler, and echoes from where a target is when the sound meets it.

Positions are those at the instant of the frame, t = 0. A path is re-timed by the rates of its travel times, which rays
give for nothing: a point that moves at v changes the time of a ray that arrives there by v.a/c, of one that leaves by
-v.d/c. Linear in time over a frame, so sound that leaves the snap at t_s meets the facet at t_1 and the array at t_2:

    t_1 = t_s + T_out + (v.a/c) t_1,    t_2 = t_1 + T_in - (v.d/c) t_1 + (u.b/c) t_2

with a, d, b the directions of travel at facet, facet and array, v and u the velocities of target and array; and each
leg is longer by its curvature, as a straight one of its length is (`aside`), so that times are exact in uniform water.
The pulse is longer by dt_2/dt_s, and spreads on the way to the array from where the target was when the sound met it,
at each hydrophone as from there. What is left out: how spreading on the way to the target and the directions at the
facet change, v t/r of them (3 cm in 10 m: 0.03 dB); of a moving array, u/c of the curvature of the wavefront; the
turning of a body.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sonarsynth.acoustics.lobes import dot
from sonarsynth.conventions import Floats, depth
from sonarsynth.geometry import Pose
from sonarsynth.products import Arrivals
from sonarsynth.sonar import Elements
from sonarsynth.tracing.legs import Legs
from sonarsynth.tracing.paths import Outward
from sonarsynth.tracing.probe_legs import TERMS
from sonarsynth.tracing.wavefront import FEW, SECOND_DEGREE, probes
from sonarsynth.world.environment import Profile
from sonarsynth.world.moment import Snap


@dataclass(frozen=True, eq=False)
class Moving:
    """Velocities in a frame."""

    targets: Floats  # (target, xyz) m/s, world
    sonar: Floats  # (xyz) m/s, world

    @property
    def still(self) -> bool:
        """Nothing moves."""
        return not (self.targets.any() or self.sonar.any())


ROUNDS = 3
"""Of solving for times that depend on themselves: each leaves v/c of the error, or v t/r of that."""


CHANGED = 2.0
"""What a snap changes by, of itself, for each unit of Doppler: one of few periods, in whose band it is heard."""


def turned(legs: Legs, points: Floats) -> Floats:
    """What (path, point, xyz) the unit vectors towards where legs come from turn by, from the array centre to points
    (point, xyz); sonar frame."""
    v = legs.direction[:, None] - points / legs.radius[:, None, None]
    return np.asarray(v / np.sqrt(dot(v, v))[..., None] - legs.direction[:, None])


def aside(length: Floats, along: Floats, moved: Floats) -> Floats:
    """How much longer (path,) in m straight legs get when their ends come apart, more than by what is along them.

    |r a + d| - r - a.d of legs r (path,) m along unit vectors a (path, xyz), by d (path, xyz) m; never negative, and
    without cancellation.
    """
    forward = length + dot(along, moved)
    across = moved - dot(along, moved)[:, None] * along
    square = dot(across, across)
    return np.asarray(square / np.maximum(np.sqrt(forward**2 + square) + forward, 1e-300))


class _Doppler(NamedTuple):
    """Of paths, at the array centre."""

    velocity: Floats  # (path, xyz) m/s of the target, world
    mirrored: Floats  # (path, xyz) m/s of where it seems to be
    rate_out: Floats  # (path,) of the way to it,
    rate_in: Floats  # (path,) and from there
    of_array: Floats  # (path,) by the motion of the array
    stretch: Floats  # (path,)


def _over_aperture(
    of: _Doppler, legs: Legs, sonar_pose: Pose, profile: Profile, sonar: Floats, elements: Elements,
    departure: Callable[[], Floats] | None, enough: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Polynomials (path, term) of the second degree over the aperture: of Doppler; and of what bent rays change faster
    than straight ones to a place that moves (s a second). None of paths where that errs less, whatever the others."""
    c_array = float(profile.at(depth(sonar_pose.position)))
    turning = np.sqrt(dot(of.velocity, of.velocity)) / legs.length + np.sqrt(sonar @ sonar) / legs.radius  # rad/s
    some = np.flatnonzero(CHANGED * turning * elements.aperture / c_array > enough)
    if not len(some):
        return np.empty((len(of.stretch), 0)), np.empty((len(of.stretch), 0))
    probe, doppler, leg = probes(elements), _Doppler(*(value[some] for value in of)), legs.select(some)
    turn = turned(leg, probe.position[:FEW])
    of_array = turn @ -sonar_pose.turn_to_body(sonar) / c_array + doppler.of_array[:, None]
    rate_in = doppler.rate_in[:, None]
    if departure is not None:
        away = departure()[some]
        rate_in = -np.einsum("px,pqx->pq", doppler.velocity, away) / profile.at(depth(leg.point))[:, None]
    there = (1.0 + rate_in) / ((1.0 - doppler.rate_out[:, None]) * (1.0 - of_array)) - 1.0
    straight = np.einsum("px,pqx->pq", sonar_pose.turn_to_body(doppler.mirrored), turn) / c_array
    both = there - doppler.stretch[:, None], rate_in - doppler.rate_in[:, None] - straight
    found = np.zeros((2, len(of.stretch), SECOND_DEGREE))
    for terms, values in zip(found, both, strict=True):
        terms[some] = probe.fit_few(values)[0][:, :SECOND_DEGREE]
    return found[0], found[1]


def _later(terms: Floats, late: Floats, along: Floats | None) -> Floats:
    """Delay terms (path, term) of bent rays, if there are any, with what is late, and without what is along the motion
    of the array (path, xyz)."""
    if terms.shape[1] and late.shape[1]:
        terms = np.concatenate([terms[:, : late.shape[1]] + late, terms[:, late.shape[1] :]], axis=1)
    if along is not None:
        terms = terms.copy() if terms.shape[1] else np.zeros((len(terms), TERMS))
        terms[:, 1:4] -= along
    return terms


def carried(
    made: Arrivals, legs: Legs, out: Outward | None, snap: Snap, sonar_pose: Pose, profile: Profile, moving: Moving,
    elements: Elements, departure: Callable[[], Floats] | None = None, enough: float = 0.0,
) -> Arrivals:  # fmt: skip
    """Arrivals of a snap with what moves taken into account; out: the ways to the facets, None for direct paths.

    An array that moves meets a wavefront later, or sooner, the farther it has still to go: delays over the aperture (m)
    are longer by u.b/c, which goes into their linear terms. departure: makes the directions (path, FEW, xyz) in which
    the first probes are seen from the facets, world; enough: error of signals that is left, of Doppler over the
    aperture.
    """
    if moving.still or not len(made.delay):
        return made
    c_array = float(profile.at(depth(sonar_pose.position)))
    of_array = legs.arrival @ moving.sonar / c_array
    if out is None:
        velocity, met = np.zeros_like(legs.point), np.zeros(len(made.delay))
        rate_out = rate_in = met
        met = met + snap.time
    else:
        velocity = moving.targets[made.target]
        c = profile.at(depth(legs.point))
        rate_out, rate_in = dot(velocity, out.arrival) / c, -dot(velocity, legs.departure) / c
        met, gone = np.zeros_like(c), snap.time + out.travel_time
        for _ in range(ROUNDS):
            met = (gone + aside(out.length, out.arrival, velocity * met[:, None]) / c) / (1.0 - rate_out)
    mirrored = velocity.copy()
    mirrored[legs.bounces % 2 == 1, 2] *= -1.0
    heard, gone = met + legs.travel_time, met * (1.0 + rate_in) + legs.travel_time
    for _ in range(ROUNDS):
        apart = moving.sonar * heard[:, None] - mirrored * met[:, None]
        heard = (gone + aside(legs.length, legs.arrival, apart) / c_array) / (1.0 - of_array)
    stretch = (1.0 + rate_in) / ((1.0 - rate_out) * (1.0 - of_array)) - 1.0
    # where the target was when the sound met it, from where the array is when it comes; as seen in straight rays
    doppler = _Doppler(velocity, mirrored, rate_out, rate_in, of_array, stretch)
    moved = sonar_pose.turn_to_body(mirrored * met[:, None] - moving.sonar * heard[:, None])
    seen = legs.radius[:, None] * legs.direction + moved
    radius = np.sqrt(dot(seen, seen))
    direction = seen / radius[:, None]
    over, faster = _over_aperture(doppler, legs, sonar_pose, profile, moving.sonar, elements, departure, enough)
    along = (of_array / (1.0 - of_array) * elements.aperture / c_array)[:, None] * direction
    terms = _later(made.delay_terms, met[:, None] * faster, along if moving.sonar.any() and elements.aperture else None)
    nearer = legs.radius / radius
    there, back = (nearer, 1.0) if out is None else (1.0, nearer)
    return replace(
        made, delay=heard, stretch=stretch, direction=direction, radius=radius, delay_terms=terms,
        stretch_terms=over,
        spreading_out=made.spreading_out * there, spreading_in=made.spreading_in * back,
        amplitude=made.amplitude * nearer,
    )  # fmt: skip
