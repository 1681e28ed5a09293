"""Bodies as the array sees them: where their corners appear, which facets are visible, and which of those are lit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from sonarsynth.casting.ray_casting import facets_in_sight, start_offset
from sonarsynth.columns import alike, picked
from sonarsynth.conventions import Bools, Floats, Int32s, Ints
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels.views.box_in_view import facet_boxes, whole_box
from sonarsynth.products import Paths
from sonarsynth.propagation import Propagation
from sonarsynth.state import Emission, Medium
from sonarsynth.tracing.occlusion.ray_cones import hidden
from sonarsynth.tracing.receive_paths import Facets, may_face_receiver, usable

HALVED: Final = 8
"""Times that the distance from a facet's middle to a corner in a shadow is halved, to find where the shadow begins."""
Connect = Callable[[Floats, Floats], Paths]
"""Rays from (pair, xyz) to (pair, xyz) in the world: a propagation model bound to its water."""


class Appearance(NamedTuple):
    """A body as the array sees it."""

    corners: Floats  # (vertex, xyz) m, sonar frame: where they appear; NaN where no ray arrives (a shadow)
    places: Floats  # (vertex, xyz) m, sonar frame: where they are
    faces: Int32s  # (facet, 3) of these: those of the mesh, or of what rays arrive from (`_out_of_shadow`)
    boxes: Floats  # (facet, 4) rad: `facet_boxes`
    full_box: Floats  # (4,) rad: of all of them; NaN where none is ahead
    visible: Ints  # facets that the array sees, in the view of the beams or not
    fraction: float  # their share of the area that faces the array
    bent: bool  # whether rays bend, so that corners are not where they appear


def appearance(
    body: PlacedTarget, bodies: tuple[PlacedTarget, ...], sonar_pose: Pose, connect: Connect | None
) -> Appearance:
    """A body among all bodies; connect: None where rays are straight."""
    to_sonar = sonar_pose.rotation.T @ body.pose.rotation  # both rotations as one
    places = body.mesh.vertices @ to_sonar.T + sonar_pose.to_body(body.pose.position)
    corners, faces = places, body.mesh.faces
    if connect is not None:
        corners = _apparent(places, sonar_pose, connect)
        corners, places, faces = _out_of_shadow(corners, places, faces, sonar_pose, connect)
    boxes, bent = facet_boxes(corners, faces, body.mesh.closed), connect is not None
    visible = _visible(body, finite(corners, faces) if bent else None, bodies, sonar_pose)
    return Appearance(corners, places, faces, boxes, whole_box(boxes), *visible, bent)


def _apparent(places: Floats, sonar_pose: Pose, connect: Connect) -> Floats:
    """Where the array sees places (point, xyz), both in the sonar frame, by bent rays; NaN where no ray arrives."""
    apparent = np.full_like(places, np.nan)
    for block in in_blocks(len(places)):
        world = sonar_pose.to_world(places[block])
        paths = connect(world, alike(sonar_pose.position, len(world)))
        pairs, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
        towards = -sonar_pose.turn_to_body(paths.arrival[first])
        apparent[block][pairs] = towards * np.linalg.norm(places[block][pairs], axis=1)[:, None]
    return apparent


def _out_of_shadow(
    corners: Floats, places: Floats, faces: Int32s, sonar_pose: Pose, connect: Connect
) -> tuple[Floats, Floats, Int32s]:
    """Corners as they appear and are (vertex, xyz), and facets (facet, 3) of them, of what rays arrive from of facets
    that reach into a shadow: where one arrives from the middle, a corner without is moved towards it, out of the
    shadow. Others of these facets stay without."""
    rows = np.flatnonzero(~finite(corners, faces))
    middle = places[faces[rows]].mean(axis=1)
    seen = finite_rows(_apparent(middle, sonar_pose, connect))
    rows, middle = rows[seen], middle[seen]
    row, corner = np.nonzero(~finite_rows(corners)[faces[rows]])
    if not len(row):
        return corners, places, faces
    inner, outer = middle[row], places[faces[rows[row], corner]]  # one ray arrives, one does not
    for _ in range(HALVED):
        half = 0.5 * (inner + outer)
        arrives = finite_rows(_apparent(half, sonar_pose, connect))[:, None]
        inner, outer = np.where(arrives, half, inner), np.where(arrives, outer, half)
    faces = faces.copy()
    faces[rows[row], corner] = len(corners) + np.arange(len(row))
    return np.concatenate([corners, _apparent(inner, sonar_pose, connect)]), np.concatenate([places, inner]), faces


def _visible(
    body: PlacedTarget, unshadowed: Bools | None, bodies: tuple[PlacedTarget, ...], sonar_pose: Pose
) -> tuple[Ints, float]:
    """The visible facets, in the view of the beams or not, and their share of the area that faces the array;
    unshadowed: (facet,) whether rays arrive from them, None where rays are straight."""
    mesh, visible, facing = body.mesh, [], []
    for block in in_blocks(len(mesh.faces)):
        rows, clear = facets_in_sight(body, bodies, np.arange(block.start, block.stop), sonar_pose.position)
        facing.append(mesh.area[rows])
        visible.append(rows[clear if unshadowed is None else clear & unshadowed[rows]])
    seen = np.concatenate(visible)
    return seen, float(mesh.area[seen].sum() / np.concatenate(facing).sum()) if len(seen) else 0.0


def lit_fraction(
    number: int,
    visible: Ints,
    bodies: tuple[PlacedTarget, ...],
    snap: Emission,
    medium: Medium,
    bent: Propagation | None,
) -> float:
    """Share of the area of the visible facets of a body, of that number, whose middles direct paths of an emission
    reach: on the outer side, and past all bodies. NaN where none is visible; bent: the model of these paths, None where
    they are straight."""
    body, mesh = bodies[number], bodies[number].mesh
    if not len(visible):
        return float("nan")
    if not snap.illuminates:
        return 0.0
    lit, area = np.zeros(len(mesh.faces), bool), mesh.area
    for block in in_blocks(len(visible)):
        rows = visible[block]
        if bent is None:
            faced, clear = facets_in_sight(body, bodies, rows, snap.position)
        else:
            position, normal = body.pose.to_world(mesh.centroid[rows]), body.pose.turn_to_world(mesh.normal[rows])
            facets = Facets(alike(number, len(rows)), rows, position, position + start_offset(body) * normal, normal)
            if bent.layered:
                facets = facets.select(may_face_receiver(facets, snap.position, 0, medium))
            paths = bent.connect(medium.profile, medium.depth, alike(snap.position, len(facets.facet)), facets.point)
            paths = paths.select(picked(usable(paths) & facets.lit(paths.pair, paths.arrival)))
            leaving, faced = facets.starts(paths.pair, -paths.arrival), facets.facet[paths.pair]
            ray = leaving.point, alike(snap.position, len(faced)), -paths.arrival, paths.length
            clear = ~hidden(bodies, medium, *ray, facets=(leaving.owner, leaving.facet))
        lit[faced[clear]] = True
    return float(area[lit].sum() / area[visible].sum())


def finite(points: Floats, faces: np.ndarray) -> Bools:
    """Facets (facet,) whose corners are all finite points (point, xyz)."""
    valid = finite_rows(points)
    return np.ones(len(faces), bool) if valid.all() else np.asarray(valid[faces].all(axis=1))


def finite_rows(points: Floats) -> Bools:
    """Which points (point, xyz) are finite."""
    return np.asarray(np.isfinite(points).all(axis=1))
