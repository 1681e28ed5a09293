"""Every path of a frame: snap to array, and snap to facet to array, each by every family that is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, Floats, Ints, depth
from sonarsynth.geometry import Pose
from sonarsynth.products import Arrivals
from sonarsynth.scattering import ScatteringLaw
from sonarsynth.sonar import Elements
from sonarsynth.tracing.aperture import Fronts, fronts
from sonarsynth.tracing.legs import Facets, Legs, facets_of, legs_from, may_face, rays_to_centre, usable
from sonarsynth.tracing.moving import Moving, carried
from sonarsynth.tracing.paths import Outward, assemble, join, silence
from sonarsynth.tracing.reflections import reflections
from sonarsynth.tracing.shadows import hidden
from sonarsynth.tracing.wavefront import FEW, probes
from sonarsynth.world.environment import Environment, Profile
from sonarsynth.world.moment import Body, Moment, Snap

if TYPE_CHECKING:
    from sonarsynth.tracing import Propagation

NEGLIGIBLE = 1e-7
"""The faintest echoes of a snap are left out, so many that their powers together stay below this part of the power of
all (70 dB); each counts with the largest amplitude that it has anywhere on the array."""

ENOUGH = 1e-4
"""Error of amplitudes over the aperture, of the strongest echo's, at which polynomials of the second degree will do."""


@dataclass(frozen=True, eq=False)
class ArrayLegs:
    """Every facet that the array sees, with its legs to the array: serves any snap without tracing this side again."""

    legs: Legs  # (leg,) sorted by row
    fronts: Fronts  # (leg,)
    facets: Facets  # (facet,) that have a leg; legs.row counts them
    bodies: tuple[Body, ...]
    environment: Environment
    profile: Profile
    propagation: Propagation
    sonar_pose: Pose
    elements: Elements
    band: tuple[float, float]  # Hz

    @property
    def bending(self) -> Profile:
        """What bends the rays: the profile, or for straight rays the speed at the array everywhere."""
        return bending(self.profile, self.propagation, self.sonar_pose)

    @property
    def centre(self) -> float:
        """Hz: centre of the band."""
        return 0.5 * (self.band[0] + self.band[1])


def trace(
    environment: Environment,
    profile: Profile,
    moment: Moment,
    sonar_pose: Pose,
    elements: Elements,
    absorption: float,
    propagation: Propagation,
    law: ScatteringLaw,
    *,
    band: tuple[float, float],
    moving: Moving | None = None,
) -> Arrivals:
    """The arrivals of a frame, sorted by snap, target and facet; those that met no target come first of a snap.

    environment, profile: the water; moment: bodies and snaps; sonar_pose, elements: the array; absorption: dB/m at the
    centre of the band; propagation: how sound travels, and how many bounces are followed; law: how facets scatter;
    band: Hz; moving: velocities, where they count. A facet counts where it is lit by the snap and seen by the array
    centre, with no body in between (all sensors share what the centre sees). Raises ValueError for anything outside the
    water.
    """
    legs = array_legs(environment, profile, moment.bodies, sonar_pose, elements, propagation, band)
    return arrivals(legs, moment.snaps, absorption, law, moving)


def array_legs(
    environment: Environment,
    profile: Profile,
    bodies: tuple[Body, ...],
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
    band: tuple[float, float],
) -> ArrayLegs:
    """Facet to array, for every facet of every body that leaves a ray for the array that no body hides.

    Raises ValueError for a body or an array that reaches out of the water.
    """
    every = facets_of(bodies, environment)
    every = every.select(may_face(every, sonar_pose.position, propagation.bounces, profile, environment.depth))
    centre = 0.5 * (band[0] + band[1])
    bent = bending(profile, propagation, sonar_pose)
    legs = legs_from(every, bodies, environment, profile, bent, sonar_pose, propagation, centre)
    kept, row = np.unique(legs.row, return_inverse=True)
    legs = legs.numbered(row)
    facets = every.select(kept)
    group = facets.target[legs.row]
    over = fronts(legs, group, environment, bent, sonar_pose, elements, propagation, band)
    return ArrayLegs(legs, over, facets, bodies, environment, profile, propagation, sonar_pose, elements, band)


def bending(profile: Profile, propagation: Propagation, sonar_pose: Pose) -> Profile:
    """What bends the rays of a model: the profile, or for straight rays the speed at the array everywhere."""
    if propagation.bends:
        return profile
    return Profile(profile.depth, np.full(len(profile.depth), float(profile.at(depth(sonar_pose.position)))))


def arrivals(
    array: ArrayLegs, snaps: tuple[Snap, ...], absorption: float, law: ScatteringLaw, moving: Moving | None = None
) -> Arrivals:
    """The arrivals of any snaps from legs that are traced already: as `trace`, without tracing the array side again."""
    parts = [silence(array.legs, array.fronts)]
    for index, snap in enumerate(snaps):
        parts.append(_direct(array, index, snap, absorption, moving))
        parts.append(_echoes(array, index, snap, absorption, law, moving))
    return join(parts, float(array.profile.at(depth(array.sonar_pose.position))))


def _direct(array: ArrayLegs, index: int, snap: Snap, absorption: float, moving: Moving | None) -> Arrivals:
    """Snap to array, where no body stands in between."""
    environment, profile, sonar_pose = array.environment, array.profile, array.sonar_pose
    legs = rays_to_centre(environment, profile, snap.position[None, :], sonar_pose, array.propagation, array.centre)
    end = np.broadcast_to(sonar_pose.position, legs.point.shape)
    legs = legs.select(
        ~hidden(
            array.bodies, environment, array.bending, legs.point, end, legs.departure, legs.length, legs.bounces,
            legs.turning,
        )
    )  # fmt: skip
    over = fronts(
        legs,
        np.zeros(len(legs.row), int),
        environment,
        array.bending,
        sonar_pose,
        array.elements,
        array.propagation,
        array.band,
    )
    one, none = np.ones(len(legs.row)), np.full(len(legs.row), NO_TARGET)
    variation = _fitted(array, over.probe_gain, legs.spreading, None)
    made = assemble(legs, over, Outward.none(len(one)), index, snap.time, absorption, none, none, one, variation)
    if moving is None:
        return made
    return carried(made, legs, None, snap, sonar_pose, profile, moving, array.elements.aperture)


def _echoes(
    array: ArrayLegs, index: int, snap: Snap, absorption: float, law: ScatteringLaw, moving: Moving | None
) -> Arrivals:
    """Snap to facet to array, over every facet of the legs that is lit."""
    facets, most = array.facets, array.propagation.bounces
    out = _ways(array, snap)
    way, leg = _pairs(out.facet, array.legs.row, len(facets.facet))
    kept = np.flatnonzero(out.bounces[way] + array.legs.bounces[leg] <= most)
    out, leg = out.select(way[kept]), leg[kept]
    normal, area = facets.normal[out.facet], facets.area[out.facet]
    scattering = law.amplitude(out.arrival, array.legs.departure[leg], normal, area)
    seen = np.flatnonzero(scattering)
    out, leg, scattering, normal, area = out.select(seen), leg[seen], scattering[seen], normal[seen], area[seen]
    few = law.amplitude(
        out.arrival[:, None, :], array.fronts.probe_departure[:, :FEW][leg], normal[:, None, :], area[:, None]
    )
    factor = array.legs.spreading[leg] * array.legs.boundary[leg] * out.spreading * out.boundary
    strongest = np.maximum(few.max(axis=1, initial=0.0), scattering) * factor
    loud = np.flatnonzero(_loud(strongest))
    out, leg, scattering = out.select(loud), leg[loud], scattering[loud]
    variation = _variation(array, law, out, leg, few[loud], scattering, factor[loud])
    target, number = facets.target[out.facet], facets.facet[out.facet]
    signed = _signs(array, law, target, number) * scattering
    legs, over = array.legs.select(leg), array.fronts.select(leg)
    made = assemble(legs, over, out, index, snap.time, absorption, target, number, signed, variation)
    if moving is None:
        return made
    return carried(made, legs, out, snap, array.sonar_pose, array.profile, moving, array.elements.aperture)


def _ways(array: ArrayLegs, snap: Snap) -> Outward:
    """Ways from a snap to the lit side of facets that no body hides."""
    environment, profile, facets = array.environment, array.profile, array.facets
    row = np.flatnonzero(may_face(facets, snap.position, array.propagation.bounces, profile, environment.depth))
    start = np.broadcast_to(snap.position, (len(row), 3))
    paths = array.propagation.connect(profile, environment.depth, start, facets.point[row])
    facet = row[paths.pair]
    lit = usable(paths) & (np.einsum("ij,ij->i", facets.normal[facet], paths.arrival) < 0)
    out = Outward.of(paths, reflections(environment, profile, paths, array.centre), facet).select(np.flatnonzero(lit))
    end = np.broadcast_to(snap.position, out.arrival.shape)
    blocked = hidden(  # backwards, so that bodies are where a ray begins
        array.bodies, environment, array.bending, facets.clear[out.facet], end, -out.arrival, out.length, out.bounces,
        out.turning,
    )  # fmt: skip
    return out.select(~blocked).merged()


def _pairs(facet: Ints, row: Ints, facets: int) -> tuple[Ints, Ints]:
    """Every pair of a way out to a facet and a leg from it; legs are sorted by facet, the pairs by leg."""
    begin = np.searchsorted(row, np.arange(facets + 1))
    count = np.diff(begin)[facet]
    way = np.repeat(np.arange(len(facet)), count)
    within = np.arange(len(way)) - np.repeat(np.cumsum(count) - count, count)
    return way, begin[facet[way]] + within


def _loud(strength: Floats) -> np.ndarray:
    """Which (path,) are kept: all but the faintest, whose powers stay below `NEGLIGIBLE` times that of all."""
    loudest = strength.max(initial=0.0)
    power = (strength / (loudest or 1.0)) ** 2  # amplitudes may be so small that their squares are nothing
    order = np.argsort(power, kind="stable")
    faint = np.cumsum(power[order]) <= NEGLIGIBLE * power.sum()
    keep = np.ones(len(strength), bool)
    keep[order[faint]] = False
    return keep


def _signs(array: ArrayLegs, law: ScatteringLaw, target: Ints, facet: Ints) -> Floats:
    """Sign (path,) of the echoes of facets."""
    every = np.concatenate([np.empty(0), *(law.polarity(body.mesh) for body in array.bodies)])
    first = np.cumsum([0, *(len(body.mesh.faces) for body in array.bodies)])
    return np.asarray(every[first[target] + facet])


def _variation(
    array: ArrayLegs, law: ScatteringLaw, out: Outward, leg: Ints, few: Floats, scattering: Floats, factor: Floats
) -> tuple[Floats, float]:
    """Polynomials (path, term) of the amplitude over the aperture, and their error; few: the law at the first probes.

    The second degree serves where it errs by no more than `ENOUGH`.
    """
    strength = scattering * factor
    terms, error = _fitted(array, _gain(few, scattering, array.fronts.probe_gain[:, :FEW][leg]), strength, FEW)
    if error <= ENOUGH:
        return terms, error
    normal, area = array.facets.normal[out.facet], array.facets.area[out.facet]
    every = law.amplitude(out.arrival[:, None, :], array.fronts.probe_departure[leg], normal[:, None, :], area[:, None])
    return _fitted(array, _gain(every, scattering, array.fronts.probe_gain[leg]), strength, None)


def _gain(over_aperture: Floats, scattering: Floats, probe_gain: Floats) -> Floats:
    """Amplitude (path, probe) over that of the centre and the sphere; 1 for a facet on the limb of some probe.

    All sensors share what the centre sees.
    """
    gain = over_aperture / scattering[:, None] * probe_gain
    gain[(over_aperture == 0).any(axis=1)] = 1.0
    return np.asarray(gain)


def _fitted(array: ArrayLegs, gain: Floats, strength: Floats, few: int | None) -> tuple[Floats, float]:
    """Polynomials (path, term) of gain (path, probe) - 1 over the aperture; no columns where it is 1 everywhere.

    And their largest error at the probes, for paths of that strength (path,), relative to the strongest.
    """
    if (gain == 1.0).all():
        return np.empty((len(gain), 0)), 0.0
    probe = probes(array.elements)
    left = gain - 1.0
    if few is None or len(probe.sensor) < FEW:
        terms = probe.fit(left)
        error = probe.misfit(left, terms)
    else:
        terms, error = probe.fit_few(left)
    loudest = np.nanmax(np.abs(strength)[:, None] * np.abs(gain), initial=0.0)
    return terms, float((np.abs(strength) * error).max(initial=0.0) / max(loudest, 1e-300))
