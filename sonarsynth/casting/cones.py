"""Narrow cones of rays among bodies: whether nothing stands in any ray of a cone, or something in all of them."""

from __future__ import annotations

import numpy as np

from sonarsynth.casting import cone_kernels
from sonarsynth.casting.ray_casting import casting_mesh
from sonarsynth.conventions import Floats, Ints
from sonarsynth.geometry.placed_target import PlacedTarget

EMPTY, CLOSED, UNKNOWN = range(3)
"""As `cone_kernels`."""


def classify_cones(
    bodies: tuple[PlacedTarget, ...], apex: Floats, axis: Floats, slope: Floats, reach: Floats, far: Floats
) -> Ints:
    """What is certain of cones (cone,) among bodies: EMPTY of them up to `reach` (m) along the axis, CLOSED by one of
    them nearer than `far` (m), or UNKNOWN.

    apex, axis: (cone, xyz) world, axes of unit length; slope (cone,): radius of the cone over the distance along it.
    Holds for any line that stays in the cone, bent or not, from its apex to where it ends.
    """
    found = np.full(len(apex), EMPTY)
    for body in bodies:
        left = np.flatnonzero(found != CLOSED)
        if not len(body.mesh.faces) or not len(left):
            continue
        mesh = casting_mesh(body.mesh)
        start = (body.pose.to_body(apex[left]) - mesh.centre) / mesh.size
        verdict = np.empty(len(left), np.int64)
        tree, towards = mesh.tree, np.ascontiguousarray(body.pose.turn_to_body(axis[left]))
        limits = slope[left], reach[left] / mesh.size, far[left] / mesh.size
        cone_kernels.look(start, towards, *limits, *tree, mesh.vertices, mesh.faces, *mesh.around, verdict)
        found[left] = np.where(verdict == CLOSED, CLOSED, np.maximum(found[left], verdict))
    return found
