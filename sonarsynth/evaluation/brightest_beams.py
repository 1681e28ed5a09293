"""Beams: whether the brightest points at a target."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.detection import beam_widths
from sonarsynth.equations.arrays.apertures import whole_beams_per_width
from sonarsynth.evaluation.checks import SmallVariables, blocks, every, numbered, of_frame, other_sounds
from sonarsynth.evaluation.level_checks import echoes_heard, snaps_heard
from sonarsynth.products import View
from sonarsynth.store.checking.check_rows import Check

if TYPE_CHECKING:
    import xarray as xr


def near_target(truth: np.ndarray, row: int, column: int, reach: tuple[int, int]) -> bool:
    """Whether a beam is on a target, or within `reach` beams of one, along both; truth (elevation, azimuth)."""
    rows, columns = np.nonzero(truth >= 0)
    return bool((((rows - row) / reach[0]) ** 2 + ((columns - column) / reach[1]) ** 2 <= 1.0).any())


def refused(block: SmallVariables, frame: int) -> bool:
    """Whether the snap that would be the clock was refused, and says why."""
    if not block.has("source_estimates/reason"):
        return False
    time = block.of("source_estimates/time", frame)[0]
    return bool(block.of("source_estimates/reason", frame)[0] > 0) and not np.isfinite(time)


GLINT = 10.0
"""dB: a beam on a glint holds so much more of its echo than one on a hull that is seen aside (9 dB in
thermocline.yaml, by the signs of its facets), so a ghost may be brightest though its echoes are together fainter by
this."""


STANDS_OUT = 2.0
"""Energy of the brightest beam over the median of all, under which it is that of noise."""


def on_ghost(block: SmallVariables, frame: int, azimuth: float, elevation: float) -> bool:
    """Whether a direction (rad) is where the truth has a ghost of a target, by surface or bottom, no fainter than the
    target's own echoes by more than `GLINT`.

    Ghosts are as wide as their target; the truth has the middle of their energy, so they reach that far either way.
    """
    if not block.has("truth/targets/echo_azimuth"):
        return False
    ghost = (np.deg2rad(block.of(f"truth/targets/echo_{axis}", frame)[:, 1:]) for axis in ("azimuth", "elevation"))
    box = np.deg2rad(block.of("truth/targets/image_box", frame))[:, None]
    reach = np.nan_to_num(np.stack([box[..., 1] - box[..., 0], box[..., 3] - box[..., 2]]))
    reach += beam_widths(block.tree)[:, None, None]
    off = np.abs(np.stack([middle - angle for middle, angle in zip(ghost, (azimuth, elevation), strict=True)]))
    level = block.of("truth/targets/echo_level", frame)
    loud = level[:, 1:] >= np.nan_to_num(level[:, :1], nan=-np.inf) - GLINT
    return bool(((off <= reach).all(axis=0) & loud).any())  # NaN where no echo comes that way


def louder_outside(block: SmallVariables, frame: int) -> bool:
    """Whether a target out of the view of the beams, which lobes show, echoes as loud as any in view, by `GLINT`."""
    if not block.has("truth/targets/echo_level"):
        return False
    level = np.nan_to_num(block.of("truth/targets/echo_level", frame)[:, 0], nan=-np.inf)
    within = np.isin(block.of("truth/targets/view", frame), (View.IN_VIEW, View.PARTLY_IN_VIEW))
    return bool(level[~within].max(initial=-np.inf) > level[within].max(initial=-np.inf) - GLINT)


def in_box(block: SmallVariables, frame: int, azimuth: float, elevation: float) -> bool:
    """Whether a direction (rad) is in the image box of a target, or within a beam width of it: no beam may point at
    what little of a target is in view."""
    box = np.deg2rad(block.of("truth/targets/image_box", frame))
    width, beam = beam_widths(block.tree), np.array([azimuth, elevation])
    return bool(((beam >= box[:, [0, 2]] - width) & (beam <= box[:, [1, 3]] + width)).all(axis=1).any())


def brightest_beam_on_target(tree: xr.DataTree, frames: np.ndarray) -> Check:
    """The brightest beam of each frame lies on a target, or within one beam width of its outline; or on a ghost of one
    that the truth has, which the check counts and warns of.

    Frames without a target in view, or whose echoes are inaudible, under the noise, or no louder than those of one out
    of view, do not count. A chorus, or anything else that sounds too, may be brighter: that is a warning.
    """
    name, expected = "brightest beam on target", "every frame, or on a ghost by surface or bottom"
    azimuth, elevation = (np.deg2rad(every(tree, f"truth/beams/{axis}")) for axis in ("azimuth", "elevation"))
    reach = whole_beams_per_width(beam_widths(tree), azimuth, elevation)
    hits, ghosts, judged, unlocated, missed = 0, 0, 0, 0, []
    for block, i in ((b, i) for b in blocks(tree, frames) for i in b.frames):
        energy, truth = of_frame(tree, "image/energy", i), of_frame(tree, "truth/beams/target", i)
        if not ((truth >= 0).any() and echoes_heard(block, i)) or louder_outside(block, i):
            continue
        lost = block.has("source_estimates/usable") and not block.of("source_estimates/usable", i)
        if lost or not np.isfinite(energy).any():  # no clock: a miss, unless no snap could be heard or made out
            hit = ghost = False
            counts = bool(snaps_heard(block, i).any()) and not refused(block, i)
            unlocated += counts
        else:
            row, column = map(int, np.unravel_index(np.nanargmax(energy), energy.shape))
            hit = near_target(truth, row, column, reach) or in_box(block, i, azimuth[column], elevation[row])
            counts = hit or bool(energy[row, column] > STANDS_OUT * np.nanmedian(energy))
            ghost = not hit and on_ghost(block, i, azimuth[column], elevation[row])
        judged += counts
        hits += hit
        ghosts += ghost
        if counts and not (hit or ghost):
            missed.append(i)
    if not judged:
        return Check(name, expected, "no target is in view and audible", None, {})
    also, besides = f", on a ghost in {ghosts}" if ghosts else "", " and ".join(other_sounds(tree))
    also += f", {unlocated} missed for want of a located snap" if unlocated else ""
    warning = f"in {ghosts} of {judged} frames the brightest beam is on a ghost by surface or bottom" if ghosts else ""
    if missed and besides:
        also += f", elsewhere in {len(missed)}"
        warning = f"in {len(missed)} of {judged} frames the brightest beam is on no target; also heard: {besides}"
    return Check(
        name,
        expected,
        f"{hits} of {judged} frames{also}",
        None if missed and besides else hits + ghosts == judged,
        {"hits": hits, "frames": judged, "ghosts": ghosts},
        numbered(missed),
        warning=warning,
    )
