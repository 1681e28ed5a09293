"""Legs over the aperture: the wavefront of each leg and where each sensor is seen from, at probe sensors.

In uniform water both follow from the image of the array, in refracting water from rays to the probes. Those of a family
from one body vary smoothly with the facet, so that some facets, spread over the body, serve for all of them by
polynomials over the body; held-out facets measure the error, and where it is too large every facet is traced.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.acoustics.arrays import aperture_terms
from sonarsynth.acoustics.lobes import dot
from sonarsynth.acoustics.rays import water
from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.geometry import Pose
from sonarsynth.sonar import Elements
from sonarsynth.tracing.legs import Legs
from sonarsynth.tracing.reflections import at_boundaries
from sonarsynth.tracing.wavefront import BRANCH, Probes, pick_branch, probes, sphere
from sonarsynth.world.environment import Environment, Profile

if TYPE_CHECKING:
    from sonarsynth.tracing import Propagation

TERMS = 20
"""Terms over the aperture (`acoustics.arrays.aperture_terms`)."""
SAMPLES = 96
"""Facets of a body and family that rays to the probes are traced from where that is enough; a quarter is held out."""
SMOOTH_TIME = 1e-9
"""s: largest error of a delay from facet to facet: 5e-4 rad at 85 kHz."""
SMOOTH_PHASE = 5e-4
"""rad: largest error of a phase of reflection from facet to facet."""
SMOOTH_BLUR = 4e-15
"""s2: largest error of a squared blur from facet to facet: 5e-4 of the amplitude at 85 kHz."""
SMOOTH_GAIN = 1e-3
"""Largest relative error of an amplitude from facet to facet."""
SMOOTH_DIRECTION = 1e-4
"""Largest error of a direction from facet to facet."""


@dataclass(frozen=True, eq=False)
class Fronts:
    """Legs over the aperture."""

    delay_terms: Floats  # (leg, term) s; no columns where all are spheres
    phase_terms: Floats  # (leg, term) rad: phases of reflection over that of the centre; no columns where all have it
    blur_terms: Floats  # (leg, term) s2: squares of blurs over that of the centre; no columns where all have it
    error: Floats  # (leg,) s: misfit of the wavefront at the probes, the held-out ones among them
    probe_departure: Floats  # (leg, probe, xyz) world: where each probe is seen from the point
    probe_gain: Floats  # (leg, probe): amplitude at the probe over that of the sphere; 1 in uniform water

    def select(self, keep: Bools | Ints) -> Fronts:
        """The legs picked by a mask or by indices."""
        return Fronts(**{name: value[keep] for name, value in vars(self).items()})


def fronts(
    legs: Legs,
    group: Ints,
    environment: Environment,
    profile: Profile,
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
    band: tuple[float, float],
) -> Fronts:
    """Wavefronts of legs. group (leg,): legs of one body; band (Hz).

    Reflections turn and blur the pulse by the grazing angle, which varies over the aperture. What the polynomials in
    that miss is in `error`, as delays that are as much at the upper edge of the band.
    """
    probe = probes(elements)
    count, sensors = len(legs.row), len(probe.sensor)
    made = _Made.room(count, sensors)
    place = _Place(environment, profile, sonar_pose, probe, propagation, band)
    for members in _families(legs, group):
        chosen = members
        if legs.bounces[members[0]] or not profile.uniform:
            chosen = members[_spread(legs.point[members])]
        exact = _exact(legs.select(chosen), place)
        if len(chosen) < len(members):
            smooth = _over_body(legs.point[members], legs.point[chosen], exact, 2.0 * np.pi * band[1])
            exact = smooth or _exact(legs.select(members), place)
        made.put(members, exact)
    none = np.empty((count, 0))
    terms = none if profile.uniform and not made.terms.any() else made.terms
    phase, blur = (value if value.any() else none for value in (made.phase, made.blur))
    return Fronts(terms, phase, blur, made.error, made.departure, made.gain)


@dataclass(frozen=True, eq=False)
class _Place:
    """Where legs go, and through what."""

    environment: Environment
    profile: Profile
    sonar_pose: Pose
    probe: Probes
    propagation: Propagation
    band: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Made:
    """Legs at the probes."""

    terms: Floats  # (leg, term) s: delay over the sphere's
    phase: Floats  # (leg, term) rad: of reflections, over that at the centre
    blur: Floats  # (leg, term) s2: its square, over that at the centre
    gain: Floats  # (leg, probe)
    departure: Floats  # (leg, probe, xyz)
    error: Floats  # (leg,) s

    @staticmethod
    def room(count: int, sensors: int) -> _Made:
        terms, phase, blur = np.zeros((3, count, TERMS))
        return _Made(terms, phase, blur, np.ones((count, sensors)), np.zeros((count, sensors, 3)), np.zeros(count))

    def put(self, rows: Ints, made: _Made) -> None:
        for name, value in vars(made).items():
            getattr(self, name)[rows] = value


def _exact(legs: Legs, place: _Place) -> _Made:
    """Legs at the probes, each of them traced."""
    environment, profile, band = place.environment, place.profile, place.band
    made = _Made.room(len(legs.row), len(place.probe.sensor))
    if profile.uniform:
        departure, left, gain = _image(legs, place.probe, place.sonar_pose), np.zeros(made.gain.shape), made.gain
        if not legs.bounces.any():
            return replace(made, departure=departure)
    else:
        left, gain, departure = _to_probes(legs, environment, profile, place.sonar_pose, place.probe, place.propagation)
    probe, rate = place.probe, 2.0 * np.pi * band[1]
    turned, loss, softer = _boundaries(legs, departure, environment, profile, 0.5 * (band[0] + band[1]))
    turned, softer = (np.where(np.isnan(left), np.nan, value) for value in (turned, softer))
    terms, phase, blur = probe.fit(left), probe.fit(turned), probe.fit(softer)
    error = probe.misfit(left, terms) + probe.misfit(turned, phase) / rate + probe.misfit(softer, blur) * 0.5 * rate
    return _Made(terms, phase, blur, gain * loss, departure, error)


def _image(legs: Legs, probe: Probes, sonar_pose: Pose) -> Floats:
    """Unit vectors (leg, probe, xyz) from each point to the image of each probe, as far as the ray is long."""
    offset = sonar_pose.turn_to_world(probe.position)
    mirror = np.where(legs.bounces % 2 == 1, -1.0, 1.0)
    span = (legs.length[:, None] * legs.departure)[:, None, :] + offset
    span[:, :, 2] += (mirror - 1.0)[:, None] * offset[:, 2]
    return np.asarray(span / np.sqrt(dot(span, span))[..., None])


def _boundaries(
    legs: Legs, departure: Floats, environment: Environment, profile: Profile, centre: float
) -> tuple[Floats, Floats, Floats]:
    """Phase (leg, probe) that the reflections to each probe add to those to the centre, ratio of their moduli, and
    what their squared blurs (s2) add; centre: of the band (Hz)."""
    shape = departure.shape[:2]
    shift, ratio, softer = np.zeros(shape), np.ones(shape), np.zeros(shape)
    some = np.flatnonzero(legs.bounces > 0)
    if not len(some):
        return shift, ratio, softer
    p = np.hypot(departure[some, :, 0], departure[some, :, 1]) / profile.at(depth(legs.point[some]))[:, None]
    surface, bottom = (np.repeat(n[some, None], p.shape[1], axis=1) for n in (legs.surface, legs.bottom))
    angles = [np.arccos(np.minimum(p * float(profile.at(z)), 1.0)) for z in (0.0, environment.depth)]
    seen = at_boundaries(environment, profile, angles[0], surface, angles[1], bottom, centre)
    turned = seen.phase - (legs.phase - 0.5 * np.pi * legs.caustics)[some, None]
    shift[some] = turned - 2.0 * np.pi * np.rint(turned / (2.0 * np.pi))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio[some] = np.where(legs.boundary[some, None] > 0, seen.modulus / legs.boundary[some, None], 1.0)
    softer[some] = seen.blur**2 - legs.blur[some, None] ** 2
    return shift, ratio, softer


def _families(legs: Legs, group: Ints) -> list[Ints]:
    """Indices of the legs of each body and family."""
    up = legs.departure[:, 2] > 0
    key = group.astype(np.int64)
    for part in (legs.surface, legs.bottom, legs.turning, up * (legs.bounces + legs.turning > 0)):
        key = key * (int(part.max(initial=0)) + 1) + part
    order = np.argsort(key, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(key[order])) + 1) if len(order) else []


def _spread(point: Floats) -> Ints:
    """Some of many points: the extreme ones along each axis and others spread evenly through their order; else all."""
    if len(point) <= 2 * SAMPLES:
        return np.arange(len(point))
    extreme = np.concatenate([point.argmin(axis=0), point.argmax(axis=0)])
    golden = np.floor(np.mod(np.arange(SAMPLES) * 0.6180339887498949, 1.0) * len(point)).astype(int)
    return np.unique(np.concatenate([extreme, golden]))


def _over_body(point: Floats, sample: Floats, exact: _Made, rate: float) -> _Made | None:
    """Legs from points (point, xyz) of a body from those of a sample of them, by cubics; None if they err too much;
    rate (rad/s): of the upper edge of the band."""
    middle, half = 0.5 * (point.min(axis=0) + point.max(axis=0)), np.maximum(0.5 * np.ptp(point, axis=0), 1e-9)
    basis, at = (aperture_terms((x - middle) / half, 1.0) for x in (point, sample))
    degrees, sensors = exact.terms.shape[1], exact.gain.shape[1]
    towards = exact.departure.reshape(len(sample), -1)
    values = np.concatenate([exact.terms, exact.phase, exact.blur, exact.gain, towards], axis=1)
    parts = np.cumsum([degrees, degrees, degrees, sensors])
    if not np.isfinite(values).all():
        return None
    held = np.arange(len(sample)) % 4 == 3
    coefficients = np.linalg.lstsq(at[~held], values[~held], rcond=1e-10)[0]
    misfit = np.abs(at[held] @ coefficients - values[held]).max(axis=0)
    wrong = np.split(misfit, parts)
    late, turned, softer = (float(w.sum()) for w in wrong[:3])  # monomials over the aperture are at most 1
    smooth = late <= SMOOTH_TIME and turned <= SMOOTH_PHASE and softer <= SMOOTH_BLUR
    if not (smooth and wrong[3].max() <= SMOOTH_GAIN and wrong[4].max() <= SMOOTH_DIRECTION):
        return None
    terms, phase, blur, gain, away = np.split(basis @ coefficients, parts, axis=1)
    error = np.full(len(point), late + turned / rate + 0.5 * rate * softer + float(exact.error.max()))
    return _Made(terms, phase, blur, gain, away.reshape(len(point), sensors, 3), error)


def _to_probes(
    legs: Legs, environment: Environment, profile: Profile, sonar_pose: Pose, probe: Probes, propagation: Propagation
) -> tuple[Floats, Floats, Floats]:
    """Delay over the sphere's (s), gain over it (leg, probe), departure (leg, probe, xyz): rays to every probe."""
    from sonarsynth.acoustics import rays_continue

    position = sonar_pose.to_world(probe.position)
    layers = water(profile.depth, profile.speed, environment.depth)
    count, sensors = len(legs.row), len(position)
    z, ends = np.clip(depth(legs.point), 0.0, environment.depth), np.clip(depth(position), 0.0, environment.depth)
    c_start = np.interp(z, layers.depth, layers.speed)
    level = position[None, :, :2] - legs.point[:, None, :2]
    distance = np.hypot(level[..., 0], level[..., 1])
    time, sine, spreading = (np.empty((count, sensors)) for _ in range(3))
    rays_continue.rays_nearby(
        layers.depth, layers.speed, z, np.hypot(legs.departure[:, 0], legs.departure[:, 1]) / c_start,
        (legs.departure[:, 2] > 0).astype(np.int64), legs.bounces + legs.turning, np.arange(sensors), ends, distance,
        time, sine, spreading,
    )  # fmt: skip
    ahead = np.divide(level, distance[..., None], out=np.zeros_like(level), where=distance[..., None] > 0)
    cosine = np.sqrt(np.maximum((1.0 - sine) * (1.0 + sine), 0.0))
    departure = np.concatenate([ahead * cosine[..., None], sine[..., None]], axis=2)
    c = float(profile.at(depth(sonar_pose.position)))
    farther = sphere(legs.direction, legs.radius, probe.position)
    predicted = legs.travel_time[:, None] + farther / c
    lost = np.flatnonzero(np.isnan(time).any(axis=1))
    if len(lost):
        some = legs.select(lost)
        found = _searched(
            some, position, predicted[lost], BRANCH * probe.aperture / c, environment, profile, propagation
        )
        time[lost], spreading[lost] = found[0], found[1]
        departure[lost] = np.where(np.isnan(found[0])[..., None], some.departure[:, None, :], found[2])
    expected = legs.spreading[:, None] * legs.radius[:, None] / (legs.radius[:, None] + farther)
    return time - predicted, spreading / expected, departure


def _searched(
    legs: Legs, position: Floats, predicted: Floats, tolerance: float, environment: Environment, profile: Profile,
    propagation: Propagation,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Time, spreading (leg, probe) and departure of the rays nearest in time among all; NaN where there is none."""
    count, sensors = predicted.shape
    start, end = np.repeat(legs.point, sensors, axis=0), np.tile(position, (count, 1))
    paths = propagation.connect(profile, environment.depth, start, end)
    same = (paths.surface == legs.surface[paths.pair // sensors]) & (paths.bottom == legs.bottom[paths.pair // sensors])
    found = pick_branch(paths, predicted, tolerance, same)
    missing = found < 0
    time = np.where(missing, np.nan, paths.travel_time[found])
    return time, np.where(missing, np.nan, paths.spreading[found]), paths.departure[found]
