"""Truth against data: what a store says it sees, checked against what was there, and what detectors find. Reads plain
xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.detection import beam_width, beam_widths
from sonarsynth.evaluation.brightest_beams import brightest_beam_on_target
from sonarsynth.evaluation.checks import every, numbered
from sonarsynth.evaluation.cloud_scores import cloud_scores
from sonarsynth.evaluation.detectors import TRUTH, DetectorReport, evaluate
from sonarsynth.evaluation.error_bounds import bounds, warnings
from sonarsynth.evaluation.level_checks import link_budget_adds_up, link_budget_measured
from sonarsynth.evaluation.point_checks import points, range_errors
from sonarsynth.evaluation.snr_checks import signal_to_noise
from sonarsynth.evaluation.source_estimates import snap_located
from sonarsynth.evaluation.target_checks import labels_of_targets
from sonarsynth.store import built_frames
from sonarsynth.store.checking.check_rows import Check

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "TRUTH",
    "Check",
    "DetectorReport",
    "beam_width",
    "beam_widths",
    "bounds",
    "brightest_beam_on_target",
    "check",
    "cloud_scores",
    "evaluate",
    "labels_of_targets",
    "link_budget_adds_up",
    "link_budget_measured",
    "points",
    "range_errors",
    "snap_located",
    "warnings",
]

EXPANSION_PHASE = 0.2  # rad: costs a beam 0.09 dB at worst
EXPANSION_AMPLITUDE = 0.02  # of the strongest echo


def check(tree: xr.DataTree) -> list[Check]:
    """All checks of truth against data, over the frames that were built."""
    built = built_frames(tree)
    if not len(built):
        return [Check("frames", "at least one frame built", "none", False, {"frames": 0})]
    checks = [Check("frames", "at least one frame built", f"{len(built)}", True, {"frames": len(built)})]
    if "link_budget" in tree.children:
        checks.append(link_budget_adds_up(tree, built))
        checks.append(link_budget_measured(tree, built))
        checks.append(expansions_hold(tree, built))
    if "image" in tree.children:
        checks.append(brightest_beam_on_target(tree, built))
    if "snr" in tree["truth/targets"].dataset:
        checks.append(signal_to_noise(tree, built))
    if "cloud" in tree.children:
        checks.extend(range_errors(tree, built))
    checks.append(labels_of_targets(tree, built))
    return checks + bounds(tree, built)


def expansions_hold(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """Wavefronts and amplitudes are expanded over the aperture; what that errs by, as traced to probes.

    They may err by as much as was asked of signals. Where the array is cut into subarrays, signals are traced to each
    of them: these are the errors of the array uncut.
    """
    phases = 2 * np.pi * float(tree.attrs["band_high"]) * every(tree, "link_budget/wavefront_error")[frames]
    amplitudes = every(tree, "link_budget/amplitude_error")[frames]
    phase, amplitude = float(phases.max()), float(amplitudes.max())
    most = max(EXPANSION_AMPLITUDE, float(tree.attrs.get("accuracy_signal", 0.0)))
    good_frames = (phases <= EXPANSION_PHASE) & (amplitudes <= most)
    result = f"{phase:.2g} rad at the top of the band, {100 * amplitude:.2g} % of the strongest echo"
    good = phase <= EXPANSION_PHASE and amplitude <= most
    expected = f"under {EXPANSION_PHASE} rad and {100 * most:g} %"
    numbers = {"phase_rad": phase, "amplitude": amplitude}
    if (parts := dict(tree.attrs.get("choices") or {}).get("subarrays", 1)) != 1:
        result += f", if it were not cut into {parts} subarrays"
        return Check("wavefronts over the aperture", "reported", result, None, numbers)
    bad = numbered(frames[~good_frames.reshape(len(frames), -1).all(axis=1)])
    return Check("wavefronts over the aperture", expected, result, good, numbers, bad)
