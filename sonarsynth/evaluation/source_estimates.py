"""Estimates of where snaps are, each against the true snap that it came from; and whether they are of any use."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from sonarsynth.conventions import azimuth_elevation, counted
from sonarsynth.conventions import direction as towards
from sonarsynth.detection import beam_width
from sonarsynth.evaluation.checks import SmallVariables, Stored, blocks, every, has, numbered, other_sounds
from sonarsynth.evaluation.level_checks import snaps_heard
from sonarsynth.geometry import Pose
from sonarsynth.products import REASONS
from sonarsynth.receiver.mirror_images import mirror_image, plane_normal
from sonarsynth.store.checking.check_rows import Check

NAME, EXPECTED = "snap located", "95 % within 3 predicted errors; of a few, no more missed than by chance"
COLUMNS = (
    *("emission", "reason", "time", "time_error", "azimuth", "azimuth_error", "elevation", "elevation_error"),
    *("position", "position_covariance"),
)
NEAR = 14.16
"""Three standard errors in each of three axes: the chi-square of three degrees of freedom that has the probability of
three sigma (99.73 %)."""
SHARE = 0.95
BEYOND_3, UNIMODAL = 0.0027, 4.0 / 9.0
"""The share of normal errors that is beyond three standard errors; of errors of any law with one peak, at most
`UNIMODAL` / r^2 are beyond r of them (Vysochanskij and Petunin; Pukelsheim 1994, American Statistician 48, 88-91)."""
SO_MANY, SO_LARGE = 1e-3, 0.01
"""Of a few estimates: how unlikely, by these two, so many misses or one so large must be to be taken for no chance."""
QUANTITIES = ("position", "azimuth", "elevation", "time")
USELESS_RANGE = 0.5
"""A place whose predicted error is more of its range than this is of no use; a bearing, of more than a beam width, but
of a source so near that this moves it by less than a range is told apart; a time, of more than the inverse of the
bandwidth."""
STRANGERS = frozenset({"chorus", "noise_sources"})
"""Other sounds that may be located as snaps."""
ACCEPTED, PLACELESS = REASONS.index("accepted"), REASONS.index("range_unknown")


@dataclass
class _Tally:
    """What came of all estimates."""

    ratios: dict[str, list[float]] = field(default_factory=lambda: {name: [] for name in QUANTITIES})
    misses: list[float] = field(default_factory=list)  # m
    useless: int = 0
    strays: int = 0  # accepted, and come from no snap
    mirrored: int = 0  # accepted, and come from the other side of the array's plane
    strangers: int = 0  # of the chorus, or of other sources of noise
    rows: int = 0
    unheard: int = 0  # snaps that reach the array, and were not found
    reasons: Counter[str] = field(default_factory=Counter)
    frames: set[int] = field(default_factory=set)

    def add_stray(self, frame: int, strangers: bool) -> None:
        """Count an estimate that comes from no snap; it may be right where others sound too."""
        self.strangers += strangers
        self.strays += not strangers
        self.frames |= set() if strangers else {frame}

    def add(self, frame: int, ratios: dict[str, float]) -> None:
        """Count an estimate by its errors over their predictions."""
        for name, ratio in ratios.items():
            self.ratios[name].append(ratio)
        if not all(ratio <= 3.0 for ratio in ratios.values()):
            self.frames.add(frame)

    def of_snaps(self, name: str) -> np.ndarray:
        """Errors over predictions (estimate,) of a quantity; of those that come from no snap they are infinite."""
        return np.array(self.ratios[name] + [np.inf] * self.strays)


def as_predicted(ratios: np.ndarray) -> bool:
    """Whether errors over predicted errors (estimate,) are such as these say: 95 % within 3.

    Of a few, one is more than 5 %: misses pass where normal errors have as many by chance, and errors of any law one as
    large. One estimate may be off by 6.6 predicted errors, one of two by 9.4, two of eighteen by 28.
    """
    count, misses = len(ratios), int(np.count_nonzero(~(ratios <= 3.0)))
    if misses <= (1.0 - SHARE) * count:
        return True
    from scipy.special import bdtrc  # 0.3 s

    so_many, so_large = bdtrc(misses - 1, count, BEYOND_3), count * UNIMODAL / ratios.max() ** 2
    return bool(so_many >= SO_MANY and so_large >= SO_LARGE)


def snap_located(tree: Stored, frames: np.ndarray) -> Check:
    """Each estimate is within three predicted errors of the snap that it came from, in 95 %; each quantity by its own
    (`as_predicted`).

    Positions by their Mahalanobis distance. An estimate that is accepted and comes from no snap counts as a miss, but
    for the mirror image of one: a planar array cannot tell its sides apart, and that is a warning. A
    snap that reaches the array and is not found, and errors as large as what is sought, are honest but of no use: a
    warning.
    """
    if not has(tree, "source_estimates/emission"):
        return Check(NAME, EXPECTED, "not in this store", None, {})
    tally, normal = _Tally(), _normal(tree)
    for block in blocks(tree, frames):
        for i in block.frames:
            _frame(block, int(i), tally, normal)
    if not tally.rows:
        result = f"none of {tally.unheard} found" if tally.unheard else "no snap reaches the array"
        return Check(NAME, EXPECTED, result, None, {"found": 0}, numbered(sorted(tally.frames)), _warning(tally))
    if not (tally.strays or any(tally.ratios.values())):
        result = f"none of {tally.unheard} found"
        result += f", {tally.strangers} of other snaps" if tally.strangers else ""
        result += f", {tally.mirrored} mirror images" if tally.mirrored else ""
        return Check(NAME, EXPECTED, result, None, {"found": tally.rows}, (), _warning(tally))
    ratios = {name: tally.of_snaps(name) for name, known in tally.ratios.items() if known}
    shares = {name: float(np.mean(known <= 3.0)) for name, known in ratios.items()}
    worst = min(shares, key=lambda name: (as_predicted(ratios[name]), shares[name])) if shares else "position"
    good = bool(shares) and as_predicted(ratios[worst])
    places, numbers = tally.of_snaps("position") <= 3.0, {f"{name}_share": share for name, share in shares.items()}
    median = float(np.median(tally.misses)) if tally.misses else float("nan")
    result = f"{np.count_nonzero(places)} of {len(places)}"
    result += f", median error {median:.3g} m" if tally.misses else ""
    if not good and worst != "position":
        result += f"; {worst} in {100 * shares.get(worst, 0.0):.3g} %"
    if tally.strangers:
        result += f"; {tally.strangers} of other snaps"
    if tally.strays:
        result += f"; {tally.strays} farther from every snap than their predicted errors"
    numbers |= {"good": int(np.count_nonzero(places)), "found": tally.rows, "median_m": median, "strays": tally.strays}
    return Check(NAME, EXPECTED, result, good, numbers, numbered(sorted(tally.frames)), _warning(tally))


def _normal(tree: Stored) -> np.ndarray:
    """Unit normal (xyz) of the plane of the array: its axis, where no sensors are stored; 0 where they are in none."""
    if not has(tree, "signals"):
        return np.array([1.0, 0.0, 0.0])
    live = every(tree, "signals/position")[every(tree, "signals/gain") > 0.0]
    normal = plane_normal(live, tree.attrs["assumed_sound_speed"] / tree.attrs["band_high"])
    return np.zeros(3) if normal is None else normal


def _frame(block: SmallVariables, i: int, tally: _Tally, normal: np.ndarray) -> None:
    column = {name: block.of(f"source_estimates/{name}", i) for name in COLUMNS}
    estimates = np.flatnonzero(np.isfinite(column["time"]))
    reached = int(snaps_heard(block, i).sum())
    tally.rows += len(estimates)
    missing = max(reached - len(set(column["emission"][estimates]) - {-1}), 0)
    if missing:
        tally.unheard += missing
        tally.frames.add(i)
        refused = [REASONS[n] for n in column["reason"] if n not in (ACCEPTED, PLACELESS)]
        tally.reasons.update(refused[:missing])
    truth = {name: block.of(f"truth/emissions/{name}", i) for name in ("arrival", "azimuth", "elevation")}
    true = _places(block, i)
    for row in estimates:
        emission, estimate = int(column["emission"][row]), {name: values[row] for name, values in column.items()}
        snaps = range(len(truth["arrival"]))
        if emission < 0 and any(max(_ratios(estimate, truth, n, normal).values()) <= 3.0 for n in snaps):
            tally.mirrored += 1
            continue
        if emission < 0:
            tally.add_stray(i, bool(STRANGERS & set(other_sounds(block.tree))))
            continue
        ratios = _ratios(estimate, truth, emission)
        if np.isfinite(estimate["position"]).all():
            error = estimate["position"] - true[emission]
            tally.misses.append(float(np.linalg.norm(error)))
            distance = float(error @ np.linalg.solve(estimate["position_covariance"], error))
            ratios["position"] = 3.0 * float(np.sqrt(distance / NEAR)) if distance >= 0.0 else np.inf
        tally.add(i, ratios)
        tally.useless += _useless(block.tree, estimate)


def _places(block: SmallVariables, i: int) -> np.ndarray:
    """Where each snap is (emission, xyz) m in the sonar frame, when it is heard."""
    if block.has("truth/emissions/position_at_arrival"):
        return block.of("truth/emissions/position_at_arrival", i)
    pose = Pose(block.of("truth/sonar_position", i), block.of("truth/sonar_orientation", i))
    return pose.to_body(block.of("truth/emissions/position", i))  # a store from before there was that


def _ratios(
    estimate: dict[str, np.ndarray], truth: dict[str, np.ndarray], emission: int, normal: np.ndarray | None = None
) -> dict[str, float]:
    """Errors of direction and time over the predicted ones, from a snap's or from its mirror image's in the plane of a
    normal (xyz); infinite where they cannot be told."""
    azimuth, elevation = np.deg2rad(truth["azimuth"][emission]), np.deg2rad(truth["elevation"][emission])
    if normal is not None:
        azimuth, elevation = azimuth_elevation(mirror_image(towards(azimuth, elevation), normal))
    turned = (estimate["azimuth"] - np.rad2deg(azimuth) + 180.0) % 360.0 - 180.0
    raised = estimate["elevation"] - np.rad2deg(elevation)
    late = estimate["time"] - truth["arrival"][emission]
    errors = {"azimuth": turned, "elevation": raised, "time": late}
    return {name: _ratio(abs(float(error)), float(estimate[f"{name}_error"])) for name, error in errors.items()}


def _ratio(error: float, predicted: float) -> float:
    """An error over its prediction; none where both are 0."""
    ratio = error / predicted if predicted > 0.0 else 0.0 if error == 0.0 else np.inf
    return np.inf if np.isnan(ratio) else ratio


def _useless(tree: Stored, row: dict[str, np.ndarray]) -> bool:
    """Whether the predicted errors of an estimate are as large as what it says."""
    bandwidth = float(tree.attrs["band_high"] - tree.attrs["band_low"])
    spread = float(np.sqrt(max(np.trace(row["position_covariance"]), 0.0)))
    turned = np.deg2rad(np.hypot(row["azimuth_error"] * np.cos(np.deg2rad(row["elevation"])), row["elevation_error"]))
    away = float(np.linalg.norm(row["position"]))
    placed = spread <= USELESS_RANGE * away  # not where there is none
    aimed = turned <= beam_width(tree) or turned * away <= tree.attrs["assumed_sound_speed"] / bandwidth
    return not (placed and aimed and row["time_error"] <= 1.0 / bandwidth)


def _warning(tally: _Tally) -> str:
    """In one line, what is honest but of no use."""
    warnings = []
    if tally.unheard:
        why = ", ".join(f"{name} {count}" for name, count in tally.reasons.most_common(3))
        warnings.append(f"{counted(tally.unheard, 'snap')} in reach not located" + (f" ({why})" if why else ""))
    if tally.mirrored:
        warnings.append(f"{counted(tally.mirrored, 'snap')} located at the mirror image on the other side of the array")
    if tally.useless:
        warnings.append(f"{tally.useless} of {tally.rows} estimates are useless: their predicted errors are too large")
    return "; ".join(warnings)
