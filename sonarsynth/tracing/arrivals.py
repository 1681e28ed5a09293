"""Every path of a frame: snap to array, and snap to facet to array, each by every family that is asked for."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, depth
from sonarsynth.environment.absorption import DepthAbsorption
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.products import Arrivals
from sonarsynth.receiver import Elements
from sonarsynth.scattering import FacetLaw
from sonarsynth.scattering.facet_geometry import PulseResponse
from sonarsynth.state import Snap, WorldState
from sonarsynth.tracing.doppler import Meeting, MetPaths, apply_doppler, received
from sonarsynth.tracing.echoes import echoes
from sonarsynth.tracing.expansion.amplitude_polynomials import fitted
from sonarsynth.tracing.expansion.array_expansion import array_expansion
from sonarsynth.tracing.facet_paths import (
    FACET_MEAN_TOLERANCE,
    NEGLIGIBLE,
    QUADRATIC_TOLERANCE,
    FacetPaths,
    facet_paths,
)
from sonarsynth.tracing.meetings import SHARED, hearing_times, occasions
from sonarsynth.tracing.occlusion.forward_scattering import blocking_bodies, forward_paths, shadow_parts
from sonarsynth.tracing.path_absorption import path_loss
from sonarsynth.tracing.receive_paths import rays_to_centre
from sonarsynth.tracing.transmit_paths import TransmitPaths, assemble, by_target, join, no_arrivals

if TYPE_CHECKING:
    from sonarsynth.propagation import OcclusionPoint, Propagation


def trace(
    environment: Environment,
    profile: Profile,
    moment: WorldState,
    sonar_pose: Pose,
    elements: Elements,
    absorption: float | DepthAbsorption,
    propagation: Propagation,
    laws: tuple[FacetLaw, ...],
    *,
    band: tuple[float, float],
    moving: Track | None = None,
    shared: float = SHARED,
    negligible: float = NEGLIGIBLE,
    enough: float = QUADRATIC_TOLERANCE,
    alike: float = FACET_MEAN_TOLERANCE,
    occlusion: OcclusionPoint = "centre",
    degree: int = 3,
) -> Arrivals:
    """The arrivals of a frame, sorted by snap; of each first those that met no target, then echoes by target, then the
    shadow waves of targets that scatter forward.

    environment, profile: the water; moment: bodies and snaps; sonar_pose, elements: the array; absorption: at the
    centre of the band, at every depth or the same (dB/m) at all; propagation: how sound travels, and how many bounces
    are followed; laws: how the facets of each body scatter; band: Hz; moving: the track of the array, where it and
    bodies move while sound is under way (left out: all is where it is at the instant of the frame); shared:
    `meetings.SHARED`; negligible: see `NEGLIGIBLE`; enough: `facet_paths.QUADRATIC_TOLERANCE`; alike:
    `facet_paths.FACET_MEAN_TOLERANCE`; degree: of polynomials over the aperture. A facet counts where it is lit by the
    snap and seen, with no body in between, by the array centre; or, with `occlusion`, by some hydrophone that it
    faces, and is heard by those. The snap itself is heard if no body stands in between, but for those that scatter
    forward (`tracing.occlusion.forward_scattering`). Raises ValueError for anything outside the water.
    """

    def legs_to(pose: Pose, bodies: tuple[PlacedTarget, ...], targets: tuple[int, ...] | None = None) -> FacetPaths:
        return facet_paths(
            environment, profile, bodies, pose, elements, propagation, band,
            negligible=negligible, enough=enough, alike=alike, occlusion=occlusion, degree=degree, targets=targets,
        )  # fmt: skip

    if moving is None or (moving.still and all(body.track.still for body in moment.bodies)) or not moment.snaps:
        return arrivals(legs_to(sonar_pose, moment.bodies), moment.snaps, absorption, laws)
    parts: list[tuple[tuple[int, int], Arrivals]] = []
    met = occasions(
        moment.bodies, moment.snaps, moving, profile, highest=band[1], aperture=elements.aperture, shared=shared
    )
    begun = set[int]()
    for some in met:
        array = replace(legs_to(some.meeting.sonar.pose, some.bodies, some.targets), meeting=some.meeting)
        snaps = {index: moment.snaps[index] for index in some.snaps}
        for index in snaps.keys() - begun:
            parts.append(
                ((index, 0), _direct(_hearing(array, snaps[index], moving), index, snaps[index], absorption, laws))
            )
        parts += _echoes(array, snaps, absorption, laws)
        begun |= snaps.keys()
    return by_target(parts, float(profile.at(depth(sonar_pose.position))), 0.5 * (band[0] + band[1]))


def _hearing(array: FacetPaths, snap: Snap, sonar: Track) -> FacetPaths:
    """The array where it hears a snap itself."""
    speed = float(array.profile.at(depth(sonar.pose.position)))
    heard = float(hearing_times(snap.position, np.asarray(snap.time), sonar, speed))
    there = sonar.later(heard)
    return replace(array, sonar_pose=there.pose, meeting=Meeting(np.zeros(0), heard, there))


def arrivals(
    array: FacetPaths, snaps: tuple[Snap, ...], absorption: float | DepthAbsorption, laws: tuple[FacetLaw, ...]
) -> Arrivals:
    """As `trace`, of what is at rest, from legs that are traced already; shadows of targets have legs of their own."""
    numbered = dict(enumerate(snaps))
    parts = [((index, 0), _direct(array, index, snap, absorption, laws)) for index, snap in numbered.items()]
    parts += _echoes(array, numbered, absorption, laws)
    parts.sort(key=lambda part: part[0])
    heard = [no_arrivals(array.legs), *(part for _, part in parts)]
    parts.clear()
    return join(heard, float(array.profile.at(depth(array.sonar_pose.position))), array.centre)


def _echoes(
    array: FacetPaths, snaps: dict[int, Snap], absorption: float | DepthAbsorption, laws: tuple[FacetLaw, ...]
) -> list[tuple[tuple[int, int], Arrivals]]:
    """Echoes (1) and shadow waves (2) of numbered snaps, each with the number of its snap."""
    parts, through = [], forward_paths(array, laws)
    for index, snap in snaps.items():
        law_parts = tuple(law.parts for law in laws)
        parts.append(((index, 1), echoes(array, index, snap, absorption, law_parts)))
        if through is not None:
            shadows = tuple(shadow_parts(law) for law in laws)
            parts.append(((index, 2), echoes(through, index, snap, absorption, shadows)))
    return parts


def _direct(
    array: FacetPaths, index: int, snap: Snap, absorption: float | DepthAbsorption, laws: tuple[FacetLaw, ...]
) -> Arrivals:
    """Snap to array, where no body stands in between that sound does not pass."""
    environment, profile, sonar_pose = array.environment, array.profile, array.sonar_pose
    legs = rays_to_centre(environment, profile, snap.position[None, :], sonar_pose, array.propagation, array.centre)
    view = array.view(blocking_bodies(array.bodies, laws, snap.position))
    legs = view.visible(legs, legs.point, None)
    legs = view.settled(legs, legs.point, None)
    over = array_expansion(
        legs, np.zeros(len(legs.row), int), environment, array.bending, sonar_pose, array.elements,
        propagation=array.propagation, band=array.band, degree=array.degree,
    )  # fmt: skip
    plain = PulseResponse.plain(len(legs.row))
    one, none = np.ones(len(legs.row)), np.full(len(legs.row), NO_TARGET)
    variation = fitted(array, over.gain(np.arange(len(legs.row))), legs.spreading)
    none_out, meeting, count = TransmitPaths.none(len(one)), array.meeting, len(one)
    rest = MetPaths.at_rest(count, snap.time)
    legs = legs if meeting is None else received(legs, rest, meeting, profile)
    loss = path_loss(array, absorption, snap, legs)
    made = assemble(
        legs,
        over.terms,
        none_out,
        index,
        snap.time,
        loss,
        target=none,
        facet=none,
        scattering=one,
        variation=variation,
        pulses=plain,
    )
    if meeting is None:
        return made
    return apply_doppler(
        made, legs, none_out, rest, meeting, profile, elements=array.elements, departure=None, enough=array.enough
    )
