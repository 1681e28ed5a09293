"""Distances of points from the surface of a body, compiled: exact, by the tree of its facets; and which are in it."""

from __future__ import annotations

import math

import numpy as np

from sonarsynth.casting.facet_distances import to_box, to_triangle
from sonarsynth.casting.ray_casting import casting_mesh, first_hit
from sonarsynth.compiling import compiled
from sonarsynth.conventions import Bools, Floats, Int32s
from sonarsynth.geometry.placed_target import PlacedTarget

TOUCHING = 1e-6
"""m from the surface of a body: what is no farther touches it."""
UP = np.array([1e-3, 2e-3, 1.0])
"""In the frame of a body, off the edges of boxes."""


def enclosed(body: PlacedTarget, points: Floats) -> Bools:
    """Which points (point, xyz) of the world are inside a closed body, where the facet above them shows its inner side,
    or touch its surface."""
    own, box, out = body.pose.to_body(points), body.mesh.box, np.zeros(len(points), bool)
    margin = 1e-5 * (1.0 + np.ptp(box, axis=0))  # rounding of places
    near = np.flatnonzero(((own >= box[0] - margin) & (own <= box[1] + margin)).all(axis=1))
    if not len(near) or not len(body.mesh.faces):
        return out
    facet, _ = first_hit(body.mesh, own[near], np.broadcast_to(UP, (len(near), 3)))
    inner = (facet >= 0) & (body.mesh.normal[facet] @ UP > 0.0)
    out[near] = inner | (surface_distances(body, points[near]) <= TOUCHING)
    return out


def surface_distances(body: PlacedTarget, points: Floats) -> Floats:
    """Distances (point,) m of points (point, xyz) of the world from the surface of a body, inside or outside: exact."""
    ready = casting_mesh(body.mesh)
    at, distance = (body.pose.to_body(points) - ready.centre) / ready.size, np.empty(len(points))
    _distances(at, ready.vertices, ready.faces, *ready.tree, distance)
    return distance * ready.size


@compiled
def _distances(points: Floats, vertices: Floats, faces: Int32s, nodes: Floats, order: Int32s, distance: Floats) -> None:
    """Distance (point,) of points (point, xyz) to the nearest facet of a mesh, exact; nodes, order: `facet_tree`."""
    leaves, count = len(nodes) // 2, len(order)
    stack, near = np.empty(128, np.int64), np.empty(128)
    for p in range(len(points)):
        best, depth = np.inf, 1
        stack[0], near[0] = 1, to_box(points[p], nodes[1])
        while depth:
            depth -= 1
            node = stack[depth]
            if near[depth] >= best:
                continue
            if node >= leaves:
                for i in range((node - leaves) * count // leaves, (node - leaves + 1) * count // leaves):
                    f = order[i]
                    a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
                    best = min(best, to_triangle(points[p], a, b, c))
                continue
            child, sibling = to_box(points[p], nodes[2 * node]), to_box(points[p], nodes[2 * node + 1])
            far = 2 * node + (1 if sibling > child else 0)
            stack[depth], near[depth] = far, max(child, sibling)
            stack[depth + 1], near[depth + 1] = 4 * node + 1 - far, min(child, sibling)
            depth += 2
        distance[p] = math.sqrt(best)
