"""Points, judged by their labels: how far they are from where their echoes were made, and what else there is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sonarsynth.evaluation.checks import Stored, has, numbered, of_frames, other_sounds
from sonarsynth.evaluation.source_estimates import STRANGERS
from sonarsynth.products import FAMILIES, ORIGINS
from sonarsynth.store.checking.check_rows import Check
from sonarsynth.store.frame_reading import FrameReader

OUTLIERS = 0.02
"""Share of the points that may be further off than three predicted errors, and a standard deviation of how many that
are: errors of overlapping echoes have longer tails than normal ones. One may be whatever their number."""

AS_PREDICTED = "98 % within 3 predicted errors, but for chance"
MOST_ROWS = 2_000_000
"""Points, and room for points, that are read at once."""
UNKNOWN, STRANGER = -1, -2
"""Clocks that are no emission: nobody knows; a snap of the chorus, which the labels do not list."""


@dataclass(frozen=True, eq=False)
class Points:
    """The points of some frames."""

    frame: np.ndarray  # (point,)
    row: np.ndarray  # (point,) its number in the frame
    range: np.ndarray  # (point,) m
    range_error: np.ndarray  # (point,) m, predicted
    true_range: np.ndarray  # (point,) m
    target: np.ndarray  # (point,)
    emission: np.ndarray  # (point,)
    family: np.ndarray  # (point,)
    lit_by: np.ndarray  # (point,)
    origin: np.ndarray  # (point,)
    clock: np.ndarray  # (point,) the emission that it is placed by; UNKNOWN; STRANGER: a snap of the chorus

    @property
    def strange(self) -> np.ndarray:
        """(point,) lit by another snap than that it is placed by."""
        return np.asarray((self.clock != UNKNOWN) & (self.emission >= 0) & (self.emission != self.clock))

    @property
    def judged(self) -> np.ndarray:
        """(point,) of a target, directly, in the main lobe, by the right snap: their ranges are claimed to be right."""
        return np.asarray(self._direct & ~self.strange)

    @property
    def misplaced(self) -> np.ndarray:
        """(point,) the same by a wrong snap that is known: their predicted errors are claimed to hold the right one."""
        return np.asarray(self._direct & self.strange & (self.clock >= 0))

    @property
    def _direct(self) -> np.ndarray:
        direct = (self.target >= 0) & (self.family == 0) & (self.lit_by == 0)
        return np.asarray(direct & (self.origin == ORIGINS.index("main lobe")))

    @property
    def error(self) -> np.ndarray:
        """(point,) m: range less true range."""
        return np.asarray(self.range - self.true_range)


def has_labels(tree: Stored) -> bool:
    """Whether the points of a store have labels."""
    return has(tree, "cloud/lit_by")


def room_for_points(tree: Stored) -> int:
    """Points of a frame that a store has room for."""
    values = tree.array("cloud/range") if isinstance(tree, FrameReader) else tree["cloud/range"]
    return int(values.shape[1])


def points(tree: Stored, frames: Sequence[int] | np.ndarray) -> Points:
    """The points of some frames of a store whose points have labels."""
    numbers = np.asarray(frames)
    names = ["range", "range_error", "true_range", "target", "emission", "family", "lit_by", "origin"]
    names += ["estimate"] * has(tree, "cloud/estimate")
    count = max(MOST_ROWS // max(room_for_points(tree), 1), 1)
    chunks: dict[str, list[np.ndarray]] = {name: [] for name in ("frame", "row", *names)}
    for start in range(0, len(numbers), count):
        block = numbers[start : start + count]
        lists = {name: of_frames(tree, f"cloud/{name}", block) for name in names}
        frame, row = np.nonzero(np.isfinite(lists["range"]))
        chunks["frame"].append(block[frame])
        chunks["row"].append(row)
        for name in names:
            chunks[name].append(lists[name][frame, row])
    columns = {name: np.concatenate(arrays) if arrays else np.zeros(0) for name, arrays in chunks.items()}
    frame = columns["frame"].astype(int)
    placed_by = columns.pop("estimate", np.zeros(len(frame))).astype(int)  # of earlier stores: the first
    return Points(**columns, clock=_clocks(tree, frame, placed_by))


def _clocks(tree: Stored, frames: np.ndarray, estimate: np.ndarray) -> np.ndarray:
    """The emissions (point,) of source estimates (point,) in frames (point,)."""
    if not (has(tree, "source_estimates/emission") and len(frames)):
        return np.full(len(frames), UNKNOWN)
    distinct, row = np.unique(frames, return_inverse=True)
    of_estimates = of_frames(tree, "source_estimates/emission", distinct)
    known = (estimate >= 0) & (estimate < of_estimates.shape[1])
    emission = np.where(known, of_estimates[row, np.where(known, estimate, 0)], UNKNOWN)
    no_emission = STRANGER if STRANGERS & set(other_sounds(tree)) else UNKNOWN
    return np.where(emission < 0, no_emission, emission.astype(int))


def range_errors(tree: Stored, frames: np.ndarray) -> list[Check]:
    """Errors of the ranges of points by their labels, and what the points are that no range can be judged of.

    How large they are depends on the scene (beam width, size of the glints); that they are as predicted does not.
    """
    name, reported = "range of points on target", "reported"
    if not has_labels(tree):
        return [Check(name, reported, "the points of this store have no labels", None, {})]
    cloud = points(tree, frames)
    numbers: dict[str, float] = {word: int(mask.sum()) for word, mask in kinds(cloud).items()}
    numbers |= {"points": int(cloud.judged.sum()), "off_target": int((~cloud.judged).sum())}
    whose = Check("origin of points", reported, _said(numbers), None, numbers, warning=_few(numbers))
    others = [*_by_wrong_snaps(cloud), whose]
    if not cloud.judged.any():
        return [Check(name, reported, "no points on a target", None, numbers), *others]
    error, ratio = cloud.error[cloud.judged], _ratio(cloud)[cloud.judged]
    missed = ~(np.abs(ratio) <= 3.0)
    finite = ratio[np.isfinite(ratio)]
    numbers |= {
        "median_m": float(np.median(np.abs(error))),
        "largest_m": float(np.abs(error).max()),
        "share_within_3": float(1.0 - missed.mean()),
        "pull_rms": float(np.sqrt(np.mean(finite**2))) if len(finite) else float("nan"),
    }
    spread = f"median error {100 * numbers['median_m']:.2g} cm, at most {100 * numbers['largest_m']:.2g} cm"
    within = f"{100 * numbers['share_within_3']:.4g} %; errors over predicted errors, root mean square: "
    return [
        Check(name, reported, f"{spread}, over {len(error)} points", None, numbers),
        Check(
            "predicted range errors",
            AS_PREDICTED,
            within + f"{numbers['pull_rms']:.2g}",
            _as_predicted(missed),
            numbers,
            numbered(np.unique(cloud.frame[cloud.judged][missed])),
        ),
        *others,
    ]


def _by_wrong_snaps(cloud: Points) -> list[Check]:
    """Whether predicted errors of points that are placed by another snap than lit them say how far off that puts them;
    none where there are no such points."""
    wrong = cloud.misplaced
    if not wrong.any():
        return []
    missed, largest = ~(np.abs(_ratio(cloud)[wrong]) <= 3.0), float(np.abs(cloud.error[wrong]).max())
    share = 1.0 - float(missed.mean())
    result = f"{100 * share:.4g} % within, of {int(wrong.sum())} points; at most {largest:.2g} m off"
    numbers = {"points": int(wrong.sum()), "share_within_3": share, "largest_m": largest}
    frames = numbered(np.unique(cloud.frame[wrong][missed]))
    return [Check("ranges by another snap", AS_PREDICTED, result, _as_predicted(missed), numbers, frames)]


def _as_predicted(missed: np.ndarray) -> bool:
    """Whether so few points (point,) are further off than three predicted errors as `OUTLIERS` lets be."""
    likely = OUTLIERS * len(missed)
    return bool(missed.sum() <= max(1, likely + np.sqrt(likely)))


def _ratio(cloud: Points) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(cloud.error / cloud.range_error)


def kinds(cloud: Points) -> dict[str, np.ndarray]:
    """Points that are not judged, by kind: masks (point,), each point in the first kind that it belongs to."""
    by_origin = {word: cloud.origin == number for number, word in enumerate(ORIGINS)}
    rows = {
        "the snap itself": by_origin["snap itself"],
        "unexplained": by_origin["unexplained"],
        "of reverberation": by_origin["reverberation"],
        "lit by another snap": cloud.strange,
    }
    rows |= {"mirror images": by_origin["mirror image"]}
    rows |= {f"ghosts by {word}": cloud.family == n for n, word in enumerate(FAMILIES) if n}
    rows |= {f"lit by way of {word}": cloud.lit_by == n for n, word in enumerate(FAMILIES) if n}
    rows |= {"in side lobes": by_origin["side lobe"], "in grating lobes": by_origin["grating lobe"]}
    uncounted = ~cloud.judged
    for word, mask in rows.items():
        rows[word] = mask & uncounted
        uncounted = uncounted & ~mask
    return rows


def _said(numbers: dict[str, float]) -> str:
    why = [f"{count:.0f} {word}" for word, count in numbers.items() if count and word not in ("points", "off_target")]
    off = f", {numbers['off_target']:.0f} off" + (f" ({', '.join(why)})" if why else "")
    return f"{numbers['points']:.0f} points on target{off if numbers['off_target'] else ''}"


def _few(numbers: dict[str, float]) -> str:
    """A warning where most points are no direct echoes."""
    count = numbers["points"] + numbers["off_target"]
    return (
        f"only {100 * numbers['points'] / count:.2g} % of the points are direct echoes of targets: {_said(numbers)}"
        if numbers["points"] < 0.5 * count
        else ""
    )
