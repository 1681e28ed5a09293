"""What of a body is in the view of the beam grid: its box in azimuth and elevation, or why there is none."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.labels import view_kernels
from sonarsynth.receiver import BeamGrid


class View(IntEnum):
    """How much of what the array sees of a body lies between the first and the last beam, each way."""

    IN_VIEW = 0
    PARTLY_IN_VIEW = 1
    OUTSIDE_VIEW = 2
    BEHIND = 3
    HIDDEN = 4


MEANINGS = " ".join(view.name.lower() for view in View)
"""Words of the flags, in the order of their values."""


class BoxInView(NamedTuple):
    """The part in view."""

    bounds: Floats  # (4,) rad: azimuth min, max, elevation min, max; NaN where nothing is in view
    view: View


def box_in_view(seen: Floats, faces: np.ndarray, beams: BeamGrid) -> BoxInView:
    """Bounds of the facets (facet, 3) of corners seen (vertex, xyz), sonar frame, within the spans of a beam grid.

    Exact for flat facets, however large: they are cut along the edges of the view. `faces` are those that the array
    sees; without any, the body is hidden. It is behind where all of these are at x < 0.
    """
    if not len(faces):
        return BoxInView(np.full(4, np.nan), View.HIDDEN)
    spans = 0.5 * beams.azimuth_span, 0.5 * beams.elevation_span
    bounds = np.array([np.inf, -np.inf, np.inf, -np.inf])
    inside, outside = view_kernels.bounds(np.ascontiguousarray(seen, float), faces, *spans, bounds)
    if inside:
        return BoxInView(bounds, View.PARTLY_IN_VIEW if outside else View.IN_VIEW)
    named = np.zeros(len(seen), bool)
    named[faces] = True
    behind = bool((seen[named, 0] < 0.0).all())
    return BoxInView(np.full(4, np.nan), View.BEHIND if behind else View.OUTSIDE_VIEW)
