"""Echoes of a snap: every way to a facet, every leg from it to the array, and each part of what its law sends back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.products import Arrivals
from sonarsynth.scattering import Part
from sonarsynth.scattering.patches import Pulses
from sonarsynth.tracing.absorbing import path_loss
from sonarsynth.tracing.echo_groups import Group, groups_of, heard
from sonarsynth.tracing.legs import may_face, usable
from sonarsynth.tracing.moving import Moving, carried
from sonarsynth.tracing.paths import Outward, assemble, ordered, silence
from sonarsynth.tracing.reflections import reflections
from sonarsynth.tracing.shadows import hidden, overlapping
from sonarsynth.tracing.spots import delayed_by_spots, from_spots
from sonarsynth.tracing.variation import variations
from sonarsynth.tracing.wavefront import FEW, Terms, probes
from sonarsynth.world.meshes import in_blocks
from sonarsynth.world.moment import Body, Snap
from sonarsynth.world.water import DepthAbsorption

if TYPE_CHECKING:
    from sonarsynth.tracing.arrivals import ArrayLegs


FAINTER = 1e-3
"""Of what is negligible: fainter echoes are not held while other facets are looked at."""

LEAP = 1.0
"""rad: a phase of reflection that varies by more over the aperture is not followed."""


@dataclass(frozen=True, eq=False)
class _Found:
    """Echoes of a snap from some facets, group by group."""

    array: ArrayLegs  # of these facets
    groups: list[Group]
    out: Outward  # (pair,)
    leg: Ints  # (pair,)
    factor: Floats  # (pair,) what the ways do to amplitudes
    few: Floats  # (echo, FEW) amplitudes of the law at the first probes
    gain: Floats  # (echo, FEW) of the legs there
    terms: Terms  # (echo,) of the wavefronts
    pulses: Pulses  # (echo,)

    def select(self, loud: Bools) -> _Found:
        """The echoes picked by a mask, each with a pair of its own."""
        ends = np.cumsum([len(g.row) for g in self.groups])[:-1]
        groups = [g.select(np.flatnonzero(keep)) for g, keep in zip(self.groups, np.split(loud, ends), strict=True)]
        (row,) = _columns(groups, "row")
        number = np.split(np.arange(len(row)), np.cumsum([len(g.row) for g in groups])[:-1])
        groups = [replace(g, row=mine) for g, mine in zip(groups, number, strict=True)]
        out, leg, factor = self.out.select(row), self.leg[row], self.factor[row]
        terms, pulses = self.terms.select(loud), self.pulses.select(loud)
        return _Found(self.array, groups, out, leg, factor, self.few[loud], self.gain[loud], terms, pulses)

    @property
    def amplitude(self) -> Floats:
        """(echo,) of the law."""
        return np.concatenate([g.amplitude for g in self.groups])

    @property
    def strength(self) -> Floats:
        """(echo,) amplitude with the ways."""
        row, amplitude = _columns(self.groups, "row", "amplitude")
        return np.asarray(amplitude * self.factor[row])

    @property
    def tapered(self) -> Bools:
        """(echo,) as its group says."""
        return np.concatenate([g.tapered for g in self.groups])

    def over(self, few: int | None) -> tuple[Floats, Floats]:
        """Amplitude of the law (echo, probe) at all probes or the first few, and the gain of the legs there."""
        if few is not None:
            return self.few, self.gain
        fronts = self.array.fronts
        law = np.concatenate([g.over(fronts.departure(self.leg[g.row])) for g in self.groups])
        return law, fronts.gain(self.leg[_columns(self.groups, "row")[0]])

    def seen(self) -> _Seen:
        """What decides which of them are kept."""
        row, amplitude = _columns(self.groups, "row", "amplitude")
        most = np.maximum(np.abs(self.few).max(axis=1, initial=0.0), np.abs(amplitude)) * self.factor[row]
        target = self.array.facets.target[self.out.facet[row]]
        number = np.repeat(np.arange(len(self.groups)), [len(g.row) for g in self.groups])
        return _Seen(most * heard(self.pulses, self.array.band), self.pulses.coherent, target, number)


class _Seen(NamedTuple):
    """Echoes, and how loud they are."""

    strength: Floats  # (echo,) the largest amplitude that it has anywhere on the array
    coherent: Bools  # (echo,)
    target: Ints  # (echo,)
    group: Ints  # (echo,)


def echoes(
    array: ArrayLegs,
    index: int,
    snap: Snap,
    absorption: float | DepthAbsorption,
    parts: tuple[tuple[Part, ...], ...],
    moving: Moving | None,
) -> Arrivals:
    """Snap `index` to facet to array, over every facet of the legs that is lit; parts: of the law of each body.

    Facets are taken in blocks, so that little is held at a time; the echoes are those of one block, in its order.
    """
    if not any(parts):
        return silence(array.legs)
    found = _loudest(array, snap, parts)
    terms, error = variations(found)
    most = max(float(np.abs(some.strength).max(initial=0.0)) for some in found)
    spread = any(_spreads(some, most) for some in found)
    group, made = [some.seen().group for some in found], []
    found.reverse()
    for variation in terms:
        some = found.pop()
        over = _turned(some, most)
        over = _spread(some, over, most) if spread else over
        spot = np.concatenate([g.spot for g in some.groups])
        if spot.any() and not some.array.bending.uniform:
            over = delayed_by_spots(over, some.array, some.leg, spot)
        array, out, legs = some.array, some.out, some.array.settled(some.leg)
        target, facet = array.facets.target[out.facet], array.facets.facet[out.facet]
        amplitude, sign = _columns(some.groups, "amplitude", "sign")
        scattered, vary, loss = sign * amplitude, (variation, error), path_loss(array, absorption, snap, legs, out)
        one = assemble(legs, over, out, index, snap.time, loss, target, facet, scattered, vary, some.pulses)
        if moving is not None:
            view = partial(array.fronts.departure, some.leg, FEW)
            place = array.sonar_pose, array.profile, moving, array.elements
            one = carried(one, legs, out, snap, *place, view, array.enough)
        if spot.any() and array.bending.uniform:
            one = from_spots(one, legs, spot, array.sonar_pose)
        made.append(replace(one, delay=one.delay + some.pulses.late))
    return ordered(made, group)


def _loudest(array: ArrayLegs, snap: Snap, parts: tuple[tuple[Part, ...], ...]) -> list[_Found]:
    """Echoes from each block of facets that are not too faint.

    What is much fainter than will do, by the blocks so far, is not held; should it be wanted after all, its block is
    looked at again.
    """
    blocks = in_blocks(len(array.facets.facet))
    if len(blocks) == 1:
        found = _found(array, snap, parts)
        return [found.select(_loud(found.seen(), array.negligible))]
    held: list[_Found] = []
    seen: list[_Seen] = []
    kept: list[Bools] = []
    for some in blocks:
        found = _found(array.part(some), snap, parts)
        seen.append(found.seen())
        kept.append(_loud_of_all(seen, FAINTER * array.negligible)[-1])
        held.append(found.select(kept[-1]))
    for n, wanted in enumerate(_loud_of_all(seen, array.negligible)):
        if (wanted & ~kept[n]).any():
            held[n] = _found(array.part(blocks[n]), snap, parts).select(wanted)
        else:
            held[n] = held[n].select(wanted[kept[n]])
    return held


def _loud_of_all(seen: list[_Seen], negligible: float) -> list[Bools]:
    """Which echoes of each block are kept, by all of them in the order of one block."""
    columns = [np.concatenate(column) for column in zip(*seen, strict=True)]
    order = np.argsort(columns[-1], kind="stable")
    keep = np.empty(len(order), bool)
    in_order: Any = [column[order] for column in columns]
    keep[order] = _loud(_Seen(*in_order), negligible)
    return np.split(keep, np.cumsum([len(some.strength) for some in seen])[:-1])


def _found(array: ArrayLegs, snap: Snap, parts: tuple[tuple[Part, ...], ...]) -> _Found:
    """All echoes of a snap from the facets of the legs."""
    out, fronts = _ways(array, snap), array.fronts
    way, leg = _pairs(out.facet, array.legs.row, len(array.facets.facet))
    kept = np.flatnonzero(out.bounces[way] + array.legs.bounces[leg] <= array.propagation.bounces)
    out, leg = out.select(way[kept]), leg[kept]
    groups = groups_of(array, out, leg, parts)
    factor = array.legs.spreading[leg] * array.legs.boundary[leg] * out.spreading * out.boundary
    few = np.concatenate([g.over(fronts.departure(leg[g.row], FEW)) for g in groups])
    pulses = Pulses.join([g.pulses(array.centre) for g in groups])
    rows = leg[_columns(groups, "row")[0]]
    return _Found(array, groups, out, leg, factor, few, fronts.gain(rows, FEW), fronts.terms.select(rows), pulses)


def _columns(groups: list[Group], *names: str) -> list[np.ndarray]:
    """Columns (echo,) of all groups, in order."""
    return [np.concatenate([getattr(g, name) for g in groups]) for name in names]


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


def _loud(seen: _Seen, negligible: float) -> Bools:
    """Which (path,) are kept: all but the faintest of each target, by `arrivals.NEGLIGIBLE`."""
    strength, coherent, target, _ = seen
    keep = np.ones(len(strength), bool)
    for number, exponent in product(np.unique(target), (1, 2)):
        some = np.flatnonzero((target == number) & (coherent == (exponent == 1)))
        loudest = strength[some].max(initial=0.0)
        size = (strength[some] / (loudest or 1.0)) ** exponent  # amplitudes may be too small to be squared
        order = np.argsort(size, kind="stable")
        least = negligible * size.sum() if exponent == 2 else np.sqrt(negligible)
        keep[some[order[np.cumsum(size[order]) <= least]]] = False
    return keep


def _turned(found: _Found, most: float) -> Terms:
    """Wavefronts (path,) of echoes, with the phases of reflections from facets to each probe; most: the strongest of
    all.

    They vary over the aperture where part of the sound enters the body; what polynomials miss counts as far as the echo
    is as strong as the strongest. Where the coefficient passes near 0 its phase leaps: there all sensors have that of
    the centre.
    """
    over, array = found.terms, found.array
    if not any(g.turns for g in found.groups):
        return over
    fronts = array.fronts
    shift = np.concatenate([g.turned(fronts.departure(found.leg[g.row])) for g in found.groups])
    leaps = np.abs(shift).max(axis=1, initial=0.0) > LEAP
    if not shift.any():
        return over
    probe = probes(array.elements, array.degree)
    terms = probe.fit(np.where(leaps[:, None], 0.0, shift))
    share = np.abs(found.strength) / max(most, 1e-300)
    error = over.error + share * np.where(leaps, 0.0, probe.misfit(shift, terms)) / (2.0 * np.pi * array.band[1])
    return over._replace(phase=over.phase + terms if over.phase.shape[1] else terms, error=error)


def _spreads(found: _Found, most: float) -> bool:
    """Whether what facets spread echoes by in time changes any of them over the array by more than `ArrayLegs.alike` of
    the strongest of all."""
    array, rate = found.array, 2.0 * np.pi * found.array.band[1]
    if not any(g.spreads for g in found.groups):
        return False
    share, turn = np.abs(found.strength) / max(most, 1e-300), array.elements.aperture / array.legs.length[found.leg]
    late = np.split(found.pulses.corners, np.cumsum([len(g.row) for g in found.groups])[:-1])
    of = zip(found.groups, late, strict=True)
    bound = np.concatenate([g.most_spread(corners, turn[g.row], array.centre) for g, corners in of])
    return bool(0.5 * rate**2 * (share * bound).max(initial=0.0) > array.alike)


def _spread(found: _Found, over: Terms, most: float) -> Terms:
    """Wavefronts (path,) of echoes, with what facets spread them by in time more at a hydrophone than at the centre.

    Their delays over a facet have another variance there; the mean over a facet is that of the centre, blurred by what
    it is more.
    """
    array, share = found.array, np.abs(found.strength) / max(most, 1e-300)
    more = np.concatenate([g.spread(array.fronts.departure(found.leg[g.row], FEW), array.centre) for g in found.groups])
    terms, misfit = probes(array.elements, array.degree).fit_few(more)
    blur = over.blur + terms if over.blur.shape[1] else terms
    return over._replace(blur=blur, error=over.error + share * np.pi * array.band[1] * misfit)
