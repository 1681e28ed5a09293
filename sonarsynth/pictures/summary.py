"""A store in a few lines of text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import counted, evenly
from sonarsynth.evaluation import bounds, brightest_beam_on_target, range_errors
from sonarsynth.pictures.store_reading import built, echo_levels, mesh_group, needed, read
from sonarsynth.products import View
from sonarsynth.store import Folder, Remote, beside, ranges
from sonarsynth.store.files.json_lines import read_lines

if TYPE_CHECKING:
    import xarray as xr

VARIABLES = {
    "signals": "signals/pressure",
    "image": "image/energy",
    "cloud": "cloud/range",
    "sources": "source_estimates/position",
}
"""The variable that stands for each group in a summary."""

JUDGED = 500
"""Frames that pictures judge at most, spread over all: to read one takes some 20 ms where each is in another file."""


def summary(tree: xr.DataTree, store: Folder) -> str:
    """What a store holds, of the frames that were built, and how well these agree with their own truth (of more than
    `JUDGED`, some spread over all)."""
    frames = built(tree)
    size = bytes_of(store)
    lines = [
        f"{store.name}: {tree.attrs.get('title') or 'untitled'}",
        f"  frames     {built_of(tree, store)}" + (f", {size / 1e6:.1f} MB on disk" if size else ""),
        *(f"  {name:10s} {_shape(tree, variable)}" for name, variable in VARIABLES.items()),
    ]
    if not len(frames):
        return "\n".join(lines)
    judged, some = spread(frames), []
    if len(judged) < len(frames):
        some = [f"  judged     {len(judged)} of these frames, spread over all ('sonarsynth verify' reads every one)"]
    return "\n".join([*lines, *_targets(tree, frames), *some, *_agreement(tree, judged)])


def built_of(tree: xr.DataTree, store: Folder | None) -> str:
    """How many frames of a tree were built, and which; and which failed, where the place of its store is known."""
    numbers, there = np.asarray(tree["truth"].dataset["frame"].values), built(tree)  # of a selection too
    frames, missing = numbers[there].tolist(), set(np.delete(numbers, there).tolist())
    rows = [] if store is None or not missing else read_lines(beside(store, "failed.jsonl"))
    failed = sorted(missing.intersection(row["frame"] for row in rows if isinstance(row.get("frame"), int)))
    which = f" ({ranges(frames)})" if frames and missing else ""
    gone = f", {len(failed)} failed ({ranges(failed)})" if failed else ""
    return f"{len(frames)} of {len(numbers)} built{which}{gone}"


def spread(frames: np.ndarray) -> np.ndarray:
    """The frames that are judged: all, or `JUDGED` of them, spread evenly."""
    return frames[evenly(len(frames), JUDGED)]


def _shape(tree: xr.DataTree, name: str) -> str:
    group, variable = name.split("/")
    if group not in tree.children or variable not in tree[group].dataset:
        return "not in this store"
    data = tree[group].dataset[variable]
    units = data.attrs.get("units", "")
    return " x ".join(f"{size} {dim}" for dim, size in data.sizes.items()) + f" ({units})"


def _targets(tree: xr.DataTree, frames: np.ndarray) -> list[str]:
    names = read(tree, "truth/targets/target")
    if names is None or not len(names):
        return ["  targets    none"]
    sonar, position = needed(tree, "truth/sonar_position"), needed(tree, "truth/targets/position")
    away = np.linalg.norm(position[frames] - sonar[frames, None], axis=2)
    visible = (needed(tree, "truth/targets/visible_fraction")[frames] > 0).sum(axis=0)
    view = read(tree, "truth/targets/view")
    inside = None if view is None else np.isin(view[frames], (View.IN_VIEW, View.PARTLY_IN_VIEW)).sum(axis=0)
    snr, lines = read(tree, "truth/targets/snr"), []
    for i, name in enumerate(map(str, names)):
        distance = away[np.isfinite(away[:, i]), i]
        if not len(distance):
            lines.append(f"  target     {name}: in none of these frames")
            continue
        facets = _facets(tree, i, frames[np.isfinite(away[:, i])])
        reach = f"{distance.min():.2f} to {distance.max():.2f} m away"
        ratio = "" if snr is None or not np.isfinite(snr[frames, i]).any() else _ratios(snr[frames, i])
        within = "" if inside is None or inside[i] == visible[i] else f" ({inside[i]} within the beams)"
        seen = counted(int(visible[i]), "frame")
        lines.append(f"  target     {name}: {facets}{reach}, in sight in {seen}{within}{ratio}")
    return [*lines, *_ghosts(tree, frames, list(map(str, names)))]


def _facets(tree: xr.DataTree, target: int, frames: np.ndarray) -> str:
    """How many facets a target has in some frames, whose meshes may differ; nothing where none is stored."""
    _, first = np.unique(needed(tree, "truth/targets/mesh")[frames, target], return_index=True)
    meshes = (read(tree, f"{mesh_group(tree, target, int(frame))}/faces") for frame in frames[first])
    counts = [len(faces) for faces in meshes if faces is not None]
    several = f"{min(counts)} to " if len(set(counts)) > 1 else ""
    return f"{several}{max(counts)} facets, " if counts else ""


def _ratios(snr: np.ndarray) -> str:
    """Signal-to-noise ratios (frame,) in dB in a few words."""
    finite = snr[np.isfinite(snr)]
    return f", snr {finite.min():.0f} to {finite.max():.0f} dB (median {np.median(finite):.0f})"


def _ghosts(tree: xr.DataTree, frames: np.ndarray, names: list[str]) -> list[str]:
    """Levels of each target's echoes by the boundaries they touched on their way to the array, medians over frames."""
    echoes = echo_levels(tree, frames)
    if echoes is None:
        return []
    decibels, families = echoes
    lines = []
    for i, name in enumerate(names):
        ghosts = [
            f"{family} {np.nanmedian(decibels[:, i, k]):+.1f} dB"
            for k, family in enumerate(families)
            if family != "direct" and np.isfinite(decibels[:, i, k]).any()
        ]
        direct = np.isfinite(decibels[:, i, families.index("direct")]).any()
        if ghosts:
            lines.append(f"  ghosts     {name}: {', '.join(ghosts)} re its {'direct' if direct else 'strongest'} echo")
    return lines


def _agreement(tree: xr.DataTree, frames: np.ndarray) -> list[str]:
    checks = []
    if "image" in tree.children:
        checks.append(brightest_beam_on_target(tree, frames))
    if "cloud" in tree.children:
        checks += range_errors(tree, frames)
    checks += bounds(tree, frames)
    warnings = [check.warning for check in checks if check.warning]
    return [*(f"  {check.name}: {check.got}" for check in checks), *(f"  warning: {warning}" for warning in warnings)]


def bytes_of(store: Folder) -> int:
    """Bytes of the files of a store; 0 where nobody can list them."""
    if isinstance(store, Remote):
        return sum(store.sizes().values()) if store.listed else 0
    return sum(path.stat().st_size for path in store.rglob("*") if path.is_file())
