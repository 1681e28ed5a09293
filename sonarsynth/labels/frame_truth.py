"""Ground truth of a frame, from the same arrivals and meshes that made its signals, on the sonar's own grid."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from sonarsynth.columns import rows_of
from sonarsynth.conventions import Floats
from sonarsynth.geometry import Pose
from sonarsynth.geometry.placed_target import PlacedTarget
from sonarsynth.labels.oriented_box import oriented_box
from sonarsynth.labels.views.appearance import Appearance, Connect, appearance, lit_fraction
from sonarsynth.labels.views.beam_cells import beam_views
from sonarsynth.labels.views.box_in_view import box_in_view, pixel_box, truncation
from sonarsynth.labels.views.hearing import as_heard, hearing, mean_motion, met_at
from sonarsynth.products import Truth, View
from sonarsynth.propagation import Propagation
from sonarsynth.receiver import BeamGrid
from sonarsynth.state import FrameContext, meeting_times


def label(context: FrameContext, propagation: Propagation, snap_level: Floats) -> Truth:
    """Truth of a frame, on the grid of beams of its sonar; snap_level: (snap,) dB re 1 uPa at 1 m.

    A beam's label is the first surface that a ray launched from the array centre in the beam's direction meets; its
    range is the distance of that point from the array centre. `label` traces the bent ray by a straight one to the
    bodies as they appear: each vertex moved to (its arrival direction) * (its distance); of straight rays, where it is.
    Boxes and beams are of the sonar's frame as the array hears: of bodies where sound met them, from where it hears
    that (`hearing`). A target's `image_box` bounds what the array sees of it within the spans of the beams; NaN where
    that is nothing, and `view` says why (`views.View`).
    """
    bodies, sonar_pose, beams = context.bodies, context.receiver.pose, context.receiver.sonar.beams
    medium, sonar_track = context.medium, context.receiver.track
    connect = partial(propagation.direct.connect, medium.profile, medium.depth)
    model, bent = (propagation.direct, connect) if propagation.bends else (None, None)
    moving = bodies if sonar_track else tuple(body.frozen for body in bodies)
    straight = medium.profile.uniform and propagation.straight(medium.profile)
    travel = partial(_straight_times, 1.0 / medium.profile.speed[0]) if straight else partial(_direct_times, connect)
    met = meeting_times([body.track for body in moving], context.snaps, travel)
    there = [met_at(moving, times) for times in met]
    when = hearing(context, met, there, snap_level)
    heard = as_heard(bodies, when)
    appearances = [appearance(body, heard, sonar_pose, bent) for body in heard]
    seen = [(a.corners, a.faces, a.boxes, a.full_box) for a in appearances]
    nearest = beam_views(seen, beams)
    way, turn = mean_motion(sonar_track, when)
    lit = [
        [lit_fraction(n, a.visible, placed, snap, medium, model) for n, a in enumerate(appearances)]
        for snap, placed in zip(context.snaps, there, strict=True)
    ]
    return Truth(
        sonar_position=sonar_pose.position,
        sonar_orientation=sonar_pose.orientation,
        sonar_velocity=way,
        sonar_spin=turn,
        target_position=_rows([b.pose.position for b in bodies], 3),
        target_orientation=_rows([b.pose.orientation for b in bodies], 4),
        target_velocity=_rows([b.velocity for b in bodies], 3),
        meeting_time=met,
        position_at_echo=_where(met, [b.pose.position for placed in there for b in placed], 3),
        orientation_at_echo=_where(met, [b.pose.orientation for placed in there for b in placed], 4),
        **_oriented(heard, sonar_pose),
        **_boxes(appearances, beams),
        visible_fraction=np.array([a.fraction for a in appearances]),
        lit_fraction=np.array(lit, float).reshape(len(context.snaps), len(bodies)),
        snap_position=_rows([s.position for s in context.snaps], 3),
        snap_time=np.array([s.time for s in context.snaps]),
        snap_level=np.asarray(snap_level, float),
        beam_target=nearest.target,
        beam_facet=nearest.facet,
        beam_range=nearest.range,
        beam_coverage=nearest.coverage,
    )


def _oriented(bodies: tuple[PlacedTarget, ...], sonar_pose: Pose) -> dict[str, Any]:
    """Columns of `Truth` of the boxes along the axes of bodies."""
    boxes = [oriented_box(body, sonar_pose) for body in bodies]
    return {
        "box": np.array([box.corners for box in boxes]).reshape(-1, 8, 3),
        "box_centre": _rows([box.centre for box in boxes], 3),
        "box_size": _rows([box.size for box in boxes], 3),
        "box_orientation": _rows([box.orientation for box in boxes], 4),
        "yaw": np.array([box.yaw for box in boxes], float),
    }


def _boxes(appearances: list[Appearance], beams: BeamGrid) -> dict[str, Any]:
    """Columns of `Truth` of boxes in azimuth and elevation, of what is in view of bodies as they are seen."""
    views, straight, truncated, in_view = [], [], [], []
    for apparent in appearances:
        faces, boxes = (rows_of(column, apparent.visible) for column in (apparent.faces, apparent.boxes))
        box = box_in_view(apparent.corners, faces, beams, boxes)
        views.append(box)
        truncated.append(truncation(apparent.corners, faces, box.view, beams))
        straight.append(box_in_view(apparent.places, faces, beams).bounds if apparent.bent else box.bounds)
        within = box.view <= View.PARTLY_IN_VIEW
        if not within:  # what no ray or another body hides may be in view all the same
            within = box_in_view(apparent.corners, apparent.faces, beams, apparent.boxes).view <= View.PARTLY_IN_VIEW
        in_view.append(within)
    return {
        "image_box": _rows([box.bounds for box in views], 4),
        "true_image_box": _rows(straight, 4),
        "full_box": _rows([apparent.full_box for apparent in appearances], 4),
        "pixel_box": _rows([pixel_box(box.bounds, beams) for box in views], 4),
        "view": np.array([box.view for box in views], np.int8),
        "in_view": np.array(in_view, np.int8),
        "truncation": np.array(truncated, float),
    }


def _direct_times(connect: Connect, start: Floats, end: Floats) -> Floats:
    """Travel times (pair,) s of the direct paths; NaN where there is none."""
    paths = connect(start, end)
    times = np.full(len(start), np.nan)
    pairs, first = np.unique(paths.pair, return_index=True)  # the earliest: paths are sorted by time
    times[pairs] = paths.travel_time[first]
    return times


def _straight_times(slowness: float, start: Floats, end: Floats) -> Floats:
    """The same of straight lines, all at one slowness (s/m)."""
    return np.asarray(np.linalg.norm(end - start, axis=1) * slowness)


def _where(met: Floats, values: list[Floats], width: int) -> Floats:
    """Values of bodies as sound met them, as a table (snap, target, width); NaN where it did not: met is NaN."""
    return np.where(np.isfinite(met)[..., None], np.reshape(values, (*met.shape, width)), np.nan)


def _rows(rows: list[Floats], width: int) -> Floats:
    return np.array(rows, float).reshape(-1, width)
