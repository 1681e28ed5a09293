"""Echoes of a snap: every way to a facet, every leg from it to the array, and each part of what its law sends back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints, depth
from sonarsynth.products import Arrivals
from sonarsynth.scattering import Part
from sonarsynth.scattering.parts import Plain, Smooth
from sonarsynth.scattering.patches import Patches, Pulses, patches
from sonarsynth.tracing.aperture import Fronts
from sonarsynth.tracing.legs import may_face, usable
from sonarsynth.tracing.moving import Moving, carried
from sonarsynth.tracing.paths import Outward, assemble, silence
from sonarsynth.tracing.reflections import reflections
from sonarsynth.tracing.shadows import hidden, overlapping
from sonarsynth.tracing.wavefront import FEW, probes
from sonarsynth.world.moment import Body, Snap

if TYPE_CHECKING:
    from sonarsynth.tracing.arrivals import ArrayLegs


ENOUGH = 1e-4
"""Error of amplitudes over the aperture, of the strongest echo's, at which polynomials of the second degree will do."""

LEAP = 1.0
"""rad: a phase of reflection that varies by more over the aperture is not followed."""


@dataclass(frozen=True, eq=False)
class _Group:
    """Echoes by one part of the law of one body, in the frame of the body."""

    body: Body
    part: Part
    row: Ints  # (echo,) which pair of a way and a leg
    patch: Patches  # (echo,)
    incident: Floats  # (echo, xyz)
    scattered: Floats  # (echo, xyz)
    wavenumber: Floats  # (echo,) rad/m at the centre of the band
    amplitude: Floats  # (echo,) m
    sign: Floats  # (echo,)

    def select(self, keep: Ints) -> _Group:
        """The echoes picked by indices."""
        rows: dict[str, Any] = {k: v[keep] for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        return replace(self, patch=self.patch.select(keep), **rows)

    def over(self, departure: Floats) -> Floats:
        """Amplitudes (echo, probe) in directions (echo, probe, xyz) of the world."""
        away = self.body.pose.turn_to_body(departure)
        return self.part.amplitude(self.incident[:, None, :], away, self.patch.over(), self.wavenumber[:, None])

    @property
    def tapered(self) -> Bools:
        """(echo,) whether it falls to 0 at the limb of the body, rather than ending there."""
        return self.part.tapers(self.patch) if isinstance(self.part, Smooth) else np.zeros(len(self.row), bool)

    def turned(self, departure: Floats) -> Floats:
        """Phase (echo, probe) in directions (echo, probe, xyz) of the world more than in that of the array centre."""
        if not (isinstance(self.part, Smooth) and self.part.turns):
            return np.zeros(departure.shape[:2])
        away = self.body.pose.turn_to_body(departure)
        at_centre = self.part.phase(self.incident, self.scattered)[:, None]
        more = self.part.phase(self.incident[:, None, :], away) - at_centre
        return np.asarray(more - 2.0 * np.pi * np.rint(more / (2.0 * np.pi)))

    def pulses(self, centre: float) -> Pulses:
        """What they make of the pulse; centre (Hz)."""
        sound_speed = 2.0 * np.pi * centre / self.wavenumber
        return self.part.pulses(self.incident, self.scattered, self.patch, sound_speed)


def echoes(
    array: ArrayLegs,
    index: int,
    snap: Snap,
    absorption: float,
    parts: tuple[tuple[Part, ...], ...],
    moving: Moving | None,
) -> Arrivals:
    """Snap `index` to facet to array, over every facet of the legs that is lit; parts: of the law of each body."""
    facets, most = array.facets, array.propagation.bounces
    out = _ways(array, snap)
    way, leg = _pairs(out.facet, array.legs.row, len(facets.facet))
    kept = np.flatnonzero(out.bounces[way] + array.legs.bounces[leg] <= most)
    out, leg = out.select(way[kept]), leg[kept]
    groups = _groups(array, out, leg, parts)
    if not groups:
        return silence(array.legs, array.fronts)
    factor = array.legs.spreading[leg] * array.legs.boundary[leg] * out.spreading * out.boundary
    few = [g.over(array.fronts.probe_departure[leg[g.row], :FEW]) for g in groups]
    pulses = Pulses.join([g.pulses(array.centre) for g in groups])
    row, amplitude = _columns(groups, "row", "amplitude")
    strongest = np.maximum(np.abs(np.concatenate(few)).max(axis=1, initial=0.0), np.abs(amplitude)) * factor[row]
    target = facets.target[out.facet[row]]
    loud = _loud(strongest * _heard(pulses, array.band), pulses.coherent, target, array.negligible)
    mine = [np.flatnonzero(part) for part in np.split(loud, np.cumsum([len(g.row) for g in groups])[:-1])]
    groups = [g.select(keep) for g, keep in zip(groups, mine, strict=True)]
    row, amplitude, sign = _columns(groups, "row", "amplitude", "sign")
    pulses = pulses.select(loud)
    at_few = np.concatenate([f[keep] for f, keep in zip(few, mine, strict=True)])
    variation = _variation(array, groups, leg, at_few, amplitude, factor[row])
    over = _turned(array, groups, leg, amplitude * factor[row])
    out, leg = out.select(row), leg[row]
    legs = array.legs.select(leg)
    target, facet = facets.target[out.facet], facets.facet[out.facet]
    made = assemble(legs, over, out, index, snap.time, absorption, target, facet, sign * amplitude, variation, pulses)
    if moving is not None:
        made = carried(made, legs, out, snap, array.sonar_pose, array.profile, moving, array.elements.aperture)
    return replace(made, delay=made.delay + pulses.late)


def _columns(groups: list[_Group], *names: str) -> list[np.ndarray]:
    """Columns (echo,) of all groups, in order."""
    return [np.concatenate([getattr(g, name) for g in groups]) for name in names]


def _groups(array: ArrayLegs, out: Outward, leg: Ints, parts: tuple[tuple[Part, ...], ...]) -> list[_Group]:
    """Echoes of pairs of a way and a leg (pair,), by body and part; those that are nothing are left out."""
    facets, found = array.facets, []
    target = facets.target[out.facet]
    for number, (body, of_law) in enumerate(zip(array.bodies, parts, strict=True)):
        row = np.flatnonzero(target == number)
        facet = facets.facet[out.facet[row]]
        incident = body.pose.turn_to_body(out.arrival[row])
        scattered = body.pose.turn_to_body(array.legs.departure[leg[row]])
        speed = array.profile.at(depth(array.legs.point[leg[row]]))
        wavenumber = 2.0 * np.pi * array.centre / speed
        for part in of_law:
            patch = patches(body.mesh, not isinstance(part, Plain)).select(facet)
            amplitude = part.amplitude(incident, scattered, patch, wavenumber)
            sign = part.polarity(body.mesh)[facet]
            group = _Group(body, part, row, patch, incident, scattered, wavenumber, amplitude, sign)
            found.append(group.select(np.flatnonzero(amplitude)))
    return found


def _heard(pulses: Pulses, band: tuple[float, float]) -> Floats:
    """What roughness leaves of each pulse (path,) at most, at any frequency of the band (Hz)."""
    low, high = (2.0 * np.pi * f for f in band)
    rough = np.sqrt(1.0 - pulses.rough_share * np.exp(-((high * pulses.rough_delay) ** 2)))
    return np.asarray(np.exp(-0.5 * (low * pulses.blur) ** 2) * rough)


def _ways(array: ArrayLegs, snap: Snap) -> Outward:
    """Ways from a snap to the lit side of facets that no body hides; of facets in one place, the first body's."""
    environment, profile, facets = array.environment, array.profile, array.facets
    row = np.flatnonzero(may_face(facets, snap.position, array.propagation.bounces, profile, environment.depth))
    start = np.broadcast_to(snap.position, (len(row), 3))
    paths = array.propagation.connect(profile, environment.depth, start, facets.point[row])
    facet = row[paths.pair]
    lit = usable(paths) & (np.einsum("ij,ij->i", facets.normal[facet], paths.arrival) < 0)
    out = Outward.of(paths, reflections(environment, profile, paths, array.centre), facet).select(np.flatnonzero(lit))
    out = out.select(~_hides(array, array.bodies, snap, out, facets.clear[out.facet]))
    for number, before in overlapping(array.bodies):
        mine = np.flatnonzero(facets.target[out.facet] == number)
        of = out.facet[mine]
        again = _hides(array, before, snap, out.select(mine), 2.0 * facets.point[of] - facets.clear[of])  # from under
        out = out.select(np.delete(np.arange(len(out.facet)), mine[again]))
    return out.merged()


def _hides(array: ArrayLegs, bodies: tuple[Body, ...], snap: Snap, out: Outward, start: Floats) -> Bools:
    """Whether any of some bodies stands in ways (way,) from a snap to points near facets, start (way, xyz)."""
    end = np.broadcast_to(snap.position, start.shape)
    return hidden(  # backwards, so that bodies are where a ray begins
        bodies, array.environment, array.bending, start, end, -out.arrival, out.length, out.bounces, out.turning
    )


def _pairs(facet: Ints, row: Ints, facets: int) -> tuple[Ints, Ints]:
    """Every pair of a way out to a facet and a leg from it; legs are sorted by facet, the pairs by leg."""
    begin = np.searchsorted(row, np.arange(facets + 1))
    count = np.diff(begin)[facet]
    way = np.repeat(np.arange(len(facet)), count)
    within = np.arange(len(way)) - np.repeat(np.cumsum(count) - count, count)
    return way, begin[facet[way]] + within


def _loud(strength: Floats, coherent: Bools, target: Ints, negligible: float) -> Bools:
    """Which (path,) are kept: all but the faintest of each target, by `arrivals.NEGLIGIBLE`."""
    keep = np.ones(len(strength), bool)
    for number, exponent in product(np.unique(target), (1, 2)):
        some = np.flatnonzero((target == number) & (coherent == (exponent == 1)))
        loudest = strength[some].max(initial=0.0)
        size = (strength[some] / (loudest or 1.0)) ** exponent  # amplitudes may be too small to be squared
        order = np.argsort(size, kind="stable")
        least = negligible * size.sum() if exponent == 2 else np.sqrt(negligible)
        keep[some[order[np.cumsum(size[order]) <= least]]] = False
    return keep


def _variation(
    array: ArrayLegs, groups: list[_Group], leg: Ints, few: Floats, amplitude: Floats, factor: Floats
) -> tuple[Floats, float]:
    """Polynomials (path, term) of the amplitude over the aperture, and their error; few: the law at the first probes.

    The second degree serves where it errs by no more than `ENOUGH`.
    """
    fronts = array.fronts
    rows = leg[np.concatenate([g.row for g in groups])]
    tapered, strength = np.concatenate([g.tapered for g in groups]), amplitude * factor
    strength = np.where((few == 0.0).any(axis=1), 0.0, strength)  # on the limb of some probe: not counted
    terms, error = fitted(array, _gain(few, amplitude, tapered, fronts.probe_gain[:, :FEW][rows]), strength, FEW)
    if error <= ENOUGH:
        return terms, error
    every = np.concatenate([g.over(fronts.probe_departure[leg[g.row]]) for g in groups])
    strength = np.where((every == 0.0).any(axis=1), 0.0, strength)
    return fitted(array, _gain(every, amplitude, tapered, fronts.probe_gain[rows]), strength, None)


def _turned(array: ArrayLegs, groups: list[_Group], leg: Ints, strength: Floats) -> Fronts:
    """Wavefronts (path,) of echoes of that strength (path,), with the phases of reflections from facets to each probe.

    They vary over the aperture where part of the sound enters the body; what polynomials miss counts as far as the echo
    is as strong as the strongest. Where the coefficient passes near 0 its phase leaps: there all sensors have that of
    the centre.
    """
    rows = leg[np.concatenate([g.row for g in groups])]
    over = array.fronts.select(rows)
    shift = np.concatenate([g.turned(array.fronts.probe_departure[leg[g.row]]) for g in groups])
    leaps = np.abs(shift).max(axis=1, initial=0.0) > LEAP
    if not shift.any():
        return over
    probe = probes(array.elements)
    terms = probe.fit(np.where(leaps[:, None], 0.0, shift))
    share = np.abs(strength) / max(float(np.abs(strength).max()), 1e-300)
    error = over.error + share * np.where(leaps, 0.0, probe.misfit(shift, terms)) / (2.0 * np.pi * array.band[1])
    return replace(over, phase_terms=over.phase_terms + terms if over.phase_terms.shape[1] else terms, error=error)


def _gain(over_aperture: Floats, amplitude: Floats, tapered: Bools, probe_gain: Floats) -> Floats:
    """Amplitude (path, probe) over that of the centre and the sphere; 1 for a facet that ends at the limb of some
    probe; one that is tapered (path,) to nothing there is followed. All sensors share what the centre sees.
    """
    gain = over_aperture / amplitude[:, None] * probe_gain
    gain[(over_aperture == 0).any(axis=1) & ~tapered] = 1.0
    return np.asarray(gain)


def fitted(array: ArrayLegs, gain: Floats, strength: Floats, few: int | None) -> tuple[Floats, float]:
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
