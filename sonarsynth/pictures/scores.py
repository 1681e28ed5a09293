"""Numbers to compare stores by: how well one agrees with its own truth, how loud its echoes are, what it cost."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import REFERENCE_PRESSURE, Floats, Ints, aligned
from sonarsynth.evaluation import brightest_beam_on_target, range_errors
from sonarsynth.evaluation.point_checks import has_labels
from sonarsynth.evaluation.point_checks import points as points_of
from sonarsynth.pictures.figures.style import decibels
from sonarsynth.pictures.store_reading import needed
from sonarsynth.store import Folder, here
from sonarsynth.store.files.json_lines import read_lines
from sonarsynth.store.files.within import Mismatch

if TYPE_CHECKING:
    import xarray as xr

LEVEL = "dB re 1 uPa2 s"

STAGES = {"trace": "tracing", "beamform": "signals and beams", "range": "ranging"}
"""Stages of the file of run times, as they are called in a table."""

SPEED = "frames per second, one core"

UNKNOWN = "-"


@dataclass(frozen=True, eq=False)
class EchoEnergies:
    """What a store hears in each of some frames."""

    peak: float  # Pa2 s: the brightest beam of all; 0 where nothing is heard
    on_target: Floats  # (frame,) Pa2 s: mean over the beams that point at a target; NaN where none does
    points: Ints  # (frame,) points of the cloud that are direct echoes of a target
    beams: Ints  # (frame,) beams that point at a target

    @property
    def reference(self) -> float:
        """What levels are drawn re (Pa2 s): the brightest beam; 1 where nothing is heard."""
        return self.peak or 1.0


def echo_energies(tree: xr.DataTree, frames: Sequence[int]) -> EchoEnergies:
    """What a store with an image hears in frames, read one by one."""
    peaks, means, points, beams = [], [], [], []
    for frame in frames:
        energy = needed(tree, "image/energy", frame).astype(float)
        on = needed(tree, "truth/beams/target", frame) >= 0
        judged = points_of(tree, [frame]).judged if has_labels(tree) else np.zeros(0, bool)
        peaks.append(np.max(energy, initial=0.0, where=np.isfinite(energy)))
        means.append(energy[on].mean() if on.any() else np.nan)
        points.append(np.count_nonzero(judged))
        beams.append(np.count_nonzero(on))
    return EchoEnergies(float(max(peaks)), np.array(means), np.array(points), np.array(beams))


def scores_of(tree: xr.DataTree, store: Folder, frames: Sequence[int], sound: EchoEnergies) -> dict[str, str]:
    """Rows of a table about frames of a store that has an image, by name.

    Costs are medians over the frames, of the processor time of one core: the first frame of a process also waits for
    compilers and tables.
    """
    return {
        **_ranges(tree, np.asarray(frames)),
        **_echoes(tree, np.asarray(frames), sound),
        **_costs(here(store, "times.jsonl"), frozenset(frames)),
    }


def _ranges(tree: xr.DataTree, frames: np.ndarray) -> dict[str, str]:
    checks = range_errors(tree, frames) if "cloud" in tree.children else []
    numbers: dict[str, Any] = {}
    for check in checks:
        numbers |= check.numbers
    median, share = numbers.get("median_m"), numbers.get("share_within_3")
    return {
        "median range error": UNKNOWN if median is None else f"{100 * median:.3g} cm",
        "within 3 predicted errors": UNKNOWN if share is None else f"{100 * share:.3g} %",
        "points on target": f"{numbers['points']}" if "points" in numbers else UNKNOWN,
        "points off target": f"{numbers['off_target']}" if "off_target" in numbers else UNKNOWN,
    }


def _echoes(tree: xr.DataTree, frames: np.ndarray, sound: EchoEnergies) -> dict[str, str]:
    """Whether the brightest beam hits, and levels of the beams that point at a target."""
    hits = brightest_beam_on_target(tree, frames).numbers
    echoes = sound.on_target[np.isfinite(sound.on_target)]
    return {
        "brightest beam on target": f"{hits['hits']} of {hits['frames']} frames" if hits else UNKNOWN,
        "mean echo on target": _level(float(echoes.mean())) if len(echoes) else UNKNOWN,
        "its median over frames": _level(float(np.median(echoes))) if len(echoes) else UNKNOWN,
        "brightest beam, drawn as 0 dB": _level(sound.peak),
    }


def _level(energy: float) -> str:
    return f"{decibels(energy, REFERENCE_PRESSURE**2):.1f} dB" if energy > 0 else "silent"


def _costs(file: Path, frames: frozenset[int]) -> dict[str, str]:
    """Median processor time of each stage and of all, from the file of run times; the last time a frame was built."""
    entries = [row for row in _rows(file) if row.get("frame") in frames]
    tasks = max((set(row["cpu"]) for row in entries), key=len, default=set())  # a frame that failed lacks some
    rows = {row["frame"]: row["cpu"] for row in entries if set(row["cpu"]) == tasks}
    called = [f"CPU per frame: {name}" for name in (*STAGES.values(), "all")]
    if not rows:
        return dict.fromkeys([*called, SPEED], UNKNOWN)
    spent = np.array([[cpu.get(stage, 0.0) for stage in STAGES] for cpu in rows.values()])
    medians = [*np.median(spent, axis=0), np.median(spent.sum(axis=1))]
    costs = {
        name: f"{1e3 * cost:.3g} ms" if cost < 1.0 else f"{cost:.3g} s"
        for name, cost in zip(called, medians, strict=True)
    }
    return costs | {SPEED: f"{1 / medians[-1]:.3g}" if medians[-1] > 0 else UNKNOWN}


def _rows(file: Path) -> list[dict[str, Any]]:
    """Rows of frames in the file of run times; none where it is not there."""
    with suppress(OSError, Mismatch):
        return [row for row in read_lines(file) if isinstance(row.get("cpu"), dict) and "frame" in row]
    return []


def as_table(names: Sequence[str], standings: Sequence[dict[str, str]]) -> str:
    """Standings of stores side by side, in text; levels are in `LEVEL`."""
    return "\n".join(aligned([["", *names], *([row, *(s[row] for s in standings)] for row in standings[0])]))
