"""What the methods of detection share: they find regions of the image; boxes and ranges follow from these."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.description.method import returned
from sonarsynth.detection.sonar_view import SonarView


class Region(NamedTuple):
    """Beams that belong together, and how sure it is that they are an object."""

    rows: np.ndarray  # (some,) along elevation: the box is about the first and the last
    columns: np.ndarray  # (some,) along azimuth
    score: float


class DetectionMethod(Protocol):
    """Finds objects in an image."""

    @property
    def kind(self) -> str:
        """What selects it."""

    def regions(self, view: SonarView) -> list[Region]:
        """Regions of the image that are objects, in any order. Sees no truth."""


def detections_of(view: SonarView, method: DetectionMethod) -> list[dict[str, Any]]:
    """Columns of the detections of a frame.

    The box is about the middle of a region, without the beam width that a point spreads over; the direction is that of
    the middle; the range is that of the loudest point of the cloud in the region. Raises WrongReturn for regions that
    are none.
    """
    found = []
    for region in method.regions(view):
        for name in ("rows", "columns"):
            returned(method, "regions", region, (max(np.size(getattr(region, name, ())), 1),), name)
        returned(method, "regions", region, (), "score")
        found.append(_detection(view, region))
    return found


def _detection(view: SonarView, region: Region) -> dict[str, Any]:
    x0, x1 = float(region.columns.min()), float(region.columns.max() + 1)
    y0, y1 = float(region.rows.min()), float(region.rows.max() + 1)
    sides = [
        _narrowed(low, high, held) for low, high, held in zip((x0, y0), (x1, y1), view.beams_per_width, strict=True)
    ]
    detection: dict[str, Any] = {
        "score": region.score,
        "box": (*(narrow[0] for narrow in sides), *(narrow[1] for narrow in sides)),
        "azimuth": float(angle_at(0.5 * (x0 + x1), view.azimuth)),
        "elevation": float(angle_at(0.5 * (y0 + y1), view.elevation)),
    }
    at = [beams_at(view.points[:, n], angles) for n, angles in enumerate((view.azimuth, view.elevation))]
    within = (at[0] >= x0) & (at[0] <= x1) & (at[1] >= y0) & (at[1] <= y1)
    if within.any():
        points = view.points[within]
        detection["range"] = float(points[points[:, 3].argmax(), 2])
    return detection


def _narrowed(low: float, high: float, width: float) -> tuple[float, float]:
    """An extent (beams) without the spread of a point, which adds in squares as widths of Gaussians; one beam at
    least."""
    half, middle = 0.5 * np.sqrt(max((high - low) ** 2 - width**2, 1.0)), 0.5 * (low + high)
    return middle - half, middle + half


def angle_at(position: Floats | float, angles: Floats) -> Floats:
    """Angles (deg) of places in beams, where beam j is at j + 0.5."""
    return np.asarray(np.interp(np.subtract(position, 0.5), np.arange(len(angles)), angles))


def beams_at(angle: Floats, angles: Floats) -> Floats:
    """Places in beams of angles (deg), clipped to the grid; the inverse of `angle_at`."""
    return np.asarray(np.interp(angle, angles, np.arange(len(angles)) + 0.5))
