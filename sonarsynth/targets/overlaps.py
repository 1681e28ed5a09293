"""Whether two bodies take the same place."""

from __future__ import annotations

from typing import Final

import numpy as np

from sonarsynth.casting.ray_casting import first_hit, occluded
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh, in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget

INSET: Final = 1e-5
"""Of the smaller body: how far under its surface it is looked at, so that bodies that touch do not overlap."""
SHRUNK: Final = 1e-4
"""Of a facet: how much smaller it is looked at, so that its corners are under the surface too."""
MOST: Final = 4096
"""Facets of each by which it is found how they overlap."""


def overlap(a: PlacedTarget, b: PlacedTarget) -> str | None:
    """How two closed bodies overlap, as a verb, or None where they are apart or only touch.

    "coincide", "overlap", or "overlap (the second is inside the first)" and the like. Facets are taken a little under
    the surface: bodies overlap where one such is inside the other body, or where one crosses its surface.
    """
    if not (len(a.mesh.faces) and len(b.mesh.faces)):
        return None
    (c, r), (d, s) = sphere_round(a), sphere_round(b)
    if np.linalg.norm(c - d) >= r + s:
        return None
    inset = INSET * min(r, s)
    near = _near(a, b, inset), _near(b, a, inset)
    within = _within(a, near[0], b, inset), _within(b, near[1], a, inset)
    every = [len(n) == len(body.mesh.faces) and w.all() for n, w, body in zip(near, within, (a, b), strict=True)]
    if all(every):
        return "coincide"
    if any(every):
        return f"overlap (the {'first' if every[0] else 'second'} is inside the {'second' if every[0] else 'first'})"
    if any(w.any() for w in within) or _crosses(a, near[0], b, inset) or _crosses(b, near[1], a, inset):
        return "overlap"
    return None


def sphere_round(body: PlacedTarget) -> tuple[Floats, float]:
    """Centre (xyz) in the world and radius (m) of the sphere round a body's box."""
    low, high = body.mesh.box
    return body.pose.to_world(0.5 * (low + high)), 0.5 * float(np.linalg.norm(high - low))


def _near(body: PlacedTarget, other: PlacedTarget, inset: float) -> Ints:
    """Facets of a body whose boxes, in the frame of the other body, meet the box round it."""
    vertices = other.pose.to_body(body.pose.to_world(body.mesh.vertices))
    low, high = other.mesh.box
    facets = []
    for block in in_blocks(len(body.mesh.faces)):
        corners = vertices[body.mesh.faces[block]]
        apart = (corners.min(axis=1) > high + inset) | (corners.max(axis=1) < low - inset)
        facets.append(np.flatnonzero(~apart.any(axis=1)) + block.start)
    return np.concatenate(facets)


def _corners(body: PlacedTarget, facets: Ints, inset: float) -> Floats:
    """Corners (facet, 3, xyz) of facets in the world, a little under the surface."""
    mesh = body.mesh
    middle = mesh.centroid[facets][:, None, :]
    corners = middle + (1.0 - SHRUNK) * (mesh.corners_of(facets) - middle) - inset * mesh.normal[facets][:, None, :]
    return body.pose.to_world(corners.reshape(-1, 3)).reshape(-1, 3, 3)


def _within(body: PlacedTarget, facets: Ints, other: PlacedTarget, inset: float) -> Bools:
    """Which of facets, `MOST` of them at most, have their middles inside another body."""
    sampled = facets[:: max(-(-len(facets) // MOST), 1)]
    return insides(other.mesh, other.pose, _corners(body, sampled, inset).mean(axis=1))


def insides(mesh: Mesh, pose: Pose, points: Floats) -> Bools:
    """Which points (point, xyz) of the world are inside a closed mesh: the facet above shows its inner side."""
    up = np.array([1e-3, 2e-3, 1.0])  # off the edges of boxes
    facet, _ = first_hit(mesh, pose.to_body(points), np.broadcast_to(up, points.shape))
    return np.asarray((facet >= 0) & (mesh.normal[facet] @ up > 0.0))


def _crosses(body: PlacedTarget, facets: Ints, other: PlacedTarget, inset: float) -> bool:
    """Whether any edge of facets goes through the surface of another body."""
    for block in in_blocks(len(facets)):
        corners = _corners(body, facets[block], inset)
        if occluded((other,), corners.reshape(-1, 3), np.roll(corners, 1, axis=1).reshape(-1, 3)).any():
            return True
    return False
