"""Errors against what they are errors of: data may be as good as they say, and of no use.

What is looked at is small, so that a build can say it at its end.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext

import numpy as np

from sonarsynth.conventions import evenly
from sonarsynth.detection import beam_width
from sonarsynth.evaluation.checks import Stored, every, has, numbered, of_frames
from sonarsynth.evaluation.point_checks import has_labels, points, range_errors, room_for_points
from sonarsynth.evaluation.source_estimates import snap_located
from sonarsynth.store import Folder, Remote, folder_of
from sonarsynth.store.checking.check_rows import Check
from sonarsynth.store.files.place import opens
from sonarsynth.store.frame_reading import FrameReader

FRAMES, FRAMES_REMOTE, ROWS = 200, 24, 20_000_000
"""Frames that are looked at after a build, of a store on this machine and elsewhere, and points of them."""


def useful_ranges(tree: Stored, frames: np.ndarray) -> Check:
    """Whether ranges of direct echoes, by their errors and by predicted ones, tell more than the beam alone does.

    They do not where half of them are off by more than the size of the target and the width of a beam there.
    """
    name, expected = "ranges useful", "reported"
    cloud = points(tree, frames)
    if not cloud.judged.any():
        return Check(name, expected, "no points on a target", None, {})
    frame, target = cloud.frame[cloud.judged], cloud.target[cloud.judged].astype(int)
    distinct, row = np.unique(frame, return_inverse=True)
    corners = of_frames(tree, "truth/targets/box", distinct)
    apart = np.linalg.norm(corners[:, :, :, None] - corners[:, :, None, :], axis=-1).max(axis=(2, 3))
    size = apart[row, target]
    limit = np.fmax(size, beam_width(tree) * cloud.true_range[cloud.judged])
    error, predicted = (np.abs(x[cloud.judged]) for x in (cloud.error, cloud.range_error))
    middle = [float(np.median(x)) for x in (error, predicted, limit)]
    over = error > limit, predicted > limit
    numbers = {"median_m": middle[0], "predicted_m": middle[1], "limit_m": middle[2]}
    result = (
        f"median error {middle[0]:.2g} m, median predicted {middle[1]:.2g} m; size of target or beam {middle[2]:.2g} m"
    )
    if not any(np.mean(x) > 0.5 for x in over):
        return Check(name, expected, result, None, numbers)
    warning = f"ranges carry no information: {result}"
    return Check(name, expected, result, None, numbers, numbered(np.unique(frame[over[0] | over[1]])), warning)


def signals_whole(tree: Stored, frames: np.ndarray) -> Check:
    """Arrivals that fell outside the sample window; samples at full scale, as the recipe has it, are a warning."""
    counts = {name: every(tree, f"signals/{name}")[frames] for name in ("outside", "clipped")}
    outside, clipped = (int(count.sum()) for count in counts.values())
    spoiled = numbered(frames[counts["outside"] + counts["clipped"] > 0])
    expected, result = "none outside", f"{outside} arrivals outside, {clipped} samples clipped"
    loud = int(np.count_nonzero(counts["clipped"]))
    warning = f"{clipped} samples are clipped, in {loud} of {len(frames)} frames (scene.sonar.converter.full_scale)"
    return Check(
        "signals whole", expected, result, not outside, {"outside": outside, "clipped": clipped}, spoiled,
        warning if clipped else "",
    )  # fmt: skip


def bounds(tree: Stored, frames: np.ndarray) -> list[Check]:
    """What of a store is of use, whatever it claims."""
    checks = [signals_whole(tree, frames)] if has(tree, "signals") else []
    if has(tree, "source_estimates"):
        checks.append(snap_located(tree, frames))
    if has_labels(tree):
        checks.append(useful_ranges(tree, frames))
    return checks


def warnings(store: Folder | str) -> list[str]:
    """Warnings about a store, a line each, from some frames spread over those that are built; no signals are read.

    None of a store that cannot be read: to say so is for `store.verify`.
    """
    path = folder_of(store)
    try:
        with _opened(path) as tree:
            built = np.flatnonzero(np.isfinite(every(tree, "truth/sonar_position")[:, 0]))
            room = room_for_points(tree) if has(tree, "cloud") else 1
            count = min(FRAMES_REMOTE if isinstance(path, Remote) else FRAMES, max(ROWS // max(room, 1), 1), len(built))
            frames = built[evenly(len(built), count)]
            checks = bounds(tree, frames) + (range_errors(tree, frames) if has_labels(tree) else [])
    except (OSError, KeyError, ValueError):
        return []
    return [check.warning for check in checks if check.warning]


def _opened(path: Folder) -> AbstractContextManager[Stored]:
    if isinstance(path, Remote):
        import xarray as xr  # 0.7 s, for what is read elsewhere

        return xr.open_datatree(opens(path), engine="zarr", chunks=None)
    return nullcontext(FrameReader(path))
