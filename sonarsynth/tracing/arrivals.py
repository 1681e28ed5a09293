"""Every path of a frame: snap to array, and snap to facet to array, each by every family that is asked for."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.columns import picked
from sonarsynth.conventions import NO_TARGET, Bools, depth
from sonarsynth.products import Arrivals, Kind, Paths
from sonarsynth.propagation.images import family
from sonarsynth.scattering.facet_geometry import PulseResponse
from sonarsynth.state import Emission, FrameContext
from sonarsynth.tracing.doppler import Meeting, MotionTerms, apply_doppler, received
from sonarsynth.tracing.echoes import echoes
from sonarsynth.tracing.expansion.amplitude_polynomials import fitted
from sonarsynth.tracing.expansion.aperture_paths import aperture_paths
from sonarsynth.tracing.expansion.coincident_paths import with_coincident_added
from sonarsynth.tracing.facet_paths import FacetPaths, bending, facet_paths, facet_paths_at_rest
from sonarsynth.tracing.meetings import meetings, occasions
from sonarsynth.tracing.occlusion.forward_scattering import blocking_bodies, forward_paths, shadow_parts
from sonarsynth.tracing.receive_paths import ReceivePaths, Starts, rays_to_centre, usable
from sonarsynth.tracing.transmit_paths import TransmitPaths, assemble, directed, join, no_arrivals

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation


def trace(context: FrameContext, propagation: Propagation) -> Arrivals:
    """The arrivals of a frame, sorted by snap; of each first those that met no target, then echoes by target, then the
    shadow waves of targets that scatter forward.

    propagation: how sound travels, and how many bounces are followed. A facet counts where it is lit by the snap and
    seen, with no body in between, by the array centre; or, with `Tolerances.occlusion`, by some hydrophone that it
    faces, and is heard by those. The snap itself is heard if no body stands in between, but for those that scatter
    forward (`tracing.occlusion.forward_scattering`). Raises ValueError for anything outside the water.
    """
    return trace_each(context, propagation, (context.snaps,))[0]


def trace_each(
    context: FrameContext, propagation: Propagation, choices: Sequence[tuple[Emission, ...]]
) -> list[Arrivals]:
    """As `trace`, for each choice of snaps in the place of the context's. The way from facets to the array is traced
    once for all, where what moves meets their sound at about one place (`Tolerances.shared`)."""
    receiver, snaps = context.receiver, tuple(snap for choice in choices for snap in choice)
    first = np.cumsum([0, *map(len, choices)]).tolist()
    numbers = [range(start, stop) for start, stop in pairwise(first)]  # of the snaps of each choice
    context, moving = replace(context, snaps=snaps), receiver.track
    still = all(body.track.still for body in context.bodies) and not any(snap.velocity.any() for snap in snaps)
    if moving is None or (moving.still and still) or not snaps:
        array = facet_paths_at_rest(context, propagation, snaps)
        blocks = [[*(_direct(array, snap) for snap in own), *_echoes(array, own)] for own in numbers]
    else:
        blocks = [[] for _ in numbers]
        heard_directly = set[int]()
        times = meetings(context, moving, propagation.bounces)
        for group in occasions(context, times):
            moved = replace(context, bodies=group.bodies, receiver=replace(receiver, pose=group.meeting.sonar.pose))
            lights = None if group.reflected else tuple(snaps[snap] for snap in group.snaps)
            array = facet_paths(moved, propagation.reflected(group.bounces), group.owners, lights, group.ways)
            array = replace(array, propagation=propagation, meeting=group.meeting)
            for own, arrivals in zip(numbers, blocks, strict=True):
                together = [snap for snap in group.snaps if snap in own]
                arrivals.extend(
                    _direct(_where_heard(array, meeting), snap, ways)
                    for snap in together
                    if group.direct and snap not in heard_directly
                    for ways, meeting in times.heard(snap)
                )
                arrivals.extend(_echoes(array, together))
            heard_directly |= set(group.snaps if group.direct else ())
    speed = receiver.speed(context.medium)
    traced = [join(arrivals or [no_arrivals(array.legs)], speed, receiver.centre) for arrivals in blocks]
    return [of.but(snap=of.snap - start) if start else of for of, start in zip(traced, first, strict=False)]


def _where_heard(array: FacetPaths, meeting: Meeting) -> FacetPaths:
    """The array where it hears a snap itself."""
    context = replace(array.context, receiver=replace(array.context.receiver, pose=meeting.sonar.pose))
    return replace(array, context=context, meeting=meeting)


def _echoes(array: FacetPaths, snaps: Iterable[int]) -> list[Arrivals]:
    """Echoes and shadow waves of some snaps."""
    blocks, through, scattering = [], forward_paths(array), array.context.scattering
    for index in snaps:
        if not array.context.snaps[index].illuminates:
            continue
        blocks.append(echoes(array, index, tuple(surface.law.parts for surface in scattering), Kind.ECHO))
        if through is not None:
            shadows = tuple(shadow_parts(surface.law) if surface.mesh is not None else () for surface in scattering)
            blocks.append(echoes(through, index, shadows, Kind.FORWARD))
    return blocks


@dataclass(frozen=True)
class _DirectSound:
    """What sound that comes straight from a snap depends on, but for bodies: equal where all of that is."""

    what: tuple[Hashable, ...]
    context: FrameContext = field(compare=False)
    propagation: Propagation = field(compare=False)
    meeting: Meeting | None = field(compare=False)
    index: int
    ways: tuple[int, ...] | None

    @staticmethod
    def of(array: FacetPaths, index: int, ways: tuple[int, ...] | None) -> _DirectSound:
        """Emission `index` to array, by some families (None: all)."""
        context, heard, snap = array.context, array.meeting, array.context.snaps[index]
        water, receiver = context.medium, context.receiver
        described = water.environment, water.profile, water.absorption, receiver.sonar, receiver.elements
        arrays = snap.position, snap.velocity, receiver.pose.position, receiver.pose.orientation
        at = None if heard is None else heard.arrival_time if heard.sonar.still else id(heard)
        same = *map(id, (*described, snap.directivity)), array.propagation, snap.time, at
        what = *same, *(array.tobytes() for array in arrays)
        return _DirectSound(what, context, array.propagation, heard, index, ways)


def _direct(array: FacetPaths, index: int, ways: tuple[int, ...] | None = None) -> Arrivals:
    """Emission `index` to array, by some families (None: all), where no body stands in between that sound does not
    pass."""
    same = _DirectSound.of(array, index, ways)
    rays, direct = direct_sound(same)
    view = array.view(blocking_bodies(array.context, array.context.snaps[index].position))
    legs = view.visible(rays, Starts(rays.point))
    legs = view.settled(legs, Starts(legs.point))
    if len(legs.row) < len(rays.row) or legs.occluded.any():
        return _heard(same, legs)
    return direct.but(occluded=np.zeros((len(direct.delay), legs.occluded.shape[1]), np.uint8))


@lru_cache(maxsize=4)
def direct_sound(of: _DirectSound) -> tuple[ReceivePaths, Arrivals]:
    """Rays from a snap to the array centre, and what is heard of them where there are no bodies: that of the last
    frame, where the sonar and the snap are where they were."""
    receiver, snap = of.context.receiver, of.context.snaps[of.index]
    chosen = usable if of.ways is None else partial(_by_families, of.ways)
    ends, own_images = (of.context.medium, receiver), of.propagation.bounces > 0
    rays = rays_to_centre(snap.position[None, :], *ends, of.propagation, chosen, own_images)
    rays = rays.select(picked(directed(snap, rays.departure)[0] * rays.spreading != 0.0))
    return rays, _heard(of, rays)


def _by_families(families: tuple[int, ...], paths: Paths) -> Bools:
    """Which paths (path,) are by some families."""
    return np.asarray(np.isin(family(paths.surface, paths.bottom, paths.departure[:, 2] < 0.0), families))


def _heard(of: _DirectSound, legs: ReceivePaths) -> Arrivals:
    """What is heard of a snap by some legs from it."""
    context, meeting, index = of.context, of.meeting, of.index
    medium, receiver, snap = context.medium, context.receiver, context.snaps[index]
    bent = bending(medium, of.propagation, receiver)
    over = aperture_paths(legs, np.zeros(len(legs.row), int), bent, receiver, of.propagation)
    rows = np.arange(len(legs.row))
    gain, fronts = over.gain(rows), over.expansion
    if snap.directivity is not None:  # seen from the source, hydrophones are in other directions than the centre
        gain = gain * (snap.directivity(over.departure(rows)) / snap.directivity(legs.departure)[:, None])
    elif not snap.velocity[2]:  # up and down from the bottom it sounds alike
        legs, fronts, gain = with_coincident_added(legs, fronts, gain, receiver)
    count = len(legs.row)
    one, none, none_out = np.ones(count), np.full(count, NO_TARGET), TransmitPaths.none(count)
    amplitude, error = fitted(receiver, gain, legs.spreading * legs.boundary)
    met = MotionTerms.direct(count, snap)
    legs = legs if meeting is None else received(legs, met, meeting, medium, receiver.centre)
    loud, turned = directed(snap, legs.departure)
    legs = legs.but(spreading=legs.spreading * loud, phase=legs.phase + turned)
    ends = depth(legs.point), depth(receiver.pose.position)
    loss = medium.absorbed(legs.length, *ends, legs.departure[:, 2], legs.bounces)
    direct = assemble(
        legs, fronts.but(amplitude=amplitude), none_out, index, snap.time, loss,
        kind=Kind.DIRECT, target=none, facet=none, scattering=one, pulses=PulseResponse.plain(count),
        amplitude_error=error,
    )  # fmt: skip
    if meeting is None:
        return direct
    return apply_doppler(direct, legs, none_out, met, meeting, medium.profile, receiver.elements)
