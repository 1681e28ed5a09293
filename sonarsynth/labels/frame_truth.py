"""Ground truth of a frame, from the same arrivals and meshes that made its signals, on the sonar's own grid."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from sonarsynth.casting.ray_casting import OFFSET, first_hit, occluded
from sonarsynth.conventions import NO_TARGET, Bools, Floats, Ints, direction
from sonarsynth.geometry import Pose
from sonarsynth.geometry.mesh import Mesh, in_blocks
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels.views import box_in_view
from sonarsynth.products import Paths, Truth
from sonarsynth.propagation import Propagation
from sonarsynth.receiver import BeamGrid
from sonarsynth.state import FrameContext, meeting_times, positions

Connect = Callable[[Floats, Floats], Paths]
"""Rays from (pair, xyz) to (pair, xyz) in the world: a propagation model bound to its water."""


def label(context: FrameContext, propagation: Propagation, snap_level: Floats) -> Truth:
    """Truth of a frame, on the grid of beams of its sonar; snap_level: (snap,) dB re 1 uPa at 1 m.

    A beam's label is the first surface that a ray launched from the array centre in the beam's direction meets; its
    range is the distance of that point from the array centre. `label` traces the bent ray by casting a straight one
    against the bodies as they appear: each vertex moved to (its arrival direction) * (its distance); straight rays show
    them as they are. A target's `image_box` bounds what the array sees of it within the spans of the beams; NaN where
    that is nothing, and `view` says why (`views.View`).
    """
    bodies, sonar_pose, beams = context.bodies, context.receiver.pose, context.receiver.sonar.beams
    straight, medium = not propagation.bends, context.medium
    connect = partial(propagation.direct.connect, medium.profile, medium.depth)
    seen = [_as_seen(body, sonar_pose, connect, straight) for body in bodies]
    target, facet, distance = _label_beams(bodies, seen, beams, sonar_pose, straight)
    visible = [_visible(body, corners, bodies, sonar_pose) for body, corners in zip(bodies, seen, strict=True)]
    boxes = [
        box_in_view(corners, body.mesh.faces[facets], beams)
        for body, corners, (facets, _) in zip(bodies, seen, visible, strict=True)
    ]
    tracks = [body.track if context.receiver.track else body.frozen.track for body in bodies]
    met = meeting_times(tracks, context.snaps, partial(_direct_times, connect))
    return Truth(
        sonar_position=sonar_pose.position,
        sonar_orientation=sonar_pose.orientation,
        target_position=_rows([b.pose.position for b in bodies], 3),
        target_orientation=_rows([b.pose.orientation for b in bodies], 4),
        target_velocity=_rows([b.velocity for b in bodies], 3),
        meeting_time=met,
        position_at_echo=positions(tracks, met),
        box=np.array([sonar_pose.to_body(b.box) for b in bodies]).reshape(-1, 8, 3),
        image_box=_rows([box.bounds for box in boxes], 4),
        view=np.array([box.view for box in boxes], np.int8),
        visible_fraction=np.array([fraction for _, fraction in visible]),
        snap_position=_rows([s.position for s in context.snaps], 3),
        snap_time=np.array([s.time for s in context.snaps]),
        snap_level=np.asarray(snap_level, float),
        beam_target=target,
        beam_facet=facet,
        beam_range=distance,
    )


def _direct_times(connect: Connect, start: Floats, end: Floats) -> Floats:
    """Travel times (pair,) s of the direct paths; NaN where there is none."""
    paths = connect(start, end)
    times = np.full(len(start), np.nan)
    pairs, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
    times[pairs] = paths.travel_time[first]
    return times


def _rows(rows: list[Floats], width: int) -> Floats:
    return np.array(rows, float).reshape(-1, width)


def _as_seen(body: PlacedTarget, sonar_pose: Pose, connect: Connect, straight: bool) -> Floats:
    """(vertex, xyz) in the sonar frame: vertices where the array sees them; NaN where no ray arrives (a shadow)."""
    world = body.pose.to_world(body.mesh.vertices)
    true = sonar_pose.to_body(world)
    if straight:
        return true
    apparent = np.full_like(true, np.nan)
    for some in in_blocks(len(world)):
        paths = connect(world[some], np.broadcast_to(sonar_pose.position, world[some].shape))
        pairs, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
        towards = -sonar_pose.turn_to_body(paths.arrival[first])
        apparent[some][pairs] = towards * np.linalg.norm(true[some][pairs], axis=1)[:, None]
    return apparent


def _label_beams(
    bodies: tuple[PlacedTarget, ...], seen: list[Floats], beams: BeamGrid, sonar_pose: Pose, straight: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Target, facet and range (elevation, azimuth) of each beam."""
    rays = direction(beams.azimuth[None, :], beams.elevation[:, None])
    shape = rays.shape[:2]
    target = np.full(shape, NO_TARGET, np.int16)
    facet = np.full(shape, NO_TARGET, np.int32)
    nearest = np.full(shape, np.inf)
    for index, (body, vertices) in enumerate(zip(bodies, seen, strict=True)):
        kept = np.flatnonzero(_finite(vertices, body.mesh.faces))
        if not len(kept):
            continue
        faces = body.mesh.faces if len(kept) == len(body.mesh.faces) else body.mesh.faces[kept]
        named = np.zeros(len(vertices), bool)
        named[faces] = True
        rows, columns = _beams_near(vertices if named.all() else vertices[named], rays)
        look = rays[rows, columns]
        if straight:  # in the frame of the mesh, which is made ready for casting once
            origin = np.broadcast_to(body.pose.to_body(sonar_pose.position), look.shape)
            hit, distance = first_hit(body.mesh, origin, body.pose.turn_to_body(sonar_pose.turn_to_world(look)))
        else:
            hit, distance = first_hit(Mesh(np.nan_to_num(vertices), faces), np.zeros_like(look), look)
            hit = np.where(hit >= 0, kept[hit], hit)
        closer = (hit >= 0) & (distance < nearest[rows, columns])
        rows, columns = rows[closer], columns[closer]
        target[rows, columns], facet[rows, columns] = index, hit[closer]
        nearest[rows, columns] = distance[closer]
    return target, facet, np.where(np.isfinite(nearest), nearest, np.nan).astype(np.float32)


def _beams_near(points: Floats, rays: Floats) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns of the rays inside the cone, about the mean direction of the points, that holds them all."""
    towards = points / np.linalg.norm(points, axis=1, keepdims=True)
    axis = towards.mean(axis=0)
    if np.linalg.norm(axis) < 0.5:  # the array is within the body, or close to it: every ray may hit
        every = np.indices(rays.shape[:2]).reshape(2, -1)
        return every[0], every[1]
    axis /= np.linalg.norm(axis)
    widest = np.arccos(np.clip(towards @ axis, -1, 1)).max()
    rows, columns = np.nonzero(np.arccos(np.clip(rays @ axis, -1, 1)) <= widest + 1e-3)
    return rows, columns


def _visible(
    body: PlacedTarget, seen: Floats, bodies: tuple[PlacedTarget, ...], sonar_pose: Pose
) -> tuple[Ints, float]:
    """The visible facets, in the view of the beams or not, and their share of the area that faces the array."""
    mesh = body.mesh
    facing, farthest = np.zeros(len(mesh.faces), bool), 0.0
    for some in in_blocks(len(mesh.faces)):
        centroid, normal = body.pose.to_world(mesh.centroid[some]), body.pose.turn_to_world(mesh.normal[some])
        facing[some] = np.einsum("ij,ij->i", sonar_pose.position - centroid, normal) > 0
        farthest = max(farthest, float(np.abs(centroid).max()))
    rounding = 8.0 * np.finfo(float).eps * farthest  # of places in the world
    offset = max(OFFSET * mesh.radius, rounding)
    visible = np.zeros(len(mesh.faces), bool)
    for some in in_blocks(len(mesh.faces)):
        rows = np.flatnonzero(facing[some]) + some.start
        start = body.pose.to_world(mesh.centroid[rows]) + offset * body.pose.turn_to_world(mesh.normal[rows])
        clear = ~occluded(bodies, start, np.broadcast_to(sonar_pose.position, start.shape))
        visible[rows] = clear & _finite(seen, mesh.faces[rows])
    fraction = float(mesh.area[visible].sum() / mesh.area[facing].sum()) if visible.any() else 0.0
    return np.flatnonzero(visible), fraction


def _finite(points: Floats, faces: np.ndarray) -> Bools:
    """Facets (facet,) whose corners are all finite points (point, xyz)."""
    finite = np.asarray(np.isfinite(points).all(axis=1))
    return np.ones(len(faces), bool) if finite.all() else np.asarray(finite[faces].all(axis=1))
