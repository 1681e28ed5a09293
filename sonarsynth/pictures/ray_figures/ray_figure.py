"""Rays in the water: a section with the sound speed beside it, and rays in space (figures 14 to 16 of the thesis)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sonarsynth.conventions import Floats
from sonarsynth.pictures.figures.outlines import union_outline
from sonarsynth.pictures.figures.style import ERROR_MAP, INK, PALE, compass, figure, label
from sonarsynth.pictures.ray_figures.ray_styles import (
    COLOURS,
    MARKERS,
    Look,
    Style,
    drawing_order,
    highest_coefficient,
    styles,
)
from sonarsynth.pictures.ray_figures.scene_drawing import (
    TRACK,
    VIEW,
    bodies_in_space,
    frame_space,
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

WIDTH = 8.0
"""Inches of a section; its height is that of equal scales, within `HEIGHTS`."""
HEIGHTS = (1.7, 5.5)


def section_figure(
    title: str, rays: Sequence[Floats], looks: Sequence[Look], depth: Floats, speed: Floats, geometry: SceneGeometry
) -> Figure:
    """Rays (each (point, xyz) in m, world) seen on the plane of a section, beside the sound speed (m/s).

    Both axes have one scale where that fits; else the title says how much larger heights are drawn.
    """
    flat = [geometry.on_plane(ray) for ray in rays]
    ends = [*geometry.places.values(), *(hull.vertices for hull in geometry.hulls)]
    across = np.concatenate([*flat, *(geometry.on_plane(np.atleast_2d(points)) for points in ends)])[:, 0]
    margin = 0.04 * np.ptp(across) or 1.0
    left, right = float(across.min()) - margin, float(across.max()) + margin
    fig = figure(WIDTH + 3.2, 4.0, dpi=110)
    layout = fig.add_gridspec(1, 2, width_ratios=[1.0, 4.0])
    section = fig.add_subplot(layout[1])
    section.set(xlim=(left, right), ylim=(-1.06 * geometry.bottom, 0.06 * geometry.bottom))
    _section(section, geometry)
    drawn = styles(looks)
    for i in drawing_order(looks):
        _draw(section, flat[i], looks[i], drawn[i])
    label(section, f"distance from the array towards {compass(geometry.bearing)} (m)", "")
    profile_axes(fig.add_subplot(layout[0], sharey=section), depth, speed, geometry.bottom)
    _legend(fig, looks, [("field of view", VIEW, "-.")])
    _colour_bar(fig, section, looks)
    section.set_title(" ", fontsize=10, color=INK, loc="left")
    factor = _equal_scales(fig, section)
    section.set_title(f"{title}; {scale_words(factor)}", fontsize=10, color=INK, loc="left")
    return fig


def _equal_scales(fig: Figure, axes: Axes) -> float:
    """Give a figure the height at which the scales of axes are equal, within HEIGHTS; returns z over x that is left."""
    for _ in range(2):
        fig.draw_without_rendering()  # the axes find their place
        box, (left, right), (low, high) = axes.get_window_extent(), axes.get_xlim(), axes.get_ylim()
        inches, wide = box.height / fig.dpi, box.width / fig.dpi
        fig.set_figheight(fig.get_figheight() + np.clip(wide * (high - low) / (right - left), *HEIGHTS) - inches)
    fig.draw_without_rendering()
    return vertical_scale(axes)


def _section(axes: Axes, geometry: SceneGeometry) -> None:
    """Surface, bottom, field of view, targets, hydrophones and named places on the plane of a section."""
    surface_and_bottom(axes, geometry.bottom)
    axes.plot(*geometry.on_plane(geometry.view["upright"]).T, color=VIEW, linewidth=0.8, linestyle="-.")
    for hull in geometry.hulls:
        body = geometry.on_plane(hull.vertices)
        for line in union_outline(body, hull.faces):
            axes.fill(*line.T, facecolor="#d9d9d9", edgecolor=INK, linewidth=0.8)
        name_beside(
            axes, hull.name, np.array([0.5 * (body[:, 0].min() + body[:, 0].max()), body[:, 1].max()]), over=True
        )
    axes.plot(*geometry.on_plane(geometry.sensors).T, "s", color=INK, markersize=2.0, zorder=5)
    for name, point in geometry.places.items():
        projected = geometry.on_plane(point[None])[0]
        axes.plot(*projected, "o", color=INK, markersize=4, zorder=5)
        name_beside(axes, name, projected)


def _draw(axes: Axes, points: Floats, look: Look, style: Style) -> None:
    """A ray (point, 2 or 3) and its vertices."""
    line = ":" if style.hidden else "-"
    axes.plot(*points.T, color=style.colour, linewidth=style.width, linestyle=line)
    for event, marker in MARKERS.items() if style.marked else ():
        at = points[[e == event for e in look.event]]
        if len(at):
            axes.plot(*at.T, marker, color=style.colour, markersize=4)


def _legend(fig: Figure, looks: Sequence[Look], lines: Sequence[tuple[str, str, str]]) -> None:
    """One legend under the figure: rays by their labels, marks of vertices, other lines (name, colour, dashes)."""
    from matplotlib.lines import Line2D

    drawn = styles(looks)
    first = [*COLOURS, *(s.label for s in drawn)]
    rays = {s.label: s for s in sorted(drawn, key=lambda s: first.index(s.label))}
    handles = [Line2D([], [], color=s.colour, label=name) for name, s in rays.items() if "sent on" not in name]
    if any(s.hidden for s in drawn):
        handles.append(Line2D([], [], color=INK, linestyle=":", label="hidden by a target"))
    met = {event for look, s in zip(looks, drawn, strict=True) if s.marked for event in look.event}
    marks = {marker: "target" if event == "facet" else event for event, marker in MARKERS.items() if event in met}
    for marker, event in marks.items():
        name = event if event == "turning point" else f"reflected by {event}"
        handles.append(Line2D([], [], color=INK, marker=marker, linestyle="", markersize=4, label=name))
    handles += [Line2D([], [], color=c, linestyle=dash, label=name) for name, c, dash in lines]  # type: ignore[arg-type]
    fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6), fontsize=8, frameon=False)


def _colour_bar(fig: Figure, axes: Axes, looks: Sequence[Look], pad: float = 0.02) -> None:
    """The scale of the coefficients, where rays have one."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    if highest := highest_coefficient(looks):
        bar = fig.colorbar(ScalarMappable(Normalize(0.0, highest), ERROR_MAP), ax=axes, shrink=0.8, pad=pad)
        bar.set_label("coefficient of scattering", fontsize=8, color=INK)
        bar.ax.tick_params(labelsize=8)


def space_figure(title: str, rays: Sequence[Floats], looks: Sequence[Look], geometry: SceneGeometry) -> Figure:
    """Rays (each (point, xyz) in m, world) in space, with tracks and field of view, and the array."""
    fig = figure(11.0, 5.6, dpi=110)
    layout = fig.add_gridspec(2, 2, width_ratios=[3.4, 1.0])
    axes: Axes3D = fig.add_subplot(layout[:, 0], projection="3d")
    bodies_in_space(axes, geometry.hulls)
    lines = [("field of view, at the array's elevation", VIEW, "-.")]
    axes.plot(*geometry.view["across"].T, color=VIEW, linewidth=0.8, linestyle="-.")
    for name, track in geometry.tracks.items():
        axes.plot(*track.T, color=TRACK, linewidth=1.0, linestyle="--")
        towards = np.arctan2(*(track[-1] - track[0])[[1, 0]])
        lines.append((f"track of {name}, towards {compass(towards)}", TRACK, "--"))
    drawn = styles(looks)
    for i in drawing_order(looks):
        _draw(axes, rays[i], looks[i], drawn[i])
    axes.scatter(*geometry.sensors.T, s=0.6, color=INK, depthshade=False)
    for name, position in geometry.places.items():
        axes.scatter(*position, s=22, color=INK, depthshade=False)
        over = position if name != "array" else np.append(position[:2], geometry.sensors[:, 2].max())
        beside = {"ha": "center", "va": "bottom"} if name == "array" else {}
        axes.text(*over, name if beside else f"  {name}", fontsize=9, color=INK, **beside)
    for hull in geometry.hulls:
        top = hull.vertices[np.argmax(hull.vertices[:, 2])]
        axes.text(*top, f"{hull.name}\n", fontsize=9, color=INK, ha="center", va="bottom", linespacing=0.5)
    every = [*rays, *(hull.vertices for hull in geometry.hulls), *geometry.tracks.values(), geometry.view["across"]]
    every += [p[None] for p in geometry.places.values()]
    factor = frame_space(axes, np.concatenate(every), geometry.bearing)
    _face(fig.add_subplot(layout[0, 1]), geometry)
    _legend(fig, looks, lines)
    _colour_bar(fig, axes, looks, pad=0.14)
    fig.suptitle(f"{title}; {scale_words(factor)}", x=0.01, ha="left", fontsize=11, color=INK)
    return fig


def _face(axes: Axes, geometry: SceneGeometry) -> None:
    """The elements as one sees them who looks along the sonar's axis (figure 9 of the thesis): port on the left."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    array = geometry.elements
    side = 100.0 * (array.face or 0.3 * array.pitch or 0.05 * array.aperture)
    places = 100.0 * array.position[:, 1:]
    squares = [Rectangle((y - 0.5 * side, z - 0.5 * side), side, side) for y, z in places]
    colours = np.where(array.gain > 0, INK, "none")
    axes.add_collection(PatchCollection(squares, facecolors=list(colours), edgecolors=PALE, linewidths=0.3))
    reach = 1.1 * (100.0 * array.aperture + side)
    axes.set(xlim=(reach, -reach), ylim=(-reach, reach), aspect="equal")
    dead = int(np.sum(array.gain == 0))
    name = f"array of {array.count} hydrophones" + (f", {dead} dead" if dead else "")
    label(axes, "port, y (cm)", "up, z (cm)", name)
