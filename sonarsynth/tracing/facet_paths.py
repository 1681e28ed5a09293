"""Paths from every facet that the array sees to the array: the half of echoes that does not depend on the snap."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.casting.ray_casting import facets_in_sight, occluded
from sonarsynth.columns import alike
from sonarsynth.conventions import NO_TARGET, Bools, Floats, Ints
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.environment.sea import Profile
from sonarsynth.equations.kernels.placing import in_front
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Kind
from sonarsynth.scattering import Scatterers
from sonarsynth.state import Emission, FrameContext, Medium, Receiver
from sonarsynth.tracing.doppler import Meeting, Ways
from sonarsynth.tracing.expansion.aperture_paths import AperturePaths, ExpansionSource, expansion_source
from sonarsynth.tracing.occlusion.sensor_occlusion import Occlusion
from sonarsynth.tracing.receive_paths import (
    Facets,
    ReceivePaths,
    concatenate,
    facets_of,
    may_face_receiver,
    rays_to_centre,
    receive_paths,
    require_in_water,
)

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation

KEPT = 30_000
"""Facets of a frame whose paths are kept for the next, at most: 110 MB where each has three."""


@dataclass(frozen=True, eq=False)
class FacetPaths:
    """Every facet that the array sees, with its legs to the array: serves any snap without tracing this side again."""

    legs: ReceivePaths  # (leg,) sorted by row
    wavefronts: ExpansionSource  # of all legs, those of other parts among them
    facets: Facets  # (facet,) that have a leg; legs.row counts them
    context: FrameContext  # bodies and array where they are when sound meets them
    propagation: Propagation
    first: int = 0  # of the legs, in the wavefronts
    owners: tuple[int, ...] | None = None  # of the facets; None: all
    meeting: Meeting | None = None  # when bodies and array are where they are here; None: nothing moves
    ways: Ways | None = None  # by which snaps light them and they are heard; None: all
    lit: bool = False  # whether it is known that no body hides them from the one snap that they are for

    @property
    def fronts(self) -> AperturePaths:
        """(leg,) over the aperture: kept for all legs, made anew for some."""
        if self.legs is self.wavefronts.legs:
            return self.wavefronts.whole
        return self.wavefronts.of(slice(self.first, self.first + len(self.legs.row)))

    def part(self, rows: slice) -> FacetPaths:
        """Some of the facets, and the legs from them."""
        if rows == slice(0, len(self.facets.facet)):
            return self
        first, last = (int(n) for n in np.searchsorted(self.legs.row, (rows.start, rows.stop)))
        legs = self.legs.select(slice(first, last))
        legs, facets = legs.but(row=legs.row - rows.start), self.facets.select(rows)
        return replace(self, legs=legs, facets=facets, first=self.first + first)

    def view(self, bodies: tuple[PlacedTarget, ...]) -> Occlusion:
        """Who looks, and which bodies stand in between."""
        return Occlusion(bodies, self.bending, self.context.receiver, self.propagation, self.context.tolerances)

    @property
    def bending(self) -> Medium:
        """What bends the rays: the water, or for straight rays the speed at the array everywhere."""
        return bending(self.context.medium, self.propagation, self.context.receiver)

    def met(self, row: Ints, kind: Kind) -> tuple[Ints, Ints, Ints]:
        """What paths by facets (row) met: kind, target and facet of each (path,)."""
        owner = self.facets.owner[row]
        body = owner < len(self.context.bodies)
        return np.where(body, kind, Kind.REVERBERATION), np.where(body, owner, NO_TARGET), self.facets.facet[row]

    def settled(self, leg: Ints) -> tuple[ReceivePaths, Bools]:
        """Those of some legs (row,) that a hydrophone sees, with the hydrophones that bodies hide them from, and which
        (row,) these are."""
        doubtful, in_sight = self.legs.open[leg] > 0, np.ones(len(leg), bool)
        if not doubtful.any():
            return self.legs.select(leg), in_sight
        number, row = np.unique(leg[doubtful], return_inverse=True)
        pending = self.legs.select(number)
        starts = self.facets.starts(pending.row, pending.departure)
        pending = self.view(self.context.bodies).settled(pending.but(row=np.arange(len(number))), starts)
        found = np.isin(row, pending.row)
        in_sight[doubtful] = found
        legs = self.legs.select(leg[in_sight])
        occluded = legs.occluded.copy()
        occluded[legs.open > 0] = pending.occluded[np.searchsorted(pending.row, row[found])]
        return legs.but(occluded=occluded, open=np.zeros_like(legs.open)), in_sight


@dataclass(frozen=True)
class _SameWay:
    """What the way from facets to the array depends on: equal where all of that is."""

    what: tuple[Hashable, ...]
    context: FrameContext = field(compare=False)

    @staticmethod
    def of(context: FrameContext) -> _SameWay:
        """Of a frame."""
        water, receiver = context.medium, context.receiver
        arrays = [water.profile.depth, water.profile.speed, receiver.pose.position, receiver.pose.orientation]
        for surface in context.scattering:
            arrays += [surface.pose.position, surface.pose.orientation]
            arrays += [surface.position, surface.normal] if surface.mesh is None else []
        described = water.environment, receiver.sonar, context.tolerances
        meshes = tuple(surface.mesh for surface in context.scattering)
        return _SameWay((*described, receiver.elements, meshes, *(array.tobytes() for array in arrays)), context)


@byte_bounded_cache(1)
def way_to_array(same: _SameWay, propagation: Propagation) -> FacetPaths:
    """The paths of all facets: those of the last frame, where everything is as it was."""
    return facet_paths(same.context, propagation)


def facet_paths_at_rest(context: FrameContext, propagation: Propagation, snaps: tuple[Emission, ...]) -> FacetPaths:
    """As `facet_paths`, where nothing moves while sound is under way: frames that differ in their snaps alone, or in
    nothing, share it. Not of straight, unreflected rays, which take less time than to know which snaps light what."""
    facets = sum(map(len, context.scattering))
    if facets > KEPT or _straight(context.medium, propagation):
        return facet_paths(context, propagation, snaps=snaps)
    return replace(way_to_array(_SameWay.of(context), propagation), context=context)


def facet_paths(
    context: FrameContext, propagation: Propagation, owners: tuple[int, ...] | None = None,
    snaps: tuple[Emission, ...] | None = None, ways: Ways | None = None,
) -> FacetPaths:  # fmt: skip
    """Facet to array, for every surface element, or those of some owners, that leaves a ray for the array that no body
    hides, by some ways or all. Of no others than some `snaps` may light (None: any), where that is known of rays in
    layers.

    Raises ValueError for a body or an array that reaches out of the water.
    """
    medium, receiver, bodies, tolerances = context.medium, context.receiver, context.bodies, context.tolerances
    require_in_water(bodies, medium.depth)
    bent = bending(medium, propagation, receiver)
    slack = receiver.elements.aperture if tolerances.occlusion == "sensors" else 0.0
    view = Occlusion(bodies, bent, receiver, propagation, tolerances)
    columns: tuple[list[ReceivePaths], list[Facets]] = [], []
    count, straight = 0, _straight(medium, propagation)
    one_snap = straight and tolerances.occlusion == "centre" and snaps is not None and len(snaps) == 1
    families = None if ways is None else {on for _, on in ways}
    lights = [snap.position for snap in snaps or () if snap.illuminates]
    ends = medium, receiver, propagation  # straight rays to there all leave on the outer side: `chosen` sees to it

    def chosen(number: int, rows: Ints) -> Ints:
        if (owners is not None and number not in owners) or (snaps is not None and not lights):
            return rows[:0]
        rows = rows[rows % tolerances.every == 0] if tolerances.every > 1 else rows
        rows = _in_front(context.scattering[number], rows, receiver, slack, lights) if straight else rows
        for place in [receiver.pose.position, *lights] if one_snap else ():
            rows = _in_sight(context, number, rows, place)
        return rows

    for block in in_blocks(sum(map(len, context.scattering))):
        every, lit = facets_of(context.scattering, block, chosen), None
        if propagation.layered and not straight:
            every, lit = _facing(every, context, propagation, lights, slack)
        legs = rays_to_centre(every.point, *ends) if straight else receive_paths(every, *ends, slack, lit)
        leaving = legs.by(families)
        leaving = leaving if one_snap else view.visible(leaving, every.starts(leaving.row, leaving.departure))
        first = np.diff(leaving.row, prepend=-1) > 0
        reached = leaving.row[first]
        columns[0].append(leaving.but(row=count - 1 + np.cumsum(first)))
        columns[1].append(every if len(reached) == len(every.facet) else every.select(reached))
        count += len(reached)
    legs, facets = concatenate(columns[0]), concatenate(columns[1])
    over = expansion_source(legs, facets.owner[legs.row], bent, receiver, propagation)
    return FacetPaths(legs, over, facets, context, propagation, owners=owners, ways=ways, lit=one_snap)


def _straight(medium: Medium, propagation: Propagation) -> bool:
    """Whether all rays are straight and unreflected, at one speed."""
    return propagation.layered and not propagation.bounces and medium.profile.uniform


def _facing(
    facets: Facets, context: FrameContext, propagation: Propagation, lights: list[Floats], slack: float
) -> tuple[Facets, Ints | None]:
    """Those of some facets that may have a ray in layers to the array, and that direct light; where others are wanted
    as well, which of them (facet,) have that."""
    position = context.receiver.pose.position
    facets = facets.select(may_face_receiver(facets, position, propagation.bounces, context.medium, slack))
    if not lights:
        return facets, None
    lit = reduce(np.union1d, [may_face_receiver(facets, light, 0, context.medium) for light in lights])
    return (facets, lit) if propagation.bounces else (facets.select(lit), None)


def _in_sight(context: FrameContext, number: int, rows: Ints, place: Floats) -> Ints:
    """Those of some elements (row,) of what scatters, by its number, that no body hides from a place (xyz), by straight
    lines."""
    surface, bodies = context.scattering[number], context.bodies
    if number < len(bodies):
        facet, clear = facets_in_sight(bodies[number], bodies, rows, place)
        return facet[clear]
    start = surface.pose.to_world(surface.position[rows])
    return rows[~occluded(bodies, start, alike(place, len(rows)))]


def _in_front(surface: Scatterers, rows: Ints, receiver: Receiver, slack: float, lights: list[Floats]) -> Ints:
    """Those of some elements (row,) that the array may see and some of these places light, as of `in_front`."""
    eye, *seen_by = surface.pose.to_body([receiver.pose.position, *lights])
    return np.asarray(in_front(rows, surface.position, surface.normal, eye, slack, np.reshape(seen_by, (-1, 3))))


def bending(medium: Medium, propagation: Propagation, receiver: Receiver) -> Medium:
    """What bends the rays of a model: the water, or for straight rays the speed at the array everywhere."""
    return medium if propagation.bends else of_one_speed(medium, receiver)


def of_one_speed(medium: Medium, receiver: Receiver) -> Medium:
    """The water with the sound speed that it has at the array everywhere."""
    if medium.profile.uniform:
        return medium
    nodes = medium.profile.depth
    return replace(medium, profile=Profile(nodes, np.full(len(nodes), receiver.speed(medium))))
