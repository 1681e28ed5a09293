"""Labels of targets against each other, and against the labels of points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.detection.detection_method import beams_at
from sonarsynth.evaluation.checks import blocks, numbered
from sonarsynth.geometry import Pose
from sonarsynth.store.checking.check_rows import Check

if TYPE_CHECKING:
    import xarray as xr

ROUNDING = 1e-9
"""m of corners, degrees of boxes, and pixels."""
_SIDES = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


def labels_of_targets(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """Whether labels of targets that say the same in two ways agree: corners of the box and its centre, size and
    orientation; what is in view in angles and in pixels, and by its flags; points of each target, counted."""
    name, expected = "labels of targets", "boxes, flags and numbers of points agree"
    if "box_centre" not in tree["truth/targets"].dataset:
        return Check(name, expected, "the targets of this store have no such labels", None, {})
    wrong: dict[str, list[int]] = {"oriented boxes": [], "boxes in view": [], "numbers of points": []}
    counted = "points" in tree["truth/targets"].dataset
    azimuth, elevation = (np.asarray(tree[f"truth/beams/{axis}"].values) for axis in ("azimuth", "elevation"))
    for block in blocks(tree, frames):
        for i in block.frames:
            labels = {str(v): block.of(f"truth/targets/{v}", i) for v in _READ}
            present = labels["view"] >= 0
            if not _boxes_agree({v: values[present] for v, values in labels.items()}):
                wrong["oriented boxes"].append(i)
            if not _views_agree({v: values[present] for v, values in labels.items()}, azimuth, elevation):
                wrong["boxes in view"].append(i)
            if counted:
                points, whose = block.of("truth/targets/points", i), block.of("cloud/target", i)
                counts = [int((whose == target).sum()) for target in range(len(points))]
                if (whose >= len(points)).any() or (counts != np.maximum(points, 0)).any():
                    wrong["numbers of points"].append(i)
    bad = {kind: len(which) for kind, which in wrong.items() if which}
    result = "all agree" if not bad else ", ".join(f"{kind} in {n} frames do not" for kind, n in bad.items())
    missed = np.unique(np.concatenate([np.zeros(0, int), *map(np.asarray, wrong.values())]).astype(int))
    return Check(name, expected, result, not bad, {kind: len(which) for kind, which in wrong.items()}, numbered(missed))


_READ = (
    "box", "box_centre", "box_size", "box_orientation", "image_box", "full_box", "pixel_box", "view", "in_view",
    "truncation",
)  # fmt: skip


def _boxes_agree(labels: dict[str, np.ndarray]) -> bool:
    for box, centre, size, turned in zip(*(labels[v] for v in _READ[:4]), strict=True):
        rebuilt = Pose(centre, turned).to_world(_SIDES * size)
        if not (np.abs(rebuilt - box) <= ROUNDING * (1.0 + np.abs(box))).all():
            return False
    return True


def _views_agree(labels: dict[str, np.ndarray], azimuth: np.ndarray, elevation: np.ndarray) -> bool:
    box, pixels, view, cut = labels["image_box"], labels["pixel_box"], labels["view"], labels["truncation"]
    in_view = view <= 1  # in view, or partly
    if not ((np.isnan(box).any(axis=1) == ~in_view).all() and (labels["in_view"][in_view] == 1).all()):
        return False
    if not ((cut[view == 0] == 0.0).all() and (cut[(view == 2) | (view == 3)] == 1.0).all()):
        return False
    full_box, outward = labels["full_box"][in_view], np.array([-1.0, 1.0, -1.0, 1.0])
    if not (outward * (full_box - box[in_view]) >= -ROUNDING).all():
        return False
    for angles, columns, sides in ((azimuth, [0, 1], [0, 2]), (elevation, [2, 3], [1, 3])):
        apart = np.abs(beams_at(box[in_view][:, columns], angles) - pixels[in_view][:, sides])
        if len(angles) > 1 and not (apart <= 1e-6).all():
            return False
    return True
