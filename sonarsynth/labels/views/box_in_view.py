"""What of a body is in the view of the beam grid: its box in azimuth and elevation, or why there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.labels.views import view_kernels
from sonarsynth.products import View
from sonarsynth.receiver import BeamGrid


class BoxInView(NamedTuple):
    """The part in view."""

    bounds: Floats  # (4,) rad: azimuth min, max, elevation min, max; NaN where nothing is in view
    view: View


def facet_boxes(corners: Floats, faces: np.ndarray, closed: bool = False) -> Floats:
    """Bounds (facet, 4) in rad of what of each facet (facet, 3) of corners seen (vertex, xyz), sonar frame, is ahead of
    the sonar, x > 0: azimuth min, max, elevation min, max; NaN where nothing is, or a corner is NaN.

    closed: whether they are a closed surface. Where the sonar is beside it, those whose inner side it would see have
    NaN too: others are before them.
    """
    boxes, points = np.empty((len(faces), 4)), np.ascontiguousarray(corners, float)
    view_kernels.boxes_ahead(points, faces, closed and view_kernels.apart(points), boxes)
    return boxes


def whole_box(boxes: Floats) -> Floats:
    """Bounds (4,) of facets with boxes (facet, 4); NaN without any."""
    bounds = np.empty(4)
    view_kernels.bounds_of_whole(boxes, np.inf, np.inf, np.empty(len(boxes), bool), bounds)
    return bounds


def box_in_view(corners: Floats, faces: np.ndarray, beams: BeamGrid, boxes: Floats | None = None) -> BoxInView:
    """Bounds of the facets (facet, 3) of corners seen (vertex, xyz), sonar frame, within the spans of a beam grid.

    Exact for flat facets, however large: they are cut along the edges of the view. `faces` are those that the array
    sees; without any, the body is hidden. It is behind where all of these are at x < 0. boxes: `facet_boxes` of them,
    where these are known.
    """
    if not len(faces):
        return BoxInView(np.full(4, np.nan), View.HIDDEN)
    spans = 0.5 * beams.azimuth_span, 0.5 * beams.elevation_span
    boxes = facet_boxes(corners, faces) if boxes is None else boxes
    inner, bounds = np.empty(len(boxes), bool), np.empty((2, 4))
    view_kernels.bounds_of_whole(boxes, *spans, inner, bounds[0])
    if inner.all():
        return BoxInView(bounds[0], View.IN_VIEW)
    inside, outside = view_kernels.bounds(np.ascontiguousarray(corners, float), faces[~inner], *spans, bounds[1])
    if inside or inner.any():
        view = View.PARTLY_IN_VIEW if outside else View.IN_VIEW
        return BoxInView(whole_box(bounds if inside else bounds[:1]), view)
    named = np.zeros(len(corners), bool)
    named[faces] = True
    behind = bool((corners[named, 0] < 0.0).all())
    return BoxInView(np.full(4, np.nan), View.BEHIND if behind else View.OUTSIDE_VIEW)


def truncation(corners: Floats, faces: np.ndarray, view: View, beams: BeamGrid) -> float:
    """Share of the solid angle of facets (facet, 3) of corners seen (vertex, xyz) that is out of the spans of a beam
    grid; NaN where the body is hidden. Faces and view: as of `box_in_view`."""
    if view != View.PARTLY_IN_VIEW:
        return {View.IN_VIEW: 0.0, View.HIDDEN: float("nan")}.get(view, 1.0)
    spans = 0.5 * beams.azimuth_span, 0.5 * beams.elevation_span
    inside, every = view_kernels.solid_angles(np.ascontiguousarray(corners, float), faces, *spans)
    return float(np.clip(1.0 - inside / every, 0.0, 1.0)) if every > 0.0 else 0.0


def pixel_box(bounds: Floats, beams: BeamGrid) -> Floats:
    """Bounds (4,) in rad as x0, y0, x1, y1 (4,) on a beam grid: beam (row i, column j) is at y = i + 0.5, x = j + 0.5.

    A grid of one column, or row, has a beam as wide as its span.
    """
    count = np.array([beams.azimuths, beams.elevations])
    span = np.array([beams.azimuth_span, beams.elevation_span])
    return np.ravel(0.5 * count + bounds.reshape(2, 2).T * (np.maximum(count - 1, 1) / span))
