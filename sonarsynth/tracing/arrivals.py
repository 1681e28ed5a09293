"""Every path of a frame: snap to array, and snap to facet to array, each by every family that is asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import NO_TARGET, Ints, depth
from sonarsynth.environment.absorption import DepthAbsorption
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import Body
from sonarsynth.products import Arrivals
from sonarsynth.receiver import Elements
from sonarsynth.scattering import ScatteringLaw
from sonarsynth.scattering.facet_geometry import Pulses
from sonarsynth.state import Moment, Snap
from sonarsynth.tracing.doppler import Carried, Meeting, received, stretched
from sonarsynth.tracing.echoes import echoes
from sonarsynth.tracing.expansion.amplitude_polynomials import ALIKE, ENOUGH, fitted
from sonarsynth.tracing.expansion.array_expansion import Fronts, Wavefronts, fronts, wavefronts
from sonarsynth.tracing.meetings import SHARED, hearing_times, occasions
from sonarsynth.tracing.occlusion.forward_scattering import forward_legs, opaque, shadow_parts
from sonarsynth.tracing.occlusion.sensor_occlusion import View
from sonarsynth.tracing.path_absorption import path_loss
from sonarsynth.tracing.receive_paths import (
    Facets,
    Legs,
    facets_of,
    legs_from,
    may_face,
    one_of,
    rays_to_centre,
    require_in_water,
)
from sonarsynth.tracing.transmit_paths import Outward, assemble, by_target, join, silence

if TYPE_CHECKING:
    from sonarsynth.propagation import Propagation, Visibility


NEGLIGIBLE = 1e-7
"""The faintest echoes of a snap from each target are left out, so many that their powers together stay below this part
of the power of all from there (70 dB); each counts with the largest amplitude that it has anywhere on the array. Of
coherent ones, which add by amplitude, so many that their amplitudes together stay below the root of this part of that
of the largest."""


@dataclass(frozen=True, eq=False)
class ArrayLegs:
    """Every facet that the array sees, with its legs to the array: serves any snap without tracing this side again."""

    legs: Legs  # (leg,) sorted by row
    wavefronts: Wavefronts  # of all legs, those of other parts among them
    facets: Facets  # (facet,) that have a leg; legs.row counts them
    bodies: tuple[Body, ...]
    environment: Environment
    profile: Profile
    propagation: Propagation
    sonar_pose: Pose
    elements: Elements
    band: tuple[float, float]  # Hz
    negligible: float = NEGLIGIBLE  # power of the faintest echoes, that are left out
    enough: float = ENOUGH  # error of amplitudes over the aperture, where the second degree will do
    alike: float = ALIKE  # change of an echo by the mean over its facet, over the aperture, that is left out
    visibility: Visibility = "centre"  # from where facets must be seen
    first: int = 0  # of the legs, in the wavefronts
    degree: int = 3  # of polynomials over the aperture
    targets: tuple[int, ...] | None = None  # of the facets; None: all
    meeting: Meeting | None = None  # when bodies and array are where they are here; None: nothing moves

    @property
    def fronts(self) -> Fronts:
        """(leg,) over the aperture: kept for all legs, made anew for some."""
        return self._whole if self.legs is self.wavefronts.legs else self._made()

    @cached_property
    def _whole(self) -> Fronts:
        return self._made()

    def _made(self) -> Fronts:
        return self.wavefronts.of(slice(self.first, self.first + len(self.legs.row)))

    def part(self, some: slice) -> ArrayLegs:
        """Some of the facets, and the legs from them."""
        if some == slice(0, len(self.facets.facet)):
            return self
        first, last = (int(n) for n in np.searchsorted(self.legs.row, (some.start, some.stop)))
        legs = self.legs.select(slice(first, last))
        legs, facets = legs.numbered(legs.row - some.start), self.facets.select(some)
        return replace(self, legs=legs, facets=facets, first=self.first + first)

    def view(self, bodies: tuple[Body, ...]) -> View:
        """Who looks, and which bodies stand in between."""
        lookout = self.elements if self.visibility == "hydrophones" else None
        return View(bodies, self.environment, self.bending, self.sonar_pose, lookout, self.propagation, self.degree)

    @property
    def bending(self) -> Profile:
        """What bends the rays: the profile, or for straight rays the speed at the array everywhere."""
        return bending(self.profile, self.propagation, self.sonar_pose)

    def settled(self, leg: Ints) -> Legs:
        """Some legs (row,), with the hydrophones that bodies hide them from."""
        number, row = np.unique(leg[self.legs.open[leg]], return_inverse=True)
        legs = self.legs.select(leg)
        if not len(number):
            return legs
        some = self.legs.select(number)
        side = self.facets.clear[some.row], self.facets.normal[some.row]
        some = self.view(self.bodies).settled(some, *side)
        hidden_from = legs.hidden_from.copy()
        hidden_from[legs.open] = some.hidden_from[row]
        return legs.seen(hidden_from, np.zeros(len(leg), bool))

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
    absorption: float | DepthAbsorption,
    propagation: Propagation,
    laws: tuple[ScatteringLaw, ...],
    *,
    band: tuple[float, float],
    moving: Track | None = None,
    shared: float = SHARED,
    negligible: float = NEGLIGIBLE,
    enough: float = ENOUGH,
    alike: float = ALIKE,
    visibility: Visibility = "centre",
    degree: int = 3,
) -> Arrivals:
    """The arrivals of a frame, sorted by snap; of each first those that met no target, then echoes by target, then the
    shadow waves of targets that scatter forward.

    environment, profile: the water; moment: bodies and snaps; sonar_pose, elements: the array; absorption: at the
    centre of the band, at every depth or the same (dB/m) at all; propagation: how sound travels, and how many bounces
    are followed; laws: how the facets of each body scatter; band: Hz; moving: the track of the array, where it and
    bodies move while sound is under way (left out: all is where it is at the instant of the frame); shared:
    `meetings.SHARED`; negligible: see `NEGLIGIBLE`; enough: `variation.ENOUGH`; alike: `variation.ALIKE`; degree: of
    polynomials over the aperture. A facet counts where it is lit by the snap and seen, with no body in between, by the
    array centre; or, with `visibility`, by some hydrophone that it faces, and is heard by those. The snap itself is
    heard if no body stands in between, but for those that scatter forward (`tracing.forward`). Raises ValueError for
    anything outside the water.
    """

    def legs_to(pose: Pose, bodies: tuple[Body, ...], targets: tuple[int, ...] | None = None) -> ArrayLegs:
        return array_legs(
            environment, profile, bodies, pose, elements, propagation, band, negligible, enough, alike, visibility,
            degree, targets,
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


def _hearing(array: ArrayLegs, snap: Snap, sonar: Track) -> ArrayLegs:
    """The array where it hears a snap itself."""
    speed = float(array.profile.at(depth(sonar.pose.position)))
    heard = float(hearing_times(snap.position, np.asarray(snap.time), sonar, speed))
    there = sonar.later(heard)
    return replace(array, sonar_pose=there.pose, meeting=Meeting(np.zeros(0), heard, there))


def array_legs(
    environment: Environment,
    profile: Profile,
    bodies: tuple[Body, ...],
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
    band: tuple[float, float],
    negligible: float = NEGLIGIBLE,
    enough: float = ENOUGH,
    alike: float = ALIKE,
    visibility: Visibility = "centre",
    degree: int = 3,
    targets: tuple[int, ...] | None = None,
) -> ArrayLegs:
    """Facet to array, for every facet of every body, or of some targets, that leaves a ray for the array that no body
    hides.

    Raises ValueError for a body or an array that reaches out of the water.
    """
    require_in_water(bodies, environment)
    bent, centre = bending(profile, propagation, sonar_pose), 0.5 * (band[0] + band[1])
    lookout = elements if visibility == "hydrophones" else None
    slack = elements.aperture if lookout is not None else 0.0
    view = View(bodies, environment, bent, sonar_pose, lookout, propagation, degree)
    found: tuple[list[Legs], list[Facets]] = [], []
    seen = 0
    for some in in_blocks(sum(len(body.mesh.faces) for body in bodies)):
        every = facets_of(bodies, some)
        if targets is not None and len(targets) < len(bodies):
            every = every.select(np.isin(every.target, targets))
        reached = may_face(every, sonar_pose.position, propagation.bounces, profile, environment.depth, slack)
        every = every.select(reached)
        part = legs_from(every, environment, profile, sonar_pose, propagation, centre, slack)
        side = every.clear[part.row], every.normal[part.row]
        part = view.visible(part, *side)
        kept, row = np.unique(part.row, return_inverse=True)
        found[0].append(part.numbered(seen + row))
        found[1].append(every.select(kept))
        seen += len(kept)
    legs, facets = one_of(found[0]), one_of(found[1])
    group = facets.target[legs.row]
    over = wavefronts(legs, group, environment, bent, sonar_pose, elements, propagation, band, degree)
    return ArrayLegs(
        legs, over, facets, bodies, environment, profile, propagation, sonar_pose, elements, band, negligible, enough,
        alike, visibility, degree=degree, targets=targets,
    )  # fmt: skip


def bending(profile: Profile, propagation: Propagation, sonar_pose: Pose) -> Profile:
    """What bends the rays of a model: the profile, or for straight rays the speed at the array everywhere."""
    if propagation.bends:
        return profile
    return Profile(profile.depth, np.full(len(profile.depth), float(profile.at(depth(sonar_pose.position)))))


def arrivals(
    array: ArrayLegs, snaps: tuple[Snap, ...], absorption: float | DepthAbsorption, laws: tuple[ScatteringLaw, ...]
) -> Arrivals:
    """As `trace`, of what is at rest, from legs that are traced already; shadows of targets have legs of their own."""
    numbered = dict(enumerate(snaps))
    parts = [((index, 0), _direct(array, index, snap, absorption, laws)) for index, snap in numbered.items()]
    parts += _echoes(array, numbered, absorption, laws)
    parts.sort(key=lambda part: part[0])
    heard = [silence(array.legs), *(part for _, part in parts)]
    parts.clear()
    return join(heard, float(array.profile.at(depth(array.sonar_pose.position))), array.centre)


def _echoes(
    array: ArrayLegs, snaps: dict[int, Snap], absorption: float | DepthAbsorption, laws: tuple[ScatteringLaw, ...]
) -> list[tuple[tuple[int, int], Arrivals]]:
    """Echoes (1) and shadow waves (2) of numbered snaps, each with the number of its snap."""
    parts, through = [], forward_legs(array, laws)
    for index, snap in snaps.items():
        law_parts = tuple(law.parts for law in laws)
        parts.append(((index, 1), echoes(array, index, snap, absorption, law_parts)))
        if through is not None:
            shadows = tuple(shadow_parts(law) for law in laws)
            parts.append(((index, 2), echoes(through, index, snap, absorption, shadows)))
    return parts


def _direct(
    array: ArrayLegs, index: int, snap: Snap, absorption: float | DepthAbsorption, laws: tuple[ScatteringLaw, ...]
) -> Arrivals:
    """Snap to array, where no body stands in between that sound does not pass."""
    environment, profile, sonar_pose = array.environment, array.profile, array.sonar_pose
    legs = rays_to_centre(environment, profile, snap.position[None, :], sonar_pose, array.propagation, array.centre)
    view = array.view(opaque(array.bodies, laws, snap.position))
    legs = view.visible(legs, legs.point, None)
    legs = view.settled(legs, legs.point, None)
    over = fronts(
        legs, np.zeros(len(legs.row), int), environment, array.bending, sonar_pose, array.elements, array.propagation,
        array.band, array.degree,
    )  # fmt: skip
    plain = Pulses.plain(len(legs.row))
    one, none = np.ones(len(legs.row)), np.full(len(legs.row), NO_TARGET)
    variation = fitted(array, over.gain(np.arange(len(legs.row))), legs.spreading)
    none_out, meeting, count = Outward.none(len(one)), array.meeting, len(one)
    rest = Carried.at_rest(count, snap.time)
    legs = legs if meeting is None else received(legs, rest, meeting, profile)
    loss = path_loss(array, absorption, snap, legs)
    made = assemble(legs, over.terms, none_out, index, snap.time, loss, none, none, one, variation, plain)
    if meeting is None:
        return made
    return stretched(made, legs, none_out, rest, meeting, profile, array.elements, None, array.enough)
