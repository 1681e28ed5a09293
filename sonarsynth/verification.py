"""Truth against data: what a store says it sees, checked against what was there. Reads plain xarray."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from sonarsynth.geometry import Pose
from sonarsynth.products import LEDGER

LEDGER_TOLERANCE = 0.1  # dB
EXPANSION_PHASE = 0.2  # rad: costs a beam 0.09 dB at worst
EXPANSION_AMPLITUDE = 0.02  # of the strongest echo

INAUDIBLE = 120.0
"""dB under the direct snap: echoes weaker than this are below what a converter, or single precision, holds."""


@dataclass(frozen=True)
class Check:
    """One line of the report. `ok` is None where a figure is reported, or the store has nothing to check."""

    name: str
    expected: str
    got: str
    ok: bool | None
    numbers: dict[str, float]


def check(tree: xr.DataTree) -> list[Check]:
    """All checks of truth against data, over the frames that were built."""
    built = np.flatnonzero(np.isfinite(_all(tree, "truth/sonar_position")[:, 0]))
    if not len(built):
        return [Check("frames", "at least one frame built", "none", False, {"frames": 0})]
    checks = [Check("frames", "at least one frame built", f"{len(built)}", True, {"frames": len(built)})]
    checks.append(ledger_adds_up(tree, built))
    checks.append(expansions_hold(tree, built))
    if "signals" in tree.children:
        checks.append(nothing_outside(tree, built))
    if "image" in tree.children:
        checks.append(brightest_beam_on_target(tree, built))
    if "bearings" in tree.children:
        checks.append(snap_located(tree, built))
    if "cloud" in tree.children:
        checks.extend(range_errors(tree, built))
    return checks


def ledger_adds_up(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """received = source - loss_out + scattering - loss_in - absorption - boundary for every path family."""
    book = {name: _all(tree, f"ledger/{name}")[frames] for name in LEDGER}
    total = book["source_level"] + book["scattering"]
    for loss in ("transmission_loss_out", "transmission_loss_in", "absorption_loss", "boundary_loss"):
        total = total - book[loss]
    worst = float(np.nanmax(np.abs(total - book["received_level"]), initial=0.0))
    return Check(
        "ledger adds up",
        f"within {LEDGER_TOLERANCE} dB",
        f"{worst:.2g} dB",
        worst <= LEDGER_TOLERANCE,
        {"worst_db": worst},
    )


def nothing_outside(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """Arrivals that fell outside the sample window, and samples at full scale."""
    outside = int(_all(tree, "signals/outside")[frames].sum())
    clipped = int(_all(tree, "signals/clipped")[frames].sum())
    got = f"{outside} arrivals outside, {clipped} samples clipped"
    return Check(
        "signals whole",
        "none outside, none clipped",
        got,
        outside + clipped == 0,
        {"outside": outside, "clipped": clipped},
    )


def expansions_hold(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """Wavefronts and amplitudes are expanded over the aperture; what that errs by, as traced to probes."""
    phase = 2 * np.pi * float(tree.attrs["band_high"]) * float(_all(tree, "truth/wavefront_error")[frames].max())
    amplitude = float(_all(tree, "truth/amplitude_error")[frames].max())
    got = f"{phase:.2g} rad at the top of the band, {100 * amplitude:.2g} % of the strongest echo"
    good = phase <= EXPANSION_PHASE and amplitude <= EXPANSION_AMPLITUDE
    expected = f"under {EXPANSION_PHASE} rad and {100 * EXPANSION_AMPLITUDE:g} %"
    return Check("wavefronts over the aperture", expected, got, good, {"phase_rad": phase, "amplitude": amplitude})


def beam_width(tree: xr.DataTree) -> float:
    """Half-power beam width (rad) of the array at the centre of its band, from the attributes of the store.

    Disc: 1.03 lambda / D (first-order; Van Trees 2002, table 4.1).
    """
    low, high = tree.attrs["band_low"], tree.attrs["band_high"]
    extent = 2.0 * np.float64(tree.attrs["aperture_radius"])
    with np.errstate(divide="ignore"):  # one place has no beam: every direction is the same
        return float(1.03 * tree.attrs["assumed_sound_speed"] / (0.5 * (low + high)) / extent)


def _grid_step(tree: xr.DataTree) -> float:
    """Step (rad) of the beam grid, infinite for a single beam."""
    for axis in ("azimuth", "elevation"):
        values = _all(tree, f"truth/{axis}")
        if len(values) > 1:
            return float(np.deg2rad(np.diff(values).mean()))
    return float("inf")


def near_target(tree: xr.DataTree, truth: np.ndarray) -> np.ndarray:
    """(elevation, azimuth) true on a target and within one beam width of its outline."""
    from scipy.ndimage import binary_dilation

    steps = max(1, round(min(beam_width(tree) / _grid_step(tree), max(truth.shape))))
    y, x = np.mgrid[-steps : steps + 1, -steps : steps + 1]
    return np.asarray(binary_dilation(truth >= 0, x * x + y * y <= steps * steps))


def brightest_beam_on_target(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The brightest beam of each frame lies on a target, or within one beam width of its outline.

    Frames without a target in view, or whose echoes are inaudible, do not count.
    """
    hits, seen = 0, 0
    for i in frames:
        energy, truth = _frame(tree, "image/energy", i), _frame(tree, "truth/target", i)
        if not ((truth >= 0).any() and _echoes_heard(tree, i)):
            continue
        if not np.isfinite(energy).any():  # no clock, no image: a miss, unless no snap could be heard
            seen += bool(_snaps_heard(tree, i).any())
            continue
        seen += 1
        hits += bool(near_target(tree, truth)[np.unravel_index(np.nanargmax(energy), energy.shape)])
    if not seen:
        return Check("brightest beam on target", "every frame", "no target in view and heard", None, {})
    return Check(
        "brightest beam on target",
        "every frame",
        f"{hits} of {seen} frames",
        hits == seen,
        {"hits": hits, "frames": seen},
    )


def _echoes_heard(tree: xr.DataTree, frame: int) -> bool:
    """Whether the ledger, where there is one, has an echo less than INAUDIBLE below the direct snap."""
    if "ledger" not in tree.children:
        return True
    level = _frame(tree, "ledger/received_level", frame)  # (snap, echo, family), the direct path last
    echo, direct = (np.max(part, initial=-np.inf, where=np.isfinite(part)) for part in (level[:, :-1], level[:, -1:]))
    return bool(echo > direct - INAUDIBLE)


def _snaps_heard(tree: xr.DataTree, frame: int) -> np.ndarray:
    """(snap,) whether the snap reaches the array directly, by the ledger where there is one."""
    if "ledger" not in tree.children:
        return np.zeros(0, bool)
    return np.asarray(_frame(tree, "ledger/paths", frame)[:, -1].sum(axis=1) > 0)


def _all(tree: xr.DataTree, name: str) -> np.ndarray:
    return np.asarray(tree[name].values)


def _frame(tree: xr.DataTree, name: str, index: int) -> np.ndarray:
    return np.asarray(tree[name].isel(frame=index).values)


def snap_located(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The located snap is within three predicted errors of the true one in 95 % of frames (Mahalanobis distance).

    Three standard errors in each of three axes: the chi-square of three degrees of freedom that has the probability
    of three sigma (99.73 %) is 14.16. A snap whose sound reaches the array directly and that is not found counts too.
    """
    good, total, errors = 0, 0, []
    for i in frames:
        pose = Pose(_frame(tree, "truth/sonar_position", i), _frame(tree, "truth/sonar_orientation", i))
        true = pose.to_body(_frame(tree, "truth/snap_position", i))
        found, covariance = _frame(tree, "bearings/position", i), _frame(tree, "bearings/position_covariance", i)
        reached = _snaps_heard(tree, i)
        rows = np.flatnonzero(np.isfinite(found).all(axis=1))
        total += max(len(rows), int(reached.sum()))
        for row in rows:
            each = np.linalg.norm(true - found[row], axis=1)
            error = found[row] - true[np.argmin(each)]
            errors.append(float(np.min(each)))
            good += bool(error @ np.linalg.solve(covariance[row], error) <= 14.16)
    name, expected = "snap located", "within 3 predicted errors in 95 %"
    if not total:
        return Check(name, expected, "no snap reaches the array", None, {})
    if not errors:
        return Check(name, expected, f"none of {total} found", False, {"good": 0, "found": 0})
    got = f"{good} of {total}, median error {np.median(errors):.3g} m"
    numbers = {"good": good, "found": len(errors), "median_m": float(np.median(errors))}
    return Check(name, expected, got, good >= 0.95 * total, numbers)


def range_errors(tree: xr.DataTree, frames: np.ndarray) -> list[Check]:
    """Range errors of the points on a target, and the count of those off it.

    How large they are depends on the scene (beam width, size of the glints); that they are as predicted does not.
    """
    errors, scaled, off, near, beams = [], [], 0, 0, 0
    for i in frames:
        found, predicted = _frame(tree, "cloud/range", i), _frame(tree, "cloud/range_error", i)
        true, target = _frame(tree, "truth/range", i), _frame(tree, "truth/target", i)
        points, on = np.isfinite(found), target >= 0
        beams += int(on.sum())
        errors.append(np.abs(found - true)[points & on])
        scaled.append(errors[-1] / predicted[points & on])
        off += int((points & ~on).sum())
        near += int((points & ~on & near_target(tree, target)).sum())
    error, ratio = np.concatenate(errors), np.concatenate(scaled)
    if not len(error):
        return [Check("range of points on target", "reported", "no points on a target", None, {"off_target": off})]
    median, share = float(np.median(error)), float(np.mean(ratio <= 3))
    numbers: dict[str, Any] = {
        "points": len(error),
        "median_m": median,
        "share_within_3": share,
        "beams_on_target": beams,
    }
    return [
        Check(
            "range of points on target",
            "reported",
            f"median error {100 * median:.2g} cm over {len(error)} points",
            None,
            numbers,
        ),
        Check("predicted range errors", "90 % within three", f"{100 * share:.3g} %", share >= 0.9, numbers),
        Check(
            "points off target",
            "reported",
            f"{off} ({near} within a beam width of an outline) beside {len(error)} on it",
            None,
            {"off_target": off, "near_outline": near},
        ),
    ]
