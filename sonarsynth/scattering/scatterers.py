"""What scatters sound by one law: the facets of a body, or pieces of the bottom that belong to none."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.geometry.motion import Track
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.scattering.components import Component
from sonarsynth.scattering.facet_geometry import FacetGeometry, patches
from sonarsynth.scattering.facet_law import FacetLaw

BODY: Final = "target"
"""Owner of the facets of bodies."""
AT_REST: Final = Track(Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])), np.zeros(3))
"""Axes of the world."""


@dataclass(frozen=True)
class PointScatterer(FacetLaw):
    """Of scatterers without a normal, such as stones and bubbles: the same amplitude wherever they are seen from."""

    strength: float  # m: a target strength of 20 log10 of it
    kind: str = "point"

    def amplitude(
        self, incident: Floats, scattered: Floats, normal: Floats, area: Floats, beyond: bool = False
    ) -> Floats:
        """As `FacetLaw.amplitude`."""
        shape = np.broadcast_shapes(incident.shape[:-1], scattered.shape[:-1], area.shape)
        return np.full(shape, self.strength)


@dataclass(frozen=True, eq=False)
class Scatterers:
    """Surface elements, each lit and heard on the side of its normal, or all round where that is 0. Those without a
    body hide nothing.

    position    (element, xyz)  m    own frame
    normal      (element, xyz)  1    own frame
    area        (element,)      m2
    sign        (element,)      1    of the echo of each: -1 or 1; of a body, as its law says
    """

    owner: str  # "target", "bottom" or "surface"
    law: FacetLaw
    position: Floats
    normal: Floats
    area: Floats
    sign: Floats | None = None
    track: Track = AT_REST  # of the frame that they are in
    mesh: Mesh | None = None  # whose facets they are

    @staticmethod
    def of_body(body: PlacedTarget, law: FacetLaw) -> Scatterers:
        """The facets of a body."""
        mesh = body.mesh
        return Scatterers(BODY, law, mesh.centroid, mesh.normal, mesh.area, track=body.track, mesh=mesh)

    def __len__(self) -> int:
        return len(self.area)

    @property
    def pose(self) -> Pose:
        """Of the frame that they are in."""
        return self.track.pose

    @cached_property
    def middle(self) -> Floats:
        """(xyz) m, own frame: of the box round them."""
        if self.mesh is not None:
            return np.asarray(0.5 * np.sum(self.mesh.box, axis=0))
        return np.asarray(0.5 * (self.position.min(axis=0) + self.position.max(axis=0)))

    @property
    def radius(self) -> float:
        """m: of a body, as of its mesh; else from the middle to the farthest element."""
        if self.mesh is not None:
            return self.mesh.radius
        return float(np.linalg.norm(self.position - self.middle, axis=1).max(initial=0.0))

    @property
    def offset(self) -> float:
        """m: size of the body that they lie on; 0 of those that hide nothing."""
        return 0.0 if self.mesh is None else self.mesh.radius

    def later(self, seconds: float) -> Scatterers:
        """Where they will be, or were, so many seconds (s) after."""
        return self if self.track.still else replace(self, track=self.track.later(seconds))

    def geometry(self, with_corners: bool) -> FacetGeometry:
        """As laws see all of them (element, ...); without corners: normals and areas alone."""
        if self.mesh is not None:
            return patches(self.mesh, with_corners)
        count = len(self)
        flat, none = np.zeros(count, bool), np.broadcast_to(0.0, (count, 3, 3))
        return FacetGeometry(self.normal, self.area, flat, none, none[:, 0])

    def polarity(self, component: Component) -> Floats:
        """Sign (element,) of the echo of each by a component of the law."""
        if self.mesh is not None:
            return component.polarity(self.mesh)
        return np.ones(len(self)) if self.sign is None else self.sign
