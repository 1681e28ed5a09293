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
    verdicts = np.full(len(apex), EMPTY)
    for body in bodies:
        open_cones = np.flatnonzero(verdicts != CLOSED)
        if not len(body.mesh.faces) or not len(open_cones):
            continue
        mesh = casting_mesh(body.mesh)
        start = (body.pose.to_body(apex[open_cones]) - mesh.centre) / mesh.size
        verdict = np.empty(len(open_cones), np.int64)
        tree, towards = mesh.tree, np.ascontiguousarray(body.pose.turn_to_body(axis[open_cones]))
        limits = slope[open_cones], reach[open_cones] / mesh.size, far[open_cones] / mesh.size
        cone_kernels.look(start, towards, *limits, *tree, mesh.vertices, mesh.faces, *mesh.around, verdict)
        verdicts[open_cones] = np.where(verdict == CLOSED, CLOSED, np.maximum(verdicts[open_cones], verdict))
    return verdicts
