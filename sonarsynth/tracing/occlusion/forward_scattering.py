"""Sound that passes a body which scatters it forward: legs of the wave that makes the shadow.

Behind such a body the direct wave is left as it is, and the shadow wave of the facets that the snap lights cancels it
(Babinet); beyond, both are the forward lobe. Ways to the facets and legs from them are those of all families, so that
what reaches the array by surface or bottom, before or after the body, is cancelled as well. The shadow wave goes
through the body that sends it, and through all others that scatter forward: one that stands in the shadow of another is
lit by none of the sound that the first takes away. Bodies that block hide its facets from the array as they hide the
snap.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.casting.surface_distances import enclosed
from sonarsynth.conventions import Floats
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.scattering import Component, FacetLaw
from sonarsynth.scattering.components import Shadow
from sonarsynth.state import FrameContext
from sonarsynth.tracing.expansion.aperture_paths import expansion_source
from sonarsynth.tracing.receive_paths import Starts, facets_of, rays_to_centre

if TYPE_CHECKING:
    from sonarsynth.tracing.facet_paths import FacetPaths


def shadow_parts(law: FacetLaw) -> tuple[Component, ...]:
    """What facets send beside echoes; nothing unless the law scatters forward."""
    return (Shadow(),) if law.passes_sound else ()


def blocking_bodies(context: FrameContext, source: Floats | None = None) -> tuple[PlacedTarget, ...]:
    """The bodies that sound does not pass on its way to the array, with any that its source (xyz) is inside of."""
    return tuple(
        body
        for body, law in zip(context.bodies, context.laws, strict=True)
        if not shadow_parts(law) or (source is not None and enclosed(body, source[None])[0])
    )


def forward_paths(array: FacetPaths) -> FacetPaths | None:
    """Facet to array, for every facet of the bodies that scatter forward, seen or not; None where there is none."""
    context, propagation = array.context, array.propagation
    laws, receiver = context.laws, context.receiver
    solid = blocking_bodies(context)
    if len(solid) == len(context.bodies):
        return None
    of_bodies = context.scattering[: len(laws)]
    every = facets_of(of_bodies, slice(0, sum(map(len, of_bodies))))
    owners = range(len(laws)) if array.owners is None else array.owners
    scatters = np.array([bool(shadow_parts(law)) and number in owners for number, law in enumerate(laws)])
    every = every.select(scatters[every.owner])
    legs = rays_to_centre(every.point, context.medium, receiver, propagation)
    view = array.view(solid)
    legs = view.visible(legs, Starts(every.clear[legs.row]))
    legs = view.settled(legs, Starts(every.clear[legs.row]))
    reached, row = np.unique(legs.row, return_inverse=True)
    legs, facets = legs.but(row=row), every.select(reached)
    over = expansion_source(legs, facets.owner[legs.row], array.bending, receiver, propagation)
    return replace(array, legs=legs, wavefronts=over, facets=facets, lit=False)
