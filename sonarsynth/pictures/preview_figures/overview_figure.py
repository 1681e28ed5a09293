"""The scene of a sequence from above, from the side and in space: sonar, field of view, tracks, boxes, snaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.style import INK, PALE, RAYS, compass, figure, grid, label, settle
from sonarsynth.pictures.ray_figures.scene_drawing import (
    AXES,
    TRACK,
    VIEW,
    bodies_in_space,
    frame_space,
    lift_names,
    name_beside,
    profile_axes,
    scale_words,
    surface_and_bottom,
    vertical_scale,
)
from sonarsynth.pictures.ray_figures.scene_geometry import SceneGeometry

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D

EDGES = [(a, b) for a, b in combinations(range(8), 2) if (a ^ b).bit_count() == 1]
"""Edges of a box whose corners are numbered by three bits."""
MOST_NAMED = 8
"""Targets that the legend names."""
SNAP = "#d6a100"
DEEP = 4.0
"""Water that is deeper than this many times all that is in it is not drawn down to the bottom."""


@dataclass(frozen=True, eq=False)
class Overview:
    """A scene over its frames; world, m."""

    title: str
    frame: int  # step that is drawn whole
    geometry: SceneGeometry  # of that frame
    boxes: Mapping[str, Floats]  # (step, corner, xyz) of each target: in the first, the drawn and the last frame
    snaps: Floats  # (snap, xyz): of some frames
    depth: Floats
    speed: Floats  # m/s, at these depths

    @property
    def points(self) -> Floats:
        """(point, xyz): all that is to be seen."""
        g = self.geometry
        blocks = [g.array[None], self.snaps, *(box.reshape(-1, 3) for box in self.boxes.values())]
        return np.concatenate([*blocks, *g.tracks.values(), *g.view.values()])

    @property
    def bottom_is_far(self) -> bool:
        """Whether all is so close together that it would be lost in the whole depth of the water."""
        return self.geometry.bottom > DEEP * float(np.ptp(self.points, axis=0).max())

    def colour(self, target: str) -> str:
        """The colour of a target."""
        return RAYS[list(self.boxes).index(target) % len(RAYS)] if target in self.boxes else TRACK


def overview_figure(overview: Overview) -> Figure:
    """The scene of a sequence from above, in space, and from the side beside the sound speed."""
    fig = figure(12.0, 9.0, dpi=110)
    rows = fig.add_gridspec(2, 1, height_ratios=[1.35, 1.0])
    top = rows[0].subgridspec(1, 2, width_ratios=[1.0, 1.15])
    below = rows[1].subgridspec(1, 2, width_ratios=[1.0, 4.6])
    fig.suptitle(overview.title, x=0.01, ha="left", fontsize=12, color=INK)
    above = fig.add_subplot(top[0])
    _from_above(above, overview)
    _in_space(fig.add_subplot(top[1], projection="3d"), overview)
    section = fig.add_subplot(below[1])
    _from_the_side(section, overview)
    profile_axes(fig.add_subplot(below[0], sharey=section), overview.depth, overview.speed, overview.geometry.bottom)
    _legend(fig, overview)
    section.set_title("from the side", fontsize=10, loc="left")
    settle(fig)
    factor = _widen(above)
    low, high = above.get_ylim()
    above.set_ylim(low - 0.5 * (factor - 1.0) * (high - low), high + 0.5 * (factor - 1.0) * (high - low))
    deep = f"; the bottom is at {overview.geometry.bottom:.4g} m" if overview.bottom_is_far else ""
    section.set_title(f"from the side, {scale_words(_widen(section))}{deep}", fontsize=10, color=INK, loc="left")
    lift_names(above)
    lift_names(section)
    return fig


def _from_above(axes: Axes, overview: Overview) -> None:
    geometry = overview.geometry
    grid(axes)
    _flat(axes, overview, lambda points: points[..., :2])
    axes.plot(*geometry.view["across"][:, :2].T, color=VIEW, linewidth=0.9, linestyle="-.")
    _limits(axes, overview.points[:, :2])
    label(axes, AXES[0], AXES[1], "from above, one scale")


def _from_the_side(axes: Axes, overview: Overview) -> None:
    geometry = overview.geometry
    surface_and_bottom(axes, geometry.bottom)
    _flat(axes, overview, geometry.on_plane)
    axes.plot(*geometry.on_plane(geometry.view["upright"]).T, color=VIEW, linewidth=0.9, linestyle="-.")
    projected = geometry.on_plane(overview.points)
    _limits(axes, projected)
    if not overview.bottom_is_far:
        axes.set_ylim(-1.06 * geometry.bottom, 0.06 * geometry.bottom)
    label(axes, f"distance from the array towards {compass(geometry.bearing)} (m)", "", "from the side")
    axes.tick_params(labelleft=False)


def _flat(axes: Axes, overview: Overview, flat: Any) -> None:
    """What both sections hold; flat: of points (..., xyz) the two coordinates that are drawn."""
    geometry = overview.geometry
    for name, track in geometry.tracks.items():
        line = flat(track)
        axes.plot(*line.T, color=overview.colour(name), linewidth=1.0, linestyle="--")
        if np.ptp(line, axis=0).any():
            _arrow(axes, line, overview.colour(name))
    for name, boxes in overview.boxes.items():
        for corners, strength in zip(boxes, _strengths(len(boxes)), strict=True):
            at = flat(corners)
            lines = np.stack([at[[a, b]] for a, b in EDGES])
            axes.plot(*lines.transpose(2, 1, 0), color=overview.colour(name), linewidth=1.0, alpha=strength)
        body = flat(boxes[len(boxes) // 2])
        name_beside(axes, name, np.array([body[:, 0].mean(), body[:, 1].max()]), over=True)
    axes.plot(*flat(overview.snaps).T, "*", color=SNAP, markersize=6, markeredgewidth=0, alpha=0.8)
    axes.plot(*flat(geometry.sensors).T, "s", color=INK, markersize=1.5, zorder=5)
    name_beside(axes, "array", flat(geometry.array[None])[0])


def _arrow(axes: Axes, line: Floats, colour: str) -> None:
    """The end of a track (point, 2), as an arrow head along it."""
    axes.annotate(
        "",
        xy=line[-1],
        xytext=line[-2],
        arrowprops={"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12},
    )


def _strengths(boxes: int) -> list[float]:
    """How opaque each of a target's boxes is: the one in the middle most."""
    return [1.0 if n == boxes // 2 else 0.35 for n in range(boxes)]


def _in_space(axes: Axes3D, overview: Overview) -> None:
    geometry = overview.geometry
    bodies_in_space(axes, geometry.hulls)
    for line in geometry.view.values():
        axes.plot(*line.T, color=VIEW, linewidth=0.8, linestyle="-.")
    for name, track in geometry.tracks.items():
        axes.plot(*track.T, color=overview.colour(name), linewidth=1.0, linestyle="--")
    for name, boxes in overview.boxes.items():
        for corners, strength in zip(boxes, _strengths(len(boxes)), strict=True):
            for a, b in EDGES:
                axes.plot(*corners[[a, b]].T, color=overview.colour(name), linewidth=0.8, alpha=strength)
    axes.scatter(*overview.snaps.T, s=22, marker="*", color=SNAP, depthshade=False)
    axes.scatter(*geometry.sensors.T, s=0.5, color=INK, depthshade=False)
    over = np.append(geometry.array[:2], geometry.sensors[:, 2].max())
    axes.text(*over, "array", fontsize=9, color=INK, ha="center", va="bottom")
    factor = frame_space(axes, overview.points, geometry.bearing)
    axes.set_title(f"in space, {scale_words(factor)}", fontsize=10, color=INK, loc="left")


def _limits(axes: Axes, points: Floats) -> None:
    """Limits that hold points (point, 2) and a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.06 * max(float((high - low).max()), 1e-3)
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))


def _widen(axes: Axes) -> float:
    """Widen the distances until heights are not drawn smaller; returns how many times larger they are drawn."""
    factor = vertical_scale(axes)
    if factor >= 1.0:
        return factor
    left, right = axes.get_xlim()
    more = 0.5 * (right - left) * (1.0 / factor - 1.0)
    axes.set_xlim(left - more, right + more)
    return vertical_scale(axes)


def _legend(fig: Figure, overview: Overview) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=VIEW, linestyle="-.", label="field of view on its two planes")]
    names = list(overview.boxes)
    for name in names[:MOST_NAMED]:
        track = ", track" if name in overview.geometry.tracks else ""
        handles.append(Line2D([], [], color=overview.colour(name), linestyle="--", label=f"{name}: box{track}"))
    if len(names) > MOST_NAMED:
        handles.append(Line2D([], [], color=PALE, linestyle="--", label=f"and {len(names) - MOST_NAMED} more targets"))
    if "array" in overview.geometry.tracks:
        handles.append(Line2D([], [], color=TRACK, linestyle="--", label="track of the array"))
    if len(overview.snaps):
        handles.append(Line2D([], [], color=SNAP, marker="*", linestyle="", label="snaps"))
    if any(len(boxes) > 1 for boxes in overview.boxes.values()):
        pale = f"strong: frame {overview.frame}; pale: first and last frame"
        handles.append(Line2D([], [], color=PALE, label=pale))
    fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6), fontsize=8, frameon=False)
