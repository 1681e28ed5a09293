"""The numbers of a report: all that its page draws, as plain values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sonarsynth.conventions import Floats, Ints, Progress, evenly
from sonarsynth.detection import Detections, ImagePeaks, by_kind, detections_of, from_rows, views
from sonarsynth.evaluation import cloud_scores, points
from sonarsynth.evaluation.detectors import DetectorReport, TrueObjects, true_objects
from sonarsynth.evaluation.detectors.detector_scores import NEAR
from sonarsynth.evaluation.detectors.threshold_baseline import TRIVIAL
from sonarsynth.evaluation.detectors.true_objects import category_names
from sonarsynth.evaluation.point_checks import has_labels
from sonarsynth.store import built_frames, splits_of

if TYPE_CHECKING:
    import xarray as xr

BASELINES: Final = ("peaks", "cfar")
MOST_JUDGED: Final = 2000
"""Frames that ranges, clouds and baselines are judged in; of more, so many, spread evenly."""
HARDEST: Final = 10
BINS: Final = 20
QUANTITIES: Final = {"range": "m", "aspect": "deg", "snr": "dB", "visible": "share"}


def numbers_of(tree: xr.DataTree, warnings: Sequence[str] = (), progress: Progress | None = None) -> dict[str, Any]:
    """What a report says of a tree some of whose frames are built; warnings: those that are known of it already."""
    built = built_frames(tree)
    split = splits_of(tree, built)
    objects = true_objects(tree, built)
    of_frame = dict(zip(built.tolist(), split, strict=True))
    whose = [of_frame[frame] for frame in objects.frame.tolist()]
    numbers: dict[str, Any] = {
        "title": str(tree.attrs.get("title", "")),
        "frames": len(built),
        "frames_of_the_recipe": int(tree.sizes["frame"]),
        "sequences": len(np.unique(np.asarray(tree["trajectory"].values)[built])),
        "splits": dict(Counter(split)),
        "objects": len(objects),
        "categories": _by_category(tree, objects, whose),
        "histograms": {name: _histogram(getattr(objects, name), whose) for name in QUANTITIES},
        "leakage": leakage(tree, built, split),
        "range_errors": _range_errors(tree, _judged_frames(built)),
        "clouds": cloud_scores(tree, _judged_frames(built)) if "cloud" in tree.children else {},
        "baselines": {},
        "hardest": [],
        "warnings": list(warnings),
    }
    if "image" in tree.children and len(built):
        _judge(numbers, tree, built, progress)
    return numbers


def _by_category(tree: xr.DataTree, objects: TrueObjects, split: list[str]) -> dict[str, dict[str, int]]:
    names = category_names(tree)
    counts = Counter(zip(objects.category.tolist(), split, strict=True))
    by_category: dict[str, dict[str, int]] = {}
    for (number, split_name), count in sorted(counts.items()):
        by_category.setdefault(names[number], {})[split_name] = count
    return by_category


def _histogram(values: Floats, split: list[str]) -> dict[str, Any]:
    """Edges, and numbers of objects by split."""
    finite = np.isfinite(values)
    if not finite.any():
        return {"edges": [], "counts": {}}
    edges = np.histogram_bin_edges(values[finite], BINS)
    of = np.array(split)
    return {
        "edges": edges.tolist(),
        "counts": {
            name: np.histogram(values[finite & (of == name)], edges)[0].tolist() for name in dict.fromkeys(split)
        },
    }


def leakage(tree: xr.DataTree, frames: Ints, split: list[str]) -> dict[str, int]:
    """Whether a detector may have seen in training what it is judged by.

    `sequences`: those that are in more than one split. `equal_frames`: frames in which the same bodies, snaps and
    sonar are where they are, and lie as they do, in a frame of another split, to a millimetre in a metre.
    """
    sequence = np.asarray(tree["trajectory"].values)[frames].tolist()
    in_splits: dict[int, set[str]] = {}
    for number, split_name in zip(sequence, split, strict=True):
        in_splits.setdefault(number, set()).add(split_name)
    of_targets = [f"truth/targets/{name}" for name in ("position", "orientation", "mesh", "scale")]
    names = [*of_targets, "truth/emissions/position", "truth/sonar_position", "truth/sonar_orientation"]
    places = [np.asarray(tree[name].values)[frames].reshape(len(frames), -1) for name in names]
    rounded = np.rint(1e3 * np.nan_to_num(np.concatenate(places, axis=1))).astype(np.int64)
    by_content: dict[bytes, set[str]] = {}
    keys = [row.tobytes() for row in rounded]
    for key, split_name in zip(keys, split, strict=True):
        by_content.setdefault(key, set()).add(split_name)
    return {
        "sequences": sum(len(splits) > 1 for splits in in_splits.values()),
        "equal_frames": sum(len(by_content[key]) > 1 for key in keys),
    }


def _range_errors(tree: xr.DataTree, frames: Ints) -> dict[str, Any]:
    """Errors of the ranges of points that are direct echoes, in tenths of the points by predicted error."""
    if not has_labels(tree):
        return {"points": 0, "predicted": [], "rms": []}
    cloud = points(tree, frames)
    good = cloud.judged & np.isfinite(cloud.error) & (cloud.range_error > 0.0)
    order = np.argsort(cloud.range_error[good], kind="stable")
    tenths = [tenth for tenth in np.array_split(order, 10) if len(tenth)]
    error, predicted = cloud.error[good], cloud.range_error[good]
    return {
        "points": int(good.sum()),
        "predicted": [float(np.sqrt(np.mean(predicted[tenth] ** 2))) for tenth in tenths],
        "rms": [float(np.sqrt(np.mean(error[tenth] ** 2))) for tenth in tenths],
    }


def _judged_frames(frames: Ints) -> Ints:
    """Those that are judged."""
    return frames[evenly(len(frames), MOST_JUDGED)]


def _judge(numbers: dict[str, Any], tree: xr.DataTree, built: Ints, progress: Progress | None) -> None:
    """Baselines on some frames, and the frames that the first of them is worst in."""
    judged = _judged_frames(built)
    methods = {kind: by_kind(kind) for kind in BASELINES}
    rows: dict[str, list[dict[str, Any]]] = {kind: [] for kind in methods}
    for done, (frame, view) in enumerate(views(tree, judged), 1):
        for kind, method in methods.items():
            rows[kind] += [{"frame": frame, **detection} for detection in detections_of(view, method)]
        if progress is not None:
            progress(done, len(judged), 0)
    objects = true_objects(tree, judged)
    reports = {kind: _report(tree, len(judged), from_rows(detections), objects) for kind, detections in rows.items()}
    numbers["judged_frames"] = len(judged)
    numbers["baselines"] = {kind: report.as_json() for kind, report in reports.items()}
    numbers["hardest"] = _hardest(reports[ImagePeaks().kind])
    if len(objects) and numbers["baselines"]["peaks"]["ap_2m"] > TRIVIAL:
        reached = numbers["baselines"]["peaks"]["ap_2m"]
        numbers["warnings"].append(
            f"a threshold reaches an average precision of {reached:.2f}: there is little to learn"
        )


def _report(tree: xr.DataTree, frames: int, detections: Detections, objects: TrueObjects) -> DetectorReport:
    return DetectorReport(frames, tuple(category_names(tree)), detections, objects)


def _hardest(report: DetectorReport) -> list[dict[str, Any]]:
    """Frames with most objects missed and most false alarms."""
    matched = report.by_distance[NEAR]
    objects = Counter(report.objects.frame.tolist())
    hits = Counter(report.detections.frame[matched >= 0].tolist())
    false = Counter(report.detections.frame[matched < 0].tolist())
    frames = sorted(objects.keys() | false.keys(), key=lambda f: (hits[f] - objects[f] - false[f], f))
    return [
        {"frame": f, "objects": objects[f], "missed": objects[f] - hits[f], "false_alarms": false[f]}
        for f in frames[:HARDEST]
        if objects[f] > hits[f] or false[f]
    ]
