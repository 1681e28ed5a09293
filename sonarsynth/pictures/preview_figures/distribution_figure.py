"""How ranges, angles and views of targets are distributed over the frames of a recipe, by target and by split."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Bools, Floats, Ints
from sonarsynth.pictures.figures.style import INK, PALE, RAYS, figure, grid, label
from sonarsynth.products import SPLITS
from sonarsynth.recipe.sampled_geometry import SampledGeometry

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BINS = 30
MOST_GROUPS = 7
"""Groups that are drawn apart; the others together."""
AXES = {
    "range": "range (m)",
    "aspect": "aspect (deg): 0 bow, 90 port of the target",
    "azimuth": "azimuth (deg), port positive",
    "elevation": "elevation (deg), up positive",
    "visible": "visible share of the facing area",
}


def distribution_figure(sampled: SampledGeometry) -> Figure:
    """Histograms of QUANTITIES and of the number of targets in view: counts by target, and shares by split."""
    splits = [i for i in range(len(SPLITS)) if (sampled.split == i).any()]
    columns = 2 if len(splits) > 1 else 1
    fig = figure(6.4 * columns if columns > 1 else 7.5, 13.5, dpi=100)
    title = f"{sampled.recipe.title or 'untitled'}\n{sampled.how}; straight lines from the array centre"
    fig.suptitle(title, x=0.01, ha="left", fontsize=11, color=INK)
    panels = fig.subplots(len(AXES) + 1, columns, squeeze=False)
    row, names = _few(sampled)
    of_row = [(name, row == i) for i, name in enumerate(names)]
    of_split = [(SPLITS[i], sampled.split[sampled.frame] == i) for i in splits]
    for (name, text), axes in zip(AXES.items(), panels, strict=False):
        values = sampled.columns[name]
        visible = np.ones(len(values), bool) if name == "visible" else sampled.columns["visible"] > 0.0
        edges = _edges(name, values[visible], sampled)
        _by_target(axes[0], values, [(group, mask & visible) for group, mask in of_row], edges)
        label(axes[0], text, "targets in frames")
        if columns > 1:
            _by_split(axes[1], values, [(group, mask & visible) for group, mask in of_split], edges)
            label(axes[1], text, "share of the split")
        if name in ("azimuth", "elevation"):
            _field_of_view(axes, name, sampled)
    _in_view(panels[-1], sampled, splits)
    panels[0, 0].set_title("by target, of those in view", fontsize=10, color=INK, loc="left")
    _legend(panels[0, 0], names)
    if columns > 1:
        panels[0, 1].set_title("by split", fontsize=10, color=INK, loc="left")
        sequences = np.bincount(sampled.recipe.spanned.split, minlength=len(SPLITS))
        _legend(panels[0, 1], [f"{SPLITS[i]}: {sequences[i]} sequences" for i in splits])
    return fig


def _few(sampled: SampledGeometry) -> tuple[Ints, list[str]]:
    """Group (row,) of each row and the names of groups, small ones put together where there are many."""
    names = list(sampled.groups)
    if len(names) <= MOST_GROUPS:
        return sampled.group, names
    rank = np.argsort(np.argsort(-np.bincount(sampled.group, minlength=len(names)), kind="stable"))
    few = MOST_GROUPS - 1
    largest = [names[i] for i in np.argsort(rank)[:few]]
    return np.minimum(rank[sampled.group], few), [*largest, f"{len(names) - few} others"]


def _edges(name: str, values: Floats, sampled: SampledGeometry) -> Floats:
    """Edges of bins: of the whole circle, of the field of view, or of the values."""
    if name == "aspect":
        return np.linspace(-180.0, 180.0, 37)
    if name == "visible":
        return np.linspace(0.0, 1.0, 21)
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 1.0)
    if name in ("azimuth", "elevation"):
        half = _half_span(name, sampled)
        low, high = min(low, -half), max(high, half)
    wide, size = high - low, max(abs(low), abs(high), 1.0)
    room = 0.02 * wide if wide > 1e-3 * size else 0.01 * size  # of one value alone, ticks that can be read
    return np.linspace(low - room, high + room, BINS + 1)


def _half_span(name: str, sampled: SampledGeometry) -> float:
    beams = sampled.recipe.scene.sonar.beams
    return float(np.rad2deg(0.5 * (beams.azimuth_span if name == "azimuth" else beams.elevation_span)))


def _by_target(axes: Axes, values: Floats, groups: Sequence[tuple[str, Bools]], edges: Floats) -> None:
    """Bars of all groups on top of each other."""
    grid(axes)
    below = np.zeros(len(edges) - 1)
    for i, (_, mask) in enumerate(groups):
        count = np.histogram(values[mask], edges)[0]
        axes.bar(edges[:-1], count, np.diff(edges), below, align="edge", color=RAYS[i % len(RAYS)], linewidth=0)
        below += count
    axes.set(xlim=(edges[0], edges[-1]), ylim=(0.0, 1.06 * max(float(below.max()), 1.0)))
    axes.locator_params(axis="y", integer=True)


def _by_split(axes: Axes, values: Floats, groups: Sequence[tuple[str, Bools]], edges: Floats) -> None:
    """A line for each group, as shares, so that splits of other sizes can be compared."""
    grid(axes)
    for i, (_, mask) in enumerate(groups):
        share = np.histogram(values[mask], edges)[0] / max(int(mask.sum()), 1)
        axes.stairs(share, edges, color=RAYS[i], linewidth=1.4)
    axes.set_xlim(edges[0], edges[-1])
    axes.set_ylim(bottom=0.0)


def _field_of_view(row: Sequence[Axes], name: str, sampled: SampledGeometry) -> None:
    for axes in row:
        for sign in (-1.0, 1.0):
            axes.axvline(sign * _half_span(name, sampled), color=PALE, linewidth=1.0, linestyle="-.")
        axes.annotate(
            "dash-dotted: field of view", (0.96, 0.9), xycoords="axes fraction", ha="right", fontsize=7, color=PALE
        )


def _in_view(row: Sequence[Axes], sampled: SampledGeometry, splits: Sequence[int]) -> None:
    """Frames by the number of targets in view, and the same as shares of each split."""
    number = sampled.in_view
    values = np.arange(int(number.max(initial=0)) + 1)
    grid(row[0])
    row[0].bar(values, np.bincount(number, minlength=len(values)), 0.6, color=PALE)
    row[0].locator_params(axis="y", integer=True)
    label(row[0], "targets in view", "frames")
    if len(row) > 1:
        grid(row[1])
        width = 0.8 / len(splits)
        for slot, i in enumerate(splits):
            own = number[sampled.split == i]
            share = np.bincount(own, minlength=len(values)) / max(len(own), 1)
            row[1].bar(values + (slot - 0.5 * (len(splits) - 1)) * width, share, width, color=RAYS[i])
        label(row[1], "targets in view", "share of the split")
    for axes in row:
        axes.set_xticks(values if len(values) <= 15 else values[:: len(values) // 15 + 1])
        axes.set_xlim(-0.6, values[-1] + 0.6)


def _legend(axes: Axes, names: Sequence[str]) -> None:
    from matplotlib.patches import Patch

    if names:
        handles = [Patch(color=RAYS[i % len(RAYS)], label=name) for i, name in enumerate(names)]
        axes.legend(
            handles=handles,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.16),
            ncols=4,
            fontsize=8,
            frameon=False,
            borderpad=0,
        )
