"""Facets as laws of scattering see them, and the pulses that they send back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sonarsynth.columns import Columns, alike
from sonarsynth.conventions import Bools, Floats
from sonarsynth.description.byte_bounded_cache import byte_bounded_cache
from sonarsynth.geometry.curvature import curvature_radius
from sonarsynth.geometry.mesh import Mesh
from sonarsynth.randomness import stream


@dataclass(frozen=True, eq=False)
class FacetGeometry(Columns):
    """Facets, one a path, in the frame of their body; the directions that go with them are in that frame too."""

    normal: Floats  # (..., xyz)
    area: Floats  # (...) m2
    curved: Bools  # (...) whether the surface is curved there, rather than a plane with its neighbours
    corners: Floats  # (..., 3, xyz) m from the middle of the facet
    spot: Floats  # (..., xyz) m from the middle: a point of the facet drawn once

    def over(self) -> FacetGeometry:
        """With an axis after the first, for the directions in which each facet is seen."""
        return FacetGeometry(**{name: value[:, None] for name, value in vars(self).items()})


@byte_bounded_cache(32)
def patches(mesh: Mesh, with_corners: bool = True) -> FacetGeometry:
    """All facets (facet, ...) of a mesh. What is drawn is the same for every mesh of this content.

    Without corners: for laws that need only normals and areas, the rest is 0.
    """
    count = len(mesh.faces)
    if not with_corners:
        none = np.zeros((1, 3, 3))
        corners, spot = np.broadcast_to(none, (count, 3, 3)), np.broadcast_to(none[0, 0], (count, 3))
        zero = np.broadcast_to(none[0, 0, 0], count)
        return FacetGeometry(mesh.normal, mesh.area, zero.astype(bool), corners, spot)
    corners = mesh.corners - mesh.centroid[:, None, :]
    share = stream(0, "spot", mesh.digest).dirichlet(np.ones(3), count)  # even over the triangle
    spot = np.einsum("fc,fcx->fx", share, corners)
    return FacetGeometry(mesh.normal, mesh.area, np.isfinite(curvature_radius(mesh)), corners, spot)


@dataclass(frozen=True, eq=False)
class PulseResponse(Columns):
    """What facets do to a pulse beside its amplitude, a row a path; columns as in `products.Arrivals`."""

    coherent: Bools  # (path,)
    corner_delays: Floats  # (path, 3) s
    coherent_fraction: Floats  # (path,)
    height_delay_std: Floats  # (path,) s
    late: Floats  # (path,) s: from the middle of the facet to the point that echoes
    phase: Floats  # (path,) rad: of the reflection coefficient
    delay_std: Floats  # (path,) s: what roughness takes from a coherent echo

    @staticmethod
    def plain(count: int) -> PulseResponse:
        """Nothing at all: the pulse is repeated."""
        zero, corners = alike(0.0, count), alike(np.zeros(3), count)
        return PulseResponse(alike(False, count), corners, zero, zero, zero, zero, zero)

    @staticmethod
    def join(responses: list[PulseResponse]) -> PulseResponse:
        """Rows of all, in order."""
        if len(responses) == 1:
            return responses[0]
        columns = zip(*(vars(response).values() for response in responses), strict=True)
        return PulseResponse(*(np.concatenate(column) for column in columns))
