"""Bodies as the array sees them: where their corners appear, which facets are visible, and which of those are lit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, occluded
from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels.views.box_in_view import facet_boxes
from sonarsynth.products import Paths
from sonarsynth.state import Emission, Medium
from sonarsynth.tracing.occlusion.ray_cones import hidden
from sonarsynth.tracing.receive_paths import usable

Connect = Callable[[Floats, Floats], Paths]
"""Rays from (pair, xyz) to (pair, xyz) in the world: a propagation model bound to its water."""


class Appearance(NamedTuple):
    """A body as the array sees it."""

    corners: Floats  # (vertex, xyz) m, sonar frame: where they appear; NaN where no ray arrives (a shadow)
    boxes: Floats  # (facet, 4) rad: `facet_boxes` of all facets
    visible: Ints  # facets that the array sees, in the view of the beams or not
    fraction: float  # their share of the area that faces the array
    bent: bool  # whether rays bend, so that corners are not where they appear


def appearance(
    body: PlacedTarget, bodies: tuple[PlacedTarget, ...], sonar_pose: Pose, connect: Connect | None
) -> Appearance:
    """A body among all bodies; connect: None where rays are straight."""
    corners = _apparent(body, sonar_pose, connect)
    boxes, visible = facet_boxes(corners, body.mesh.faces), _visible(body, corners, bodies, sonar_pose)
    return Appearance(corners, boxes, *visible, bent=connect is not None)


def _apparent(body: PlacedTarget, sonar_pose: Pose, connect: Connect | None) -> Floats:
    """(vertex, xyz) in the sonar frame: vertices where the array sees them; NaN where no ray arrives."""
    world = body.pose.to_world(body.mesh.vertices)
    true = sonar_pose.to_body(world)
    if connect is None:
        return true
    apparent = np.full_like(true, np.nan)
    for block in in_blocks(len(world)):
        paths = connect(world[block], np.broadcast_to(sonar_pose.position, world[block].shape))
        pairs, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
        towards = -sonar_pose.turn_to_body(paths.arrival[first])
        apparent[block][pairs] = towards * np.linalg.norm(true[block][pairs], axis=1)[:, None]
    return apparent


def _visible(
    body: PlacedTarget, corners: Floats, bodies: tuple[PlacedTarget, ...], sonar_pose: Pose
) -> tuple[Ints, float]:
    """The visible facets, in the view of the beams or not, and their share of the area that faces the array."""
    mesh, sonar = body.mesh, body.pose.to_body(sonar_pose.position)
    facing = _facing(body, slice(None), sonar)
    visible = np.zeros(len(mesh.faces), bool)
    for block in in_blocks(len(mesh.faces)):
        rows = np.flatnonzero(facing[block]) + block.start
        start = _clear(body, rows)
        clear = ~occluded(bodies, start, np.broadcast_to(sonar_pose.position, start.shape))
        visible[rows] = clear & finite(corners, mesh.faces[rows])
    fraction = float(mesh.area[visible].sum() / mesh.area[facing].sum()) if visible.any() else 0.0
    return np.flatnonzero(visible), fraction


def _facing(body: PlacedTarget, rows: Ints | slice, position: Floats) -> Bools:
    """Whether a place (xyz), in the frame of a body, is on the outer side of facets (row,)."""
    ahead = position - body.mesh.centroid[rows]
    return np.asarray(np.einsum("ij,ij->i", ahead, body.mesh.normal[rows]) > 0.0)


def _clear(body: PlacedTarget, rows: Ints) -> Floats:
    """(row, xyz) world: middles of facets (row,), moved off them."""
    farthest = float(np.abs(body.pose.position).max()) + body.mesh.radius
    offset = max(OFFSET * body.mesh.radius, 8.0 * np.finfo(float).eps * farthest)  # rounding of places in the world
    return body.pose.to_world(body.mesh.centroid[rows] + offset * body.mesh.normal[rows])


def lit_fraction(
    body: PlacedTarget,
    visible: Ints,
    bodies: tuple[PlacedTarget, ...],
    snap: Emission,
    medium: Medium,
    connect: Connect | None,
) -> float:
    """Share of the area of the visible facets of a body that direct paths of an emission reach: on the outer side, and
    past all bodies. NaN where none is visible; connect: None where rays are straight."""
    if not len(visible):
        return float("nan")
    if not snap.illuminates:
        return 0.0
    lit = np.zeros(len(visible), bool)
    for block in in_blocks(len(visible)):
        rows = visible[block]
        if connect is None:
            faced = np.flatnonzero(_facing(body, rows, body.pose.to_body(snap.position)))
            start = _clear(body, rows[faced])
            blocked = occluded(bodies, start, np.broadcast_to(snap.position, start.shape))
        else:
            position, normal = (
                body.pose.to_world(body.mesh.centroid[rows]),
                body.pose.turn_to_world(body.mesh.normal[rows]),
            )
            paths = connect(np.broadcast_to(snap.position, position.shape), position)
            towards = -paths.arrival
            lighting = np.flatnonzero(usable(paths) & (np.einsum("ij,ij->i", towards, normal[paths.pair]) > 0.0))
            faced = paths.pair[lighting]
            start = _clear(body, rows[faced])
            end = np.broadcast_to(snap.position, start.shape)
            blocked = hidden(bodies, medium, start, end, towards[lighting], paths.length[lighting])
        lit[faced[~blocked] + block.start] = True
    area = body.mesh.area[visible]
    return float(area[lit].sum() / area.sum())


def finite(points: Floats, faces: np.ndarray) -> Bools:
    """Facets (facet,) whose corners are all finite points (point, xyz)."""
    valid = np.asarray(np.isfinite(points).all(axis=1))
    return np.ones(len(faces), bool) if valid.all() else np.asarray(valid[faces].all(axis=1))
