"""Beams: whether the brightest points at a target."""

from __future__ import annotations

import numpy as np
import xarray as xr

from sonarsynth.evaluation.checks import Check, every, numbered, of_frame
from sonarsynth.evaluation.level_checks import echoes_heard, snaps_heard


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
        values = every(tree, f"truth/{axis}")
        if len(values) > 1:
            return float(np.deg2rad(np.diff(values).mean()))
    return float("inf")


def near_target(tree: xr.DataTree, truth: np.ndarray) -> np.ndarray:
    """(elevation, azimuth) true on a target and within one beam width of its outline."""
    from scipy.ndimage import binary_dilation

    steps = max(1, round(min(beam_width(tree) / _grid_step(tree), max(truth.shape))))
    y, x = np.mgrid[-steps : steps + 1, -steps : steps + 1]
    return np.asarray(binary_dilation(truth >= 0, x * x + y * y <= steps * steps))


def refused(tree: xr.DataTree, frame: int) -> bool:
    """Whether the snap that would be the clock was refused, and says why."""
    if "bearings" not in tree.children or "reason" not in tree["bearings"].dataset:
        return False
    return bool(of_frame(tree, "bearings/reason", frame)[0] > 0) and not np.isfinite(
        of_frame(tree, "bearings/time", frame)[0]
    )


def brightest_beam_on_target(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The brightest beam of each frame lies on a target, or within one beam width of its outline.

    Frames without a target in view, or whose echoes are inaudible, do not count.
    """
    hits, seen, missed = 0, 0, []
    for i in frames:
        energy, truth = of_frame(tree, "image/energy", i), of_frame(tree, "truth/target", i)
        if not ((truth >= 0).any() and echoes_heard(tree, i)):
            continue
        if not np.isfinite(energy).any():  # no clock, no image: a miss, unless no snap could be heard or made out
            hit, counts = False, bool(snaps_heard(tree, i).any()) and not refused(tree, i)
        else:
            hit, counts = bool(near_target(tree, truth)[np.unravel_index(np.nanargmax(energy), energy.shape)]), True
        seen += counts
        hits += hit
        if counts and not hit:
            missed.append(i)
    if not seen:
        return Check("brightest beam on target", "every frame", "no target is in view and audible", None, {})
    return Check(
        "brightest beam on target",
        "every frame",
        f"{hits} of {seen} frames",
        hits == seen,
        {"hits": hits, "frames": seen},
        numbered(missed),
    )
