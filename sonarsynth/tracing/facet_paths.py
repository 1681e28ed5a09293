"""Paths from every facet that the array sees to the array: the half of echoes that does not depend on the snap."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Ints, depth
from sonarsynth.environment.sea import Environment, Profile
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.receiver import Elements
from sonarsynth.tracing.doppler import Meeting
from sonarsynth.tracing.expansion.array_expansion import ArrayExpansion, ExpansionSource, expansion_source
from sonarsynth.tracing.occlusion.sensor_occlusion import Occlusion
from sonarsynth.tracing.receive_paths import (
    Facets,
    ReceivePaths,
    concatenate,
    facets_of,
    may_face_receiver,
    receive_paths,
    require_in_water,
)

if TYPE_CHECKING:
    from sonarsynth.propagation import OcclusionPoint, Propagation


FACET_MEAN_TOLERANCE = 1e-3
"""Change of an echo over the aperture by the mean over its facet, over the strongest echo, that is left out."""


QUADRATIC_TOLERANCE = 1e-4
"""Error of amplitudes over the aperture, of the strongest echo's, at which polynomials of the second degree will do."""


NEGLIGIBLE = 1e-7
"""The faintest echoes of a snap from each target are left out, so many that their powers together stay below this part
of the power of all from there (70 dB); each counts with the largest amplitude that it has anywhere on the array. Of
coherent ones, which add by amplitude, so many that their amplitudes together stay below the root of this part of that
of the largest."""


@dataclass(frozen=True, eq=False)
class FacetPaths:
    """Every facet that the array sees, with its legs to the array: serves any snap without tracing this side again."""

    legs: ReceivePaths  # (leg,) sorted by row
    wavefronts: ExpansionSource  # of all legs, those of other parts among them
    facets: Facets  # (facet,) that have a leg; legs.row counts them
    bodies: tuple[PlacedTarget, ...]
    environment: Environment
    profile: Profile
    propagation: Propagation
    sonar_pose: Pose
    elements: Elements
    band: tuple[float, float]  # Hz
    negligible: float = NEGLIGIBLE  # power of the faintest echoes, that are left out
    enough: float = QUADRATIC_TOLERANCE  # error of amplitudes over the aperture, where the second degree will do
    alike: float = (
        FACET_MEAN_TOLERANCE  # change of an echo by the mean over its facet, over the aperture, that is left out
    )
    occlusion: OcclusionPoint = "centre"  # from where facets must be seen
    first: int = 0  # of the legs, in the wavefronts
    degree: int = 3  # of polynomials over the aperture
    targets: tuple[int, ...] | None = None  # of the facets; None: all
    meeting: Meeting | None = None  # when bodies and array are where they are here; None: nothing moves

    @property
    def fronts(self) -> ArrayExpansion:
        """(leg,) over the aperture: kept for all legs, made anew for some."""
        return self._whole if self.legs is self.wavefronts.legs else self._made()

    @cached_property
    def _whole(self) -> ArrayExpansion:
        return self._made()

    def _made(self) -> ArrayExpansion:
        return self.wavefronts.of(slice(self.first, self.first + len(self.legs.row)))

    def part(self, some: slice) -> FacetPaths:
        """Some of the facets, and the legs from them."""
        if some == slice(0, len(self.facets.facet)):
            return self
        first, last = (int(n) for n in np.searchsorted(self.legs.row, (some.start, some.stop)))
        legs = self.legs.select(slice(first, last))
        legs, facets = legs.numbered(legs.row - some.start), self.facets.select(some)
        return replace(self, legs=legs, facets=facets, first=self.first + first)

    def view(self, bodies: tuple[PlacedTarget, ...]) -> Occlusion:
        """Who looks, and which bodies stand in between."""
        lookout = self.elements if self.occlusion == "sensors" else None
        return Occlusion(
            bodies, self.environment, self.bending, self.sonar_pose, lookout, self.propagation, self.degree
        )

    @property
    def bending(self) -> Profile:
        """What bends the rays: the profile, or for straight rays the speed at the array everywhere."""
        return bending(self.profile, self.propagation, self.sonar_pose)

    def settled(self, leg: Ints) -> ReceivePaths:
        """Some legs (row,), with the hydrophones that bodies hide them from."""
        number, row = np.unique(leg[self.legs.open[leg]], return_inverse=True)
        legs = self.legs.select(leg)
        if not len(number):
            return legs
        some = self.legs.select(number)
        side = self.facets.clear[some.row], self.facets.normal[some.row]
        some = self.view(self.bodies).settled(some, *side)
        occluded = legs.occluded.copy()
        occluded[legs.open] = some.occluded[row]
        return legs.seen(occluded, np.zeros(len(leg), bool))

    @property
    def centre(self) -> float:
        """Hz: centre of the band."""
        return 0.5 * (self.band[0] + self.band[1])


def facet_paths(
    environment: Environment,
    profile: Profile,
    bodies: tuple[PlacedTarget, ...],
    sonar_pose: Pose,
    elements: Elements,
    propagation: Propagation,
    band: tuple[float, float],
    *,
    negligible: float = NEGLIGIBLE,
    enough: float = QUADRATIC_TOLERANCE,
    alike: float = FACET_MEAN_TOLERANCE,
    occlusion: OcclusionPoint = "centre",
    degree: int = 3,
    targets: tuple[int, ...] | None = None,
) -> FacetPaths:
    """Facet to array, for every facet of every body, or of some targets, that leaves a ray for the array that no body
    hides.

    Raises ValueError for a body or an array that reaches out of the water.
    """
    require_in_water(bodies, environment)
    bent, centre = bending(profile, propagation, sonar_pose), 0.5 * (band[0] + band[1])
    lookout = elements if occlusion == "sensors" else None
    slack = elements.aperture if lookout is not None else 0.0
    view = Occlusion(bodies, environment, bent, sonar_pose, lookout, propagation, degree)
    found: tuple[list[ReceivePaths], list[Facets]] = [], []
    seen = 0
    for some in in_blocks(sum(len(body.mesh.faces) for body in bodies)):
        every = facets_of(bodies, some)
        if targets is not None and len(targets) < len(bodies):
            every = every.select(np.isin(every.target, targets))
        if propagation.layered:
            place = sonar_pose.position
            every = every.select(
                may_face_receiver(every, place, propagation.bounces, profile, environment.depth, slack)
            )
        part = receive_paths(every, environment, profile, sonar_pose, propagation, centre, slack)
        side = every.clear[part.row], every.normal[part.row]
        part = view.visible(part, *side)
        kept, row = np.unique(part.row, return_inverse=True)
        found[0].append(part.numbered(seen + row))
        found[1].append(every.select(kept))
        seen += len(kept)
    legs, facets = concatenate(found[0]), concatenate(found[1])
    group = facets.target[legs.row]
    over = expansion_source(
        legs, group, environment, bent, sonar_pose, elements, propagation=propagation, band=band, degree=degree
    )
    return FacetPaths(
        legs, over, facets, bodies, environment, profile, propagation, sonar_pose, elements, band, negligible, enough,
        alike, occlusion, degree=degree, targets=targets,
    )  # fmt: skip


def bending(profile: Profile, propagation: Propagation, sonar_pose: Pose) -> Profile:
    """What bends the rays of a model: the profile, or for straight rays the speed at the array everywhere."""
    if propagation.bends:
        return profile
    return Profile(profile.depth, np.full(len(profile.depth), float(profile.at(depth(sonar_pose.position)))))
