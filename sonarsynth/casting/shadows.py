"""Many points looked at from each of many places: which of them bodies hide."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sonarsynth.casting import facet_tree
from sonarsynth.casting.ray_casting import casting_mesh, enclosing
from sonarsynth.conventions import Bools, Floats
from sonarsynth.geometry.placed_target import PlacedTarget

NEIGHBOURS = 2048
"""Rays that follow each other, mostly from places near each other, for which bodies are taken in one order."""


def nearest_first(bodies: tuple[PlacedTarget, ...], start: Floats) -> Iterator[tuple[slice, int]]:
    """Parts of the rows that start at places (row, xyz) of the world, and for each part the number of every body that
    has facets, the nearest first: it hides most."""
    solid = [number for number, body in enumerate(bodies) if len(body.mesh.faces)]
    spheres = [enclosing(bodies[number]) for number in solid]
    together = NEIGHBOURS if len(solid) > 1 else max(len(start), 1)
    for first in range(0, len(start), together):
        rows = slice(first, first + together)
        middle = start[rows].mean(axis=0) if len(solid) > 1 else start[0]
        away = [float(np.linalg.norm(centre - middle)) - radius for centre, radius in spheres]
        for nth in np.argsort(away, kind="stable"):
            yield rows, solid[nth]


def hide(bodies: tuple[PlacedTarget, ...], start: Floats, points: Floats, seen: Bools) -> None:
    """Take from what is seen (row, point) all points (point, xyz) that a body hides from where rows start (row, xyz):
    as `occluded`, of many points from each place."""
    for rows, number in nearest_first(bodies, start):
        body = bodies[number]
        mesh = casting_mesh(body.mesh)
        a, b = ((body.pose.to_body(place) - mesh.centre) / mesh.size for place in (start[rows], points))
        facet_tree.hide(a, b, *mesh.tree, mesh.vertices, mesh.faces, seen[rows])
