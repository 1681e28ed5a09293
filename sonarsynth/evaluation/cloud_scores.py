"""Clouds against the surfaces that they are of: how exact, and how complete."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import Floats, direction

if TYPE_CHECKING:
    import xarray as xr

TOLERANCES: Final = (0.1, 0.2, 0.5)
"""m."""
BLOCK: Final = 64
"""Frames that are read at once."""


def figures_of(to_surface: Floats, to_point: Floats) -> dict[str, Any]:
    """Precision, recall and F-score by tolerance, and the Chamfer distance.

    to_surface: (point,) m, of each point to the surface; precision is the share within a tolerance. to_point: (sample,)
    m, of samples of the surface to the nearest point; recall is their share. Chamfer: the mean of one and of the other,
    added, without those that are infinite: of frames that lack points or surface, which precision and recall count as
    wrong. NaN where there is no point, or no surface. Source: Knapitsch et al. (2017), Tanks and Temples, section 4.
    """
    figures: dict[str, Any] = {"points": len(to_surface), "samples": len(to_point)}
    if not len(to_surface) or not len(to_point):
        return figures | {"chamfer": float("nan"), "by_tolerance": {}}
    by_tolerance: dict[str, dict[str, float]] = {}
    for limit in TOLERANCES:
        precision, recall = (float(np.mean(values <= limit)) for values in (to_surface, to_point))
        both = precision + recall
        by_tolerance[f"{limit:g} m"] = {
            "precision": precision,
            "recall": recall,
            "f_score": 2.0 * precision * recall / both if both else 0.0,
        }
    forth, back = (values[np.isfinite(values)] for values in (to_surface, to_point))  # a frame may lack one of both
    chamfer = float(np.mean(forth) + np.mean(back)) if len(forth) and len(back) else float("nan")
    return figures | {"chamfer": chamfer, "by_tolerance": by_tolerance}


def cloud_scores(tree: xr.DataTree, frames: np.ndarray) -> dict[str, Any]:
    """Figures (`figures_of`) of the clouds of some frames together.

    The surface is what the array sees: where the beams of the truth first meet a target. The distance of a point that
    is an echo of a target is that from its mesh when sound met it, of others that from the nearest such place, which is
    no less. Raises KeyError for a store without a cloud.
    """
    to_surface, to_point = [np.zeros(0)], [np.zeros(0)]
    for start in range(0, len(frames), BLOCK):
        block = frames[start : start + BLOCK]
        cloud, beams = (tree[name].dataset.isel(frame=block) for name in ("cloud", "truth/beams"))
        azimuth, elevation = np.meshgrid(np.deg2rad(beams["azimuth"].values), np.deg2rad(beams["elevation"].values))
        ahead = direction(azimuth, elevation)
        count = np.maximum(cloud["count"].values, 0)
        position = np.stack([cloud[axis].values for axis in "xyz"], axis=-1).astype(float)
        own, away, whose = cloud["distance"].values, beams["range"].values, beams["target"].values
        for row in range(len(block)):
            met = whose[row] >= 0
            surface = ahead[met] * away[row][met][:, None].astype(float)
            forth, back = _nearest(position[row, : count[row]], surface)
            from_mesh = own[row, : count[row]]
            to_surface.append(np.where(np.isfinite(from_mesh), from_mesh, forth))
            to_point.append(back)
    return figures_of(np.concatenate(to_surface), np.concatenate(to_point))


def _nearest(points: Floats, surface: Floats) -> tuple[Floats, Floats]:
    """Distance of each point from the nearest place of a surface, and of each place from the nearest point; infinite
    where there is none."""
    from scipy.spatial import cKDTree

    if not len(points) or not len(surface):
        return np.full(len(points), np.inf), np.full(len(surface), np.inf)
    return np.asarray(cKDTree(surface).query(points)[0]), np.asarray(cKDTree(points).query(surface)[0])
